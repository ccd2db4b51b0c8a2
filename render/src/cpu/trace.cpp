#include "cpu/trace.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hpsdf::render {
namespace {

// All lengths in domain diagonals; kNudge and kPastFace are the same in the shaders.
constexpr double kNudge = 1e-6;      // beyond a face; also the shortest step
constexpr double kPastFace = 4e-7;   // of the grid: how far past a face of a node, at most, its neighbour is entered
constexpr double kConverged = 1e-8;  // change of the root between two steps of its refinement
constexpr double kGrain = 0.25;      // in a weight's reach: steps where a blended field may be zero; as in the shader
constexpr int kMostSteps = 1 << 16;
constexpr int kMostRefinements = 24;

/// Calls f(coefficients) with a pointer to the leaf's coefficients, of either type.
template <typename F>
auto withCoefficients(const FieldData& field, std::uint32_t leaf, F&& f) {
  return std::visit([&](const auto& c) { return f(c.data() + node::offset(field.nodes[leaf])); }, field.coefficients);
}

/// L_i(x) and L_i'(x) for i = 0..degree.
struct Legendre {
  Legendre(double x, int degree) {
    value[0] = 1;
    derivative[0] = 0;
    for (int i = 1; i <= degree; ++i) {
      const double before = i > 1 ? value[i - 2] : 0;
      value[i] = ((2 * i - 1) * x * value[i - 1] - (i - 1) * before) / i;
      derivative[i] = (2 * i - 1) * value[i - 1] + (i > 1 ? derivative[i - 2] : 0);
    }
  }
  std::array<double, kMaxDegree + 1> value;
  std::array<double, kMaxDegree + 1> derivative;
};

template <typename T>
Sample evaluateWithGradient(const T* c, int degree, const Vector3& local) {
  const Legendre x(local.x(), degree), y(local.y(), degree), z(local.z(), degree);
  Sample result{0, Vector3::Zero()};
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; j <= degree - i; ++j) {
      double line = 0, lineDz = 0;
      for (int k = 0; k <= degree - i - j; ++k) {
        line += *c * z.value[k];
        lineDz += *c++ * z.derivative[k];
      }
      result.value += line * y.value[j] * x.value[i];
      result.gradient += Vector3(line * y.value[j] * x.derivative[i], line * y.derivative[j] * x.value[i],
                                 lineDz * y.value[j] * x.value[i]);
    }
  return result;
}

template <typename T>
double evaluate(const T* c, int degree, const Vector3& local) {
  const Legendre x(local.x(), degree), y(local.y(), degree), z(local.z(), degree);
  double value = 0;
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; j <= degree - i; ++j) {
      double line = 0;
      for (int k = 0; k <= degree - i - j; ++k) line += *c++ * z.value[k];
      value += line * y.value[j] * x.value[i];
    }
  return value;
}

Vector3 localFromFraction(const Vector3& fraction) { return 2 * fraction - Vector3::Ones(); }

/// World length from the point to where the ray has left the node's box, or the box within it whose faces are `margin`
/// of its edges inside: past a face by a little, because a ray that runs along a face, on it up to rounding, would
/// otherwise leave it again at every step.
double lengthToExit(const CellPoint& at, const Vector3& direction, const Vector3& grid, double margin = 0) {
  double exit = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) continue;
    const double along = direction[axis] > 0 ? at.fraction[axis] : 1 - at.fraction[axis];
    const double ahead = 1 - margin - along;
    exit = std::min(exit, (std::ldexp(ahead, -at.depth) + kPastFace * grid[axis]) / std::abs(direction[axis]));
  }
  return exit;
}

/// How far along a ray a height stays above zero at least that falls no steeper than `steepest`.
double certainlyAbove(double height, double steepest) {
  if (!(height > 0)) return 0;
  return steepest < 0 ? height / -steepest : std::numeric_limits<double>::infinity();
}

}  // namespace

TraceField::TraceField(const Field& field)
    : field_(field.data()),
      reaches_(field.lookupGrid().blendExtents),
      space_(field_),
      zones_(zoneBounds(field)),
      bounds_(nodeBounds(field_, zones_)) {}

