#include "cpu/trace.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hpsdf/detail/exact_sign.h"
#include "view/exact_leaf.h"

namespace hpsdf::render {
namespace {

// The following lengths are in units of the domain's diagonal unless noted. The shaders use the same kNudge, kPastFace
// and kGrain.
constexpr double kNudge = 1e-6;      // overshoot of a step across a cell's face; also the shortest step
constexpr double kPastFace = 4e-7;   // lengthToExit ends this far behind a face, as a share of the domain's extent
constexpr double kConverged = 1e-8;  // the refinement of a root ends when an iteration changes the root by less
constexpr double kGrain = 0.25;      // least length of a step in a blend zone, as a share of the blend extent
constexpr int kStepLimit = 1 << 16;
constexpr int kMostRefinements = 24;

/// The Legendre polynomials L_i(x) and their derivatives L_i'(x) for i = 0 to `degree`.
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

/// The value of a leaf's polynomial and, if `withGradient`, its gradient.
template <bool withGradient, typename T>
Sample evaluate(const T* c, int degree, const Vector3& local) {
  const Legendre x(local.x(), degree), y(local.y(), degree), z(local.z(), degree);
  Sample result{0, Vector3::Zero()};
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; j <= degree - i; ++j) {
      double line = 0, lineDz = 0;
      for (int k = 0; k <= degree - i - j; ++k, ++c) {
        line += *c * z.value[k];
        if (withGradient) lineDz += *c * z.derivative[k];
      }
      result.value += line * y.value[j] * x.value[i];
      if (withGradient)
        result.gradient += Vector3(line * y.value[j] * x.derivative[i], line * y.derivative[j] * x.value[i],
                                   lineDz * y.value[j] * x.value[i]);
    }
  return result;
}

Vector3 localFromFraction(const Vector3& fraction) { return 2 * fraction - Vector3::Ones(); }

/// The length along the ray, in world units, from a point to just behind the face where the ray leaves the point's
/// node. If it ended on the face itself, rounding could keep a ray that grazes the face in the same node at every step.
/// With a margin, the node is first shrunk on every side by `margin` times its edge length.
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

/// Returns the length of a step along the ray over which `height` is certain to stay positive. `steepest` is a lower
/// bound of the height's slope along the ray.
double certainlyAbove(double height, double steepest) {
  if (!(height > 0)) return 0;
  return steepest < 0 ? height / -steepest : std::numeric_limits<double>::infinity();
}

}  // namespace

TraceField::TraceField(const Field& field)
    : whole_(field), field_(field.data()), blendExtents_(field.lookupGrid().blendExtents), space_(field_) {}

void TraceField::prepareTracing() {
  if (!bounds_.empty()) return;
  zones_ = blendZoneBounds(whole_);
  bounds_ = surfaceBounds(field_, zones_);
}

bool TraceField::inBlendZone(const CellPoint& at) const {
  return field_.blend > 0 && ((at.fraction.array() < field_.blend) || (at.fraction.array() > 1 - field_.blend)).any();
}

TraceField::Weight TraceField::weightAt(std::uint32_t leaf, int depth, const Vector3& fromCorner) const {
  const double edge = std::ldexp(1.0, -depth);
  std::array<double, 3> ramp = {1, 1, 1}, slope = {0, 0, 0};
  for (int axis = 0; axis < 3; ++axis)
    for (const bool upper : {false, true}) {
      const int smallest = blend_extent::depth(blendExtents_[leaf], axis, upper);
      if (smallest == blend_extent::kDomainFace) continue;
      const double extent = field_.blend * std::ldexp(1.0, -smallest);
      const double t = (upper ? edge - fromCorner[axis] : fromCorner[axis]) / extent;
      const double s = t < -1 ? 0 : t > 1 ? 1 : 0.25 * (2 + 3 * t - t * t * t);
      const double ds = std::abs(t) > 1 ? 0 : (upper ? -0.75 : 0.75) * (1 - t * t) / extent;
      slope[axis] = slope[axis] * s + ramp[axis] * ds;
      ramp[axis] *= s;
    }
  const double value = ramp[0] * ramp[1] * ramp[2];
  if (!(value > 0)) return {0, Vector3::Zero()};
  return {value, Vector3(slope[0] * ramp[1] * ramp[2], ramp[0] * slope[1] * ramp[2], ramp[0] * ramp[1] * slope[2])};
}