bool TraceField::nearFace(const CellPoint& at) const {
  return field_.blend > 0 && ((at.fraction.array() < field_.blend) || (at.fraction.array() > 1 - field_.blend)).any();
}

/// Calls use(leaf, local, weight, its gradient) for each, `p` in grid coordinates, which gradients refer to.
template <typename Use>
void TraceField::forEachReaching(const Vector3& p, const Use& use) const {
  const auto visit = [&](const auto& self, std::uint32_t index, int depth, const Vector3& corner) -> void {
    const double edge = std::ldexp(1.0, -depth), reach = field_.blend * edge;
    const Vector3 within = p - corner;
    if ((within.array() < -reach).any() || (within.array() > edge + reach).any()) return;
    if (!node::isLeaf(field_.nodes[index])) {
      for (std::uint32_t child = 0; child < 8; ++child)
        self(self, node::firstChild(field_.nodes[index]) + child, depth + 1,
             corner + 0.5 * edge * Vector3(child & 1, child >> 1 & 1, child >> 2));
      return;
    }
    std::array<double, 3> step = {1, 1, 1}, slope = {0, 0, 0};
    for (int axis = 0; axis < 3; ++axis)
      for (const bool upper : {false, true}) {
        const int deepest = blend_extent::depth(reaches_[index], axis, upper);
        if (deepest == blend_extent::kWall) continue;
        const double delta = field_.blend * std::ldexp(1.0, -deepest);
        const double t = (upper ? edge - within[axis] : within[axis]) / delta;
        const double s = t < -1 ? 0 : t > 1 ? 1 : 0.25 * (2 + 3 * t - t * t * t);
        const double ds = std::abs(t) > 1 ? 0 : (upper ? -0.75 : 0.75) * (1 - t * t) / delta;
        slope[axis] = slope[axis] * s + step[axis] * ds;
        step[axis] *= s;
      }
    const double weight = step[0] * step[1] * step[2];
    if (!(weight > 0)) return;
    use(index, depth, localFromFraction(within / edge), weight,
        Vector3(slope[0] * step[1] * step[2], step[0] * slope[1] * step[2], step[0] * step[1] * slope[2]));
  };
  std::array<std::uint32_t, 3> first, last;
  for (int axis = 0; axis < 3; ++axis) {
    const double most = space_.grid[axis] - 1;
    first[axis] = static_cast<std::uint32_t>(std::clamp(std::floor(p[axis] - field_.blend), 0.0, most));
    last[axis] = static_cast<std::uint32_t>(std::clamp(std::floor(p[axis] + field_.blend), 0.0, most));
  }
  for (std::uint32_t z = first[2]; z <= last[2]; ++z)
    for (std::uint32_t y = first[1]; y <= last[1]; ++y)
      for (std::uint32_t x = first[0]; x <= last[0]; ++x)
        visit(visit, (z * field_.grid[1] + y) * field_.grid[0] + x, 0, Vector3(x, y, z));
}

Sample TraceField::sampleBlended(const CellPoint& leaf, const Vector3& local) const {
  const double edge = std::ldexp(1.0, -leaf.depth);
  const Vector3 p = leaf.base + edge * (leaf.path + 0.5 * (local + Vector3::Ones()));
  double weights = 0, sum = 0;
  Vector3 weightsGradient = Vector3::Zero(), sumGradient = Vector3::Zero();
  forEachReaching(
      p, [&](std::uint32_t index, int depth, const Vector3& localThere, double weight, const Vector3& weightGradient) {
        const Sample sample = samplePolynomial(index, localThere);
        weights += weight;
        sum += weight * sample.value;
        weightsGradient += weightGradient;
        sumGradient += weightGradient * sample.value + weight * std::ldexp(2.0, depth) * sample.gradient;
      });
  const double value = sum / weights;
  return {value, 0.5 * edge * (sumGradient - value * weightsGradient) / weights};
}