template <typename Use>
void TraceField::forEachWeightBelow(std::uint32_t node, int depth, const Vector3& corner, const Vector3& p,
                                    const Use& use) const {
  const double edge = std::ldexp(1.0, -depth), extent = field_.blend * edge;
  const Vector3 fromCorner = p - corner;
  if ((fromCorner.array() < -extent).any() || (fromCorner.array() > edge + extent).any()) return;
  if (node::isLeaf(field_.nodes[node])) {
    const Weight weight = weightAt(node, depth, fromCorner);
    if (weight.value > 0) use(node, depth, localFromFraction(fromCorner / edge), weight);
    return;
  }
  for (std::uint32_t child = 0; child < 8; ++child)
    forEachWeightBelow(node::firstChild(field_.nodes[node]) + child, depth + 1,
                       corner + 0.5 * edge * Vector3(child & 1, child >> 1 & 1, child >> 2), p, use);
}

template <typename Use>
void TraceField::forEachWeight(const Vector3& p, const Use& use) const {
  std::array<std::uint32_t, 3> first, last;
  for (int axis = 0; axis < 3; ++axis) {
    const double most = space_.grid[axis] - 1;
    first[axis] = static_cast<std::uint32_t>(std::clamp(std::floor(p[axis] - field_.blend), 0.0, most));
    last[axis] = static_cast<std::uint32_t>(std::clamp(std::floor(p[axis] + field_.blend), 0.0, most));
  }
  for (std::uint32_t z = first[2]; z <= last[2]; ++z)
    for (std::uint32_t y = first[1]; y <= last[1]; ++y)
      for (std::uint32_t x = first[0]; x <= last[0]; ++x)
        forEachWeightBelow((z * field_.grid[1] + y) * field_.grid[0] + x, 0, Vector3(x, y, z), p, use);
}

Sample TraceField::sampleBlended(const CellPoint& leaf, const Vector3& local) const {
  const double edge = std::ldexp(1.0, -leaf.depth);
  const Vector3 p = gridPoint(leaf, local);
  double weights = 0, sum = 0;
  Vector3 weightsGradient = Vector3::Zero(), sumGradient = Vector3::Zero();
  forEachWeight(p, [&](std::uint32_t other, int depth, const Vector3& localInOther, const Weight& weight) {
    const Sample sample = sampleLeaf(other, depth, localInOther, p);
    weights += weight.value;
    sum += weight.value * sample.value;
    weightsGradient += weight.gradient;
    sumGradient += weight.gradient * sample.value + weight.value * std::ldexp(2.0, depth) * sample.gradient;
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
  if (p == 0 || p == kExactDegree) return 0;
  // The coefficients c_ijk are in lexicographic order; the indices below are those of c_100, c_010 and c_001.
  return withCoefficients(field_, field_.nodes[leaf], [&](const auto* c) {
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

bool TraceField::crossesAtTriangles(std::uint32_t leaf, double offset) const {
  return node::isExact(field_.nodes[leaf]) && offset + field_.exact.offset == 0;
}

Vector3 TraceField::gridPoint(const CellPoint& leaf, const Vector3& local) const {
  return leaf.base + std::ldexp(1.0, -leaf.depth) * (leaf.path + 0.5 * (local + Vector3::Ones()));
}

Vector3 TraceField::worldPoint(const Vector3& gridPoint) const {
  return space_.lo + gridPoint.cwiseQuotient(space_.grid).cwiseProduct(space_.size);
}

Sample TraceField::sampleLeaf(std::uint32_t leaf, int depth, const Vector3& local, const Vector3& p) const {
  const std::uint64_t bits = field_.nodes[leaf];
  if (node::isExact(bits)) {
    const ValueAndGradient world = evaluateExactLeaf(field_.exact, bits, worldPoint(p));
    return {world.value, localGradient(world.gradient, depth)};
  }
  return withCoefficients(field_, field_.nodes[leaf],
                          [&](const auto* c) { return evaluate<true>(c, degree(leaf), local); });
}

Sample TraceField::sample(const CellPoint& leaf, const Vector3& local) const {
  return field_.blend > 0 ? sampleBlended(leaf, local)
                          : sampleLeaf(leaf.node, leaf.depth, local, gridPoint(leaf, local));
}

Sample TraceField::sample(const Hit& hit) const {
  if (!hit.triangle) return sample(hit.cell, hit.local);
  return {-field_.exact.offset, localGradient(unitNormal(field_.exact, *hit.triangle), hit.cell.depth)};
}

double TraceField::value(const CellPoint& leaf, const Vector3& local) const {
  if (field_.blend > 0) return sampleBlended(leaf, local).value;
  if (node::isExact(field_.nodes[leaf.node])) return sample(leaf, local).value;
  return withCoefficients(field_, field_.nodes[leaf.node],
                          [&](const auto* c) { return evaluate<false>(c, degree(leaf.node), local).value; });
}

Vector3 TraceField::worldGradient(const Vector3& local, int depth) const {
  return std::ldexp(2.0, depth) * local.cwiseProduct(space_.grid).cwiseQuotient(space_.size);
}

Vector3 TraceField::localGradient(const Vector3& world, int depth) const {
  return std::ldexp(0.5, -depth) * world.cwiseProduct(space_.size).cwiseQuotient(space_.grid);
}

/// Marches along one ray to the first crossing of f = offset, by steps that cannot pass a crossing (docs/rendering.md,
/// "Tracing"). A height is f − offset, signed so that it is positive where the ray starts. The functions for the stages
/// have the same names as in shaders/surface_march.frag.
class TraceField::March {
 public:
  March(const TraceField& field, const Ray& ray, double offset)
      : field_(field), ray_(ray), offset_(offset), nudge_(kNudge * field.space_.diagonal) {}

  std::optional<Hit> run() {
    for (int i = 0; i < kStepLimit && t_ <= ray_.length; ++i)
      if (const auto hit = step()) return hit;
    return std::nullopt;
  }

 private:
  /// The point of the ray at parameter t, the leaf that contains it, and bounds for the height of the leaf's polynomial
  /// or exact distance along the ray.
  struct LeafPoint {
    CellPoint at;
    Vector3 localDirection;  ///< change of the local coordinates per world unit along the ray
    double steepest;         ///< lower bound of the height's slope along the ray
    double shallowest;       ///< upper bound of the height's slope along the ray
    double curve;            ///< upper bound of the height's second derivative along the ray
    double toLeave;          ///< distance to the exit from the leaf, world units
    double clear;            ///< lower bound of the height of the field at t, with or without blending
    bool inBlendZone;
  };

  std::optional<Hit> step() {
    const CellPoint at = field_.relevantNodeAt(pointAt(t_), offset_);
    if (field_.excludes(at.node, offset_)) return passNode(at);
    if (at.node != lastLeaf_) {
      enterLeaf(at);
      if (lastHeight_ < 0) return hitOnFace();
    }
    const LeafPoint leaf = boundHeight(at);
    if (leaf.clear + leaf.steepest * leaf.toLeave >= 0) {
      leave(leaf.toLeave);
      return std::nullopt;
    }
    if (leaf.inBlendZone) return stepInBlendZone(leaf);
    return field_.crossesAtTriangles(at.node, offset_) ? crossExactLeaf(leaf) : stepInLeaf(leaf);
  }

  /// Steps past a node whose range of values excludes the offset. If the node lies on the other side of the
  /// surface, returns a hit on the face where the ray enters the node.
  std::optional<Hit> passNode(const CellPoint& at) {
    const double side = field_.bounds_[at.node].lo > offset_ ? 1 : -1;
    if (side_ == 0) side_ = side;
    if (side_ != side) return hitOnFace();
    t_ += lengthToExit(at, ray_.direction, field_.space_.grid) + nudge_;
    return std::nullopt;
  }

  /// Evaluates the height at the point where the ray enters a leaf.
  void enterLeaf(const CellPoint& at) {
    const double value = field_.value(at, localFromFraction(at.fraction)) - offset_;
    if (side_ == 0) side_ = value >= 0 ? 1 : -1;
    lastLeaf_ = at.node;
    lastHeight_ = side_ * value;
    longestStep_ = std::numeric_limits<double>::infinity();
  }

  LeafPoint boundHeight(const CellPoint& at) const {
    const SurfaceBounds& bounds = field_.bounds_[at.node];
    const Vector3 localDirection = std::ldexp(2.0, at.depth) * ray_.direction;
    const double slope = side_ * field_.linearSlope(at.node, localDirection);
    const double deviation = bounds.gradientDeviation * localDirection.norm();
    const bool inBlendZone = field_.inBlendZone(at);
    const double height =
        inBlendZone ? side_ * (field_.sampleLeaf(at.node, at.depth, localAt(at, t_), pointAt(t_)).value - offset_)
                    : lastHeight_;
    return {.at = at,
            .localDirection = localDirection,
            .steepest = slope - deviation,
            .shallowest = slope + deviation,
            .curve = bounds.secondDerivative * localDirection.squaredNorm(),
            .toLeave = lengthToExit(at, ray_.direction, field_.space_.grid),
            .clear = height - (field_.field_.blend > 0 ? field_.zones_[at.node].valueDifference : 0),
            .inBlendZone = inBlendZone};
  }

  /// Takes a step where several leaves are blended: as far as the height is guaranteed to stay positive, but at least a
  /// small part of the blend zone.
  std::optional<Hit> stepInBlendZone(const LeafPoint& leaf) {
    const double grain = kGrain * field_.zones_[leaf.at.node].extent / leaf.localDirection.norm();
    const double length = std::min(leaf.toLeave, std::max(certainlyAbove(leaf.clear, leaf.steepest), grain) + nudge_);
    const double ahead = heightAt(leaf.at, t_ + length);
    if (ahead <= 0) return refine(leaf.at, t_, lastHeight_, t_ + length, ahead);
    advance(leaf, length, ahead);
    return std::nullopt;
  }

  /// Takes a step where the leaf's polynomial alone is the field. Second derivatives along the ray are at most `curve`.
  /// Over a step of a given length, the height therefore sags below its chord by at most curve · length² / 8. The
  /// height is monotone if it falls by more than curve · length² / 2.
  std::optional<Hit> stepInLeaf(const LeafPoint& leaf) {
    const double toExit = lengthToExit(leaf.at, ray_.direction, field_.space_.grid, field_.field_.blend);
    const bool falling = leaf.shallowest < 0;  // the height decreases in the whole leaf: it has at most one root
    const double safe = certainlyAbove(lastHeight_, leaf.steepest) + nudge_;
    const double length =
        std::min(toExit, falling ? lastHeight_ / -leaf.shallowest + nudge_
                                 : std::max(safe, std::min(longestStep_, std::sqrt(4 * lastHeight_ / leaf.curve))));
    const double ahead = heightAt(leaf.at, t_ + length);
    const bool certain = falling || length <= safe;
    if (ahead <= 0 && (certain || lastHeight_ - ahead > 0.5 * leaf.curve * length * length))
      return refine(leaf.at, t_, lastHeight_, t_ + length, ahead);
    if (ahead > 0 && (certain || std::min(lastHeight_, ahead) > 0.125 * leaf.curve * length * length)) {
      advance(leaf, length, ahead);
      longestStep_ = std::numeric_limits<double>::infinity();
    } else {
      longestStep_ = 0.25 * length;
    }
    return std::nullopt;
  }

  /// Follows the ray to the first triangle that it crosses in an exact leaf, or to the leaf's end or blend zone.
  std::optional<Hit> crossExactLeaf(const LeafPoint& leaf) {
    // The triangles may be crossed a little before t, because steps end behind faces.
    constexpr double kBack = 16;
    const double toExit = lengthToExit(leaf.at, ray_.direction, field_.space_.grid, field_.field_.blend);
    const Vector3 direction = ray_.direction.cwiseProduct(field_.space_.size).cwiseQuotient(field_.space_.grid);
    const RayPart part{field_.worldPoint(pointAt(t_)), direction, -std::min(t_, kBack * nudge_), toExit + nudge_};
    if (const auto crossing = crossingOfSurface(field_.field_.nodes[leaf.at.node], part)) {
      const double t = t_ + crossing->t;
      return Hit{t, leaf.at, localAt(leaf.at, t), false, crossing->triangle};
    }
    advance(leaf, toExit, toExit == leaf.toLeave ? 0 : heightAt(leaf.at, t_ + toExit));
    return std::nullopt;
  }

  /// Returns the first crossing of a ray with the surface in an exact leaf. Triangles that lie inside are no part of
  /// the surface: where triangles intersect each other, a crossing counts if the sign changes behind it.
  std::optional<Crossing> crossingOfSurface(std::uint64_t bits, RayPart part) const {
    const ExactTriangles& exact = field_.field_.exact;
    const ExactSign rule = node::exactSign(bits);
    if (rule == ExactSign::positive || rule == ExactSign::negative) return std::nullopt;
    while (const auto crossing = firstCrossing(exact, bits, part, side_)) {
      const double behind = crossing->t + nudge_;
      const auto isOther = [&] {
        return (windingAt(exact, bits, part.start + behind * part.direction) > 0) == (side_ > 0);
      };
      if (rule == ExactSign::pseudonormal || isOther()) return crossing;
      part.first = behind;
    }
    return std::nullopt;
  }

  void advance(const LeafPoint& leaf, double length, double ahead) {
    if (length == leaf.toLeave)
      leave(length);
    else
      t_ += length;
    lastHeight_ = ahead;
  }

  void leave(double length) {
    t_ += length + nudge_;
    lastLeaf_ = kNoCell;
  }

  /// Finds a root between the ray parameters a and b by regula falsi, Illinois variant. The height is positive at a and
  /// not positive at b.
  Hit refine(const CellPoint& leaf, double a, double heightA, double b, double heightB) const {
    double t = b;
    for (int i = 0; i < kMostRefinements; ++i) {
      const double next = b - heightB * (b - a) / (heightB - heightA);
      const double change = std::abs(next - t);
      t = next;
      if (change <= kConverged * field_.space_.diagonal) break;
      const double height = heightAt(leaf, t);
      if ((height > 0) == (heightB > 0)) {
        heightA *= 0.5;
      } else {
        a = b;
        heightA = heightB;
      }
      b = t;
      heightB = height;
    }
    return {t, leaf, localAt(leaf, t), false};
  }

  Hit hitOnFace() const {
    const CellPoint leaf = field_.leafAt(pointAt(t_));
    return {t_, leaf, localFromFraction(leaf.fraction), true};
  }

  Vector3 localAt(const CellPoint& cell, double t) const {
    const Vector3 inBase = ray_.origin - cell.base + t * ray_.direction;
    return localFromFraction(inBase * std::ldexp(1.0, cell.depth) - cell.path);
  }

  Vector3 pointAt(double t) const { return ray_.origin + t * ray_.direction; }

  double heightAt(const CellPoint& leaf, double t) const {
    return side_ * (field_.value(leaf, localAt(leaf, t)) - offset_);
  }

  const TraceField& field_;
  const Ray& ray_;
  const double offset_;
  const double nudge_;
  double t_ = 0;
  double side_ = 0;  ///< sign of f − offset where the ray starts; 0 until it is known
  // The members below keep the state after the last step, for the next step in the same leaf.
  std::uint32_t lastLeaf_ = kNoCell;
  double lastHeight_ = 0;   ///< height of the field at t_
  double longestStep_ = 0;  ///< longest step to try, world units
};

std::optional<Hit> TraceField::trace(const Ray& ray, double offset) const { return March(*this, ray, offset).run(); }

}  // namespace hpsdf::render