CellPoint TraceField::baseCellAt(const Vector3& p) const {
  CellPoint at;
  std::uint32_t index[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double clamped = std::clamp(p[axis], 0.0, space_.grid[axis]);
    index[axis] = std::min(static_cast<std::uint32_t>(clamped), field_.grid[axis] - 1);
    at.base[axis] = index[axis];
    at.fraction[axis] = clamped - index[axis];
  }
  at.node = (index[2] * field_.grid[1] + index[1]) * field_.grid[0] + index[0];
  at.depth = 0;
  at.path.setZero();
  return at;
}

void TraceField::descend(CellPoint& at) const {
  std::uint32_t child = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double doubled = 2 * at.fraction[axis];
    const std::uint32_t upper = doubled >= 1;
    at.fraction[axis] = doubled - upper;
    at.path[axis] = 2 * at.path[axis] + upper;
    child |= upper << axis;
  }
  at.node = node::firstChild(field_.nodes[at.node]) + child;
  ++at.depth;
}

CellPoint TraceField::leafAt(const Vector3& p) const {
  CellPoint at = baseCellAt(p);
  while (!node::isLeaf(field_.nodes[at.node])) descend(at);
  return at;
}

double TraceField::linearSlope(std::uint32_t leaf, const Vector3& direction) const {
  const int p = degree(leaf);
  if (p == 0) return 0;
  // c_100, c_010, c_001 in lexicographic order
  return withCoefficients(field_, leaf, [&](const auto* c) {
    return c[coefficientCount(p) - coefficientCount(p - 1)] * direction.x() + c[p + 1] * direction.y() +
           c[1] * direction.z();
  });
}

bool TraceField::excludes(std::uint32_t node, double offset) const {
  return bounds_[node].lo > offset || bounds_[node].hi < offset;
}

CellPoint TraceField::relevantNodeAt(const Vector3& p, double offset) const {
  CellPoint at = baseCellAt(p);
  while (!node::isLeaf(field_.nodes[at.node]) && !excludes(at.node, offset)) descend(at);
  return at;
}

Sample TraceField::samplePolynomial(std::uint32_t leaf, const Vector3& local) const {
  return withCoefficients(field_, leaf, [&](const auto* c) { return evaluateWithGradient(c, degree(leaf), local); });
}

Sample TraceField::sample(const CellPoint& leaf, const Vector3& local) const {
  return field_.blend > 0 ? sampleBlended(leaf, local) : samplePolynomial(leaf.node, local);
}

double TraceField::value(const CellPoint& leaf, const Vector3& local) const {
  if (field_.blend > 0) return sampleBlended(leaf, local).value;
  return withCoefficients(field_, leaf.node, [&](const auto* c) { return evaluate(c, degree(leaf.node), local); });
}

Vector3 TraceField::worldGradient(const Vector3& local, int depth) const {
  return std::ldexp(2.0, depth) * local.cwiseProduct(space_.grid).cwiseQuotient(space_.size);
}

std::optional<Hit> TraceField::trace(const Ray& ray, double offset) const {
  const double nudge = kNudge * space_.diagonal;
  const auto localAt = [&](const CellPoint& cell, double t) -> Vector3 {
    const Vector3 inBase = ray.origin - cell.base + t * ray.direction;
    return localFromFraction(inBase * std::ldexp(1.0, cell.depth) - cell.path);
  };
  // positive on the side of the surface on which the ray starts
  double side = 0;
  const auto heightAt = [&](const CellPoint& cell, double t) {
    return side * (value(cell, localAt(cell, t)) - offset);
  };

  // The only root of a cell between a (height > 0) and b (height ≤ 0): regula falsi, Illinois variant.
  const auto refine = [&](const CellPoint& cell, double a, double heightA, double b, double heightB) {
    double t = b;
    for (int i = 0; i < kMostRefinements; ++i) {
      const double next = b - heightB * (b - a) / (heightB - heightA);
      const double change = std::abs(next - t);
      t = next;
      if (change <= kConverged * space_.diagonal) break;
      const double height = heightAt(cell, t);
      if ((height > 0) == (heightB > 0)) {
        heightA *= 0.5;
      } else {
        a = b;
        heightA = heightB;
      }
      b = t;
      heightB = height;
    }
    return Hit{t, cell, localAt(cell, t), false};
  };
  const auto hitOnFace = [&](double t) {
    const CellPoint cell = leafAt(ray.origin + t * ray.direction);
    return Hit{t, cell, localFromFraction(cell.fraction), true};
  };

  double t = 0;
  // what the step before has left where it stayed in its leaf: the height at t, and the longest step to try
  std::uint32_t lastLeaf = kNoCell;
  double lastHeight = 0;
  double reach = 0;
  for (int step = 0; step < kMostSteps && t <= ray.length; ++step) {
    const CellPoint at = relevantNodeAt(ray.origin + t * ray.direction, offset);
    const NodeBounds& bounds = bounds_[at.node];
    if (excludes(at.node, offset)) {
      const double sideHere = bounds.lo > offset ? 1 : -1;
      if (side == 0) side = sideHere;
      if (side != sideHere) return hitOnFace(t);
      t += lengthToExit(at, ray.direction, space_.grid) + nudge;
      continue;
    }
    if (at.node != lastLeaf) {
      const double here = value(at, localFromFraction(at.fraction)) - offset;
      if (side == 0) side = here >= 0 ? 1 : -1;
      lastLeaf = at.node;
      lastHeight = side * here;
      reach = std::numeric_limits<double>::infinity();
      if (lastHeight < 0) return hitOnFace(t);
    }
    // within the leaf the slope of its polynomial's height along the ray lies between these two, its second derivative
    // in ±curve
    const Vector3 localDirection = std::ldexp(2.0, at.depth) * ray.direction;
    const double slope = side * linearSlope(at.node, localDirection);
    const double bend = bounds.bend * localDirection.norm();
    const double curve = bounds.curve * localDirection.squaredNorm();
    const double steepest = slope - bend;
    const double shallowest = slope + bend;
    const double toLeave = lengthToExit(at, ray.direction, space_.grid);
    const auto leave = [&](double length) {
      t += length + nudge;
      lastLeaf = kNoCell;
    };
    // of a blended field: what it cannot fall below is the polynomial's height less `apart`
    const bool near = nearFace(at);
    const double own = near ? side * (samplePolynomial(at.node, localAt(at, t)).value - offset) : lastHeight;
    const double clear = own - (field_.blend > 0 ? zones_[at.node].apart : 0);
    if (clear + steepest * toLeave >= 0) {
      leave(toLeave);
      continue;
    }
    if (near) {
      const double grain = kGrain * zones_[at.node].reach / localDirection.norm();
      const double length = std::min(toLeave, std::max(certainlyAbove(clear, steepest), grain) + nudge);
      const double ahead = heightAt(at, t + length);
      if (ahead <= 0) return refine(at, t, lastHeight, t + length, ahead);
      if (length == toLeave)
        leave(length);
      else
        t += length;
      lastHeight = ahead;
      continue;
    }
    const double toExit = lengthToExit(at, ray.direction, space_.grid, field_.blend);
    const bool falling = shallowest < 0;  // throughout: at most one root
    const double safe = certainlyAbove(lastHeight, steepest) + nudge;
    const double length =
        std::min(toExit, falling ? lastHeight / -shallowest + nudge
                                 : std::max(safe, std::min(reach, std::sqrt(4 * lastHeight / curve))));
    const double ahead = heightAt(at, t + length);
    const bool certain = falling || length <= safe;
    if (ahead <= 0 && (certain || lastHeight - ahead > 0.5 * curve * length * length))
      return refine(at, t, lastHeight, t + length, ahead);
    // the height sags below its chord by at most curve · length² / 8
    if (ahead > 0 && (certain || std::min(lastHeight, ahead) > 0.125 * curve * length * length)) {
      if (length == toLeave)
        leave(length);
      else
        t += length;
      lastHeight = ahead;
      reach = std::numeric_limits<double>::infinity();
    } else {
      reach = 0.25 * length;
    }
  }
  return std::nullopt;
}

}  // namespace hpsdf::render
