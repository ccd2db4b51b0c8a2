#include "hpsdf/jumps.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <variant>

#include "basis/legendre.h"
#include "field/query/blend.h"
#include "field/query/evaluate.h"
#include "field/query/leaves.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "util/chunks.h"

namespace hpsdf {
namespace {

/// Where a face is sampled along either of its sides, in [-1, 1]: the points of a Gauss rule and, with weight 0, the
/// ends, so that the product of two such holds inner points, edges and corners.
struct Samples {
  std::vector<double> points, weights;

  /// Exact for the square of a polynomial of this degree.
  explicit Samples(int degree) {
    const QuadratureRule rule = gaussLegendre(degree + 1);
    points = {-1, 1};
    weights = {0, 0};
    points.insert(points.end() - 1, rule.points.begin(), rule.points.end());
    weights.insert(weights.end() - 1, rule.weights.begin(), rule.weights.end());
  }
};

/// Values and gradients at the product of two lists of points on a plane across a cell.
class Sheet {
 public:
  const double* value() const { return out_[0].data(); }
  const double* derivative(int axis) const { return out_[1 + axis].data(); }

  /// Room for so many numbers of each kind, to be filled by `set`.
  void resize(std::size_t size) {
    for (auto& out : out_) out.resize(size);
  }
  void set(std::size_t at, const ValueAndGradient& result) {
    out_[0][at] = result.value;
    for (int axis = 0; axis < 3; ++axis) out_[1 + axis][at] = result.gradient[axis];
  }

  /// The plane lies across `axis` at the local coordinate t; `along` are local coordinates along the axes that follow
  /// it cyclically, the second fastest. Derivatives by local coordinates times `toWorld` are by the world's.
  template <typename T>
  void evaluate(const T* coefficients, int degree, int axis, double t, const std::array<std::vector<double>, 2>& along,
                const Vector3& toWorld) {
    const int n = degree + 1;
    const std::size_t size[2] = {along[0].size(), along[1].size()};
    double across[kMaxDegree + 1], acrossSlope[kMaxDegree + 1];
    legendreValuesAndDerivatives(t, degree, across, acrossSlope);
    for (int side = 0; side < 2; ++side) {
      basis_[side].resize(size[side] * n);
      slope_[side].resize(size[side] * n);
      for (std::size_t s = 0; s < size[side]; ++s)
        legendreValuesAndDerivatives(along[side][s], degree, &basis_[side][s * n], &slope_[side][s * n]);
    }

    // a polynomial of the plane's two coordinates, and that of its derivative across
    plane_.assign(2 * n * n, 0);
    std::array<int, 3> index;
    for (index[0] = 0; index[0] < n; ++index[0])
      for (index[1] = 0; index[0] + index[1] < n; ++index[1])
        for (index[2] = 0; index[0] + index[1] + index[2] < n; ++index[2]) {
          const double c = *coefficients++;
          double* at = &plane_[2 * (index[(axis + 1) % 3] * n + index[(axis + 2) % 3])];
          at[0] += c * across[index[axis]];
          at[1] += c * acrossSlope[index[axis]];
        }

    resize(size[0] * size[1]);
    for (std::size_t s1 = 0; s1 < size[1]; ++s1) {
      struct Line {
        double value = 0, across = 0, along = 0;
      };
      std::array<Line, kMaxDegree + 1> line;  // by the first coordinate's degree
      for (int i = 0; i < n; ++i) {
        line[i] = {};
        for (int j = 0; i + j < n; ++j) {
          const double* c = &plane_[2 * (i * n + j)];
          line[i].value += c[0] * basis_[1][s1 * n + j];
          line[i].across += c[1] * basis_[1][s1 * n + j];
          line[i].along += c[0] * slope_[1][s1 * n + j];
        }
      }
      for (std::size_t s0 = 0; s0 < size[0]; ++s0) {
        double value = 0, d0 = 0, d1 = 0, dAcross = 0;
        for (int i = 0; i < n; ++i) {
          const double b = basis_[0][s0 * n + i];
          value += b * line[i].value;
          dAcross += b * line[i].across;
          d0 += slope_[0][s0 * n + i] * line[i].value;
          d1 += b * line[i].along;
        }
        const std::size_t at = s0 * size[1] + s1;
        out_[0][at] = value;
        const auto derivative = [&](int a, double d) { out_[1 + a % 3][at] = d * toWorld[a % 3]; };
        derivative(axis, dAcross);
        derivative(axis + 1, d0);
        derivative(axis + 2, d1);
      }
    }
  }

 private:
  std::array<std::vector<double>, 2> basis_, slope_;
  std::vector<double> plane_;
  std::array<std::vector<double>, 4> out_;
};

/// One thread's measure of faces.
class FaceMeter {
 public:
  FaceMeter(const Field& field, std::span<const Samples> samples)
      : whole_(field), field_(field.data()), samples_(samples) {}

  /// The face of `small` across `axis` towards `step`, shared with `large`.
  Interface measure(const Leaf& small, const Leaf& large, int axis, int step) {
    const std::array<const Leaf*, 2> sides = {step > 0 ? &small : &large, step > 0 ? &large : &small};
    Interface face;
    face.axis = axis;
    for (int side = 0; side < 2; ++side) {
      face.cells[side] = sides[side]->node;
      face.degrees[side] = static_cast<std::uint8_t>(node::degree(field_.nodes[sides[side]->node]));
      face.depths[side] = static_cast<std::uint8_t>(sides[side]->depth);
    }
    const Samples& samples = samples_[std::max(face.degrees[0], face.degrees[1])];
    for (int side = 0; side < 2; ++side) {
      if (field_.blend > 0)
        sampleBlended(sheets_[side], *sides[side], small, axis, step, samples);
      else
        sample(sheets_[side], *sides[side], small, axis, side == 0 ? 1 : -1, samples);
    }

    const Vector3 size = cellSize(field_, small.depth);
    const int axis0 = (axis + 1) % 3, axis1 = (axis + 2) % 3;
    face.area = size[axis0] * size[axis1];
    const std::size_t n = samples.points.size();
    std::size_t worst = 0;
    double valueSquares = 0, gradientSquares = 0, greatestGradientSquare = 0;
    for (std::size_t at = 0; at < n * n; ++at) {
      const double jump = std::abs(sheets_[1].value()[at] - sheets_[0].value()[at]);
      double gradientSquare = 0;
      for (int a = 0; a < 3; ++a) {
        const double difference = sheets_[1].derivative(a)[at] - sheets_[0].derivative(a)[at];
        gradientSquare += difference * difference;
      }
      const double weight = samples.weights[at / n] * samples.weights[at % n] / 4;
      valueSquares += weight * jump * jump;
      gradientSquares += weight * gradientSquare;
      greatestGradientSquare = std::max(greatestGradientSquare, gradientSquare);
      if (jump > face.value.max) {
        face.value.max = jump;
        worst = at;
      }
    }
    face.value.rms = std::sqrt(valueSquares);
    face.gradient = {std::sqrt(gradientSquares), std::sqrt(greatestGradientSquare)};

    std::array<double, 3> local{};
    local[axis] = step;
    face.center = worldAt(small, local);
    if (face.value.max > 0) {
      local[axis0] = samples.points[worst / n];
      local[axis1] = samples.points[worst % n];
    }
    face.worst = worldAt(small, local);
    return face;
  }

 private:
  /// `leaf`'s polynomial at the samples on `small`'s face, which lies in the leaf at the local coordinate t.
  void sample(Sheet& sheet, const Leaf& leaf, const Leaf& small, int axis, double t, const Samples& samples) {
    const int levels = small.depth - leaf.depth;
    const double scale = std::ldexp(1.0, -levels);
    for (int side = 0; side < 2; ++side) {
      const int along = (axis + 1 + side) % 3;
      const auto offset = static_cast<double>(small.place[along] - (leaf.place[along] << levels));
      along_[side] = samples.points;
      if (levels > 0)
        for (double& u : along_[side]) u = (2 * offset + u + 1) * scale - 1;
    }
    const std::uint64_t bits = field_.nodes[leaf.node];
    const Vector3 toWorld = 2 * cellSize(field_, leaf.depth).cwiseInverse();
    std::visit(
        [&](const auto& c) {
          sheet.evaluate(c.data() + node::offset(bits), node::degree(bits), axis, t, along_, toWorld);
        },
        field_.coefficients);
  }

  /// The limits from within `leaf` at the samples on `small`'s face across `axis` towards `step`.
  void sampleBlended(Sheet& sheet, const Leaf& leaf, const Leaf& small, int axis, int step, const Samples& samples) {
    const std::size_t n = samples.points.size();
    sheet.resize(n * n);
    std::array<double, 3> local{};
    local[axis] = step;
    for (std::size_t at = 0; at < n * n; ++at) {
      local[(axis + 1) % 3] = samples.points[at / n];
      local[(axis + 2) % 3] = samples.points[at % n];
      const std::array<double, 3> coordinates = gridAt(small, local);
      const FoundLeaf found = leafWithin(field_.nodes[leaf.node], leaf.depth, leaf.node, leaf.place, coordinates);
      sheet.set(at, answerWithin<ValueAndGradient>(field_, whole_.lookupGrid(), coordinates, found));
    }
  }

  static std::array<double, 3> gridAt(const Leaf& leaf, const std::array<double, 3>& local) {
    std::array<double, 3> coordinates;
    for (int axis = 0; axis < 3; ++axis)
      coordinates[axis] = std::ldexp(static_cast<double>(leaf.place[axis]) + (local[axis] + 1) / 2, -leaf.depth);
    return coordinates;
  }

  Vector3 worldAt(const Leaf& leaf, const std::array<double, 3>& local) const {
    return worldPoint(whole_.lookupGrid().frame, gridAt(leaf, local));
  }

  const Field& whole_;
  const FieldData& field_;
  std::span<const Samples> samples_;
  std::array<Sheet, 2> sheets_;
  std::array<std::vector<double>, 2> along_;
};

void sumUp(Jumps& jumps) {
  double valueSquares = 0, gradientSquares = 0;
  for (const Interface& face : jumps.interfaces) {
    jumps.hanging += face.hanging();
    jumps.area += face.area;
    valueSquares += face.area * face.value.rms * face.value.rms;
    gradientSquares += face.area * face.gradient.rms * face.gradient.rms;
    jumps.value.max = std::max(jumps.value.max, face.value.max);
    jumps.gradient.max = std::max(jumps.gradient.max, face.gradient.max);
  }
  if (jumps.area > 0) {
    jumps.value.rms = std::sqrt(valueSquares / jumps.area);
    jumps.gradient.rms = std::sqrt(gradientSquares / jumps.area);
  }
}

}  // namespace

Jumps findJumps(const Field& field, int threads, const Progress& progress) {
  const FieldData& data = field.data();
  const std::vector<Leaf> leaves = leavesOf(data);
  int highest = 0;
  for (const Leaf& leaf : leaves) highest = std::max(highest, node::degree(data.nodes[leaf.node]));
  std::vector<Samples> samples;
  for (int degree = 0; degree <= highest; ++degree) samples.emplace_back(degree);

  constexpr std::size_t kChunk = 256;
  std::vector<std::vector<Interface>> found(chunksOf(leaves.size(), kChunk));
  withThreads(threads, [&] {
    const auto measure = [&](std::size_t chunk, std::size_t first, std::size_t count) {
      FaceMeter meter(field, samples);
      for (std::size_t n = first; n < first + count; ++n)
        for (int axis = 0; axis < 3; ++axis)
          for (const int step : {-1, 1})
            if (const auto beside = notSmallerBeside(data, leaves[n], axis, step))
              if (beside->depth < leaves[n].depth || step > 0)
                found[chunk].push_back(meter.measure(leaves[n], *beside, axis, step));
    };
    forEachChunk(leaves.size(), kChunk, progress, "measuring jumps", measure);
  });

  Jumps jumps;
  std::size_t count = 0;
  for (const auto& faces : found) count += faces.size();
  jumps.interfaces.reserve(count);
  for (auto& faces : found) {
    jumps.interfaces.insert(jumps.interfaces.end(), faces.begin(), faces.end());
    faces = {};
  }
  sumUp(jumps);
  return jumps;
}

std::vector<std::size_t> worstInterfaces(const Jumps& jumps, JumpKind kind, std::size_t count) {
  std::vector<std::size_t> order(jumps.interfaces.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t kept = std::min(count, order.size());
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(kept), order.end(),
                    [&](std::size_t a, std::size_t b) {
                      const double jumpA = jumpOf(jumps.interfaces[a], kind).max;
                      const double jumpB = jumpOf(jumps.interfaces[b], kind).max;
                      return jumpA != jumpB ? jumpA > jumpB : a < b;
                    });
  order.resize(kept);
  return order;
}

std::vector<double> worstJumpOfCells(const Field& field, const Jumps& jumps, JumpKind kind) {
  std::vector<double> worst(field.data().nodes.size(), 0.0);
  for (const Interface& face : jumps.interfaces)
    for (const std::uint32_t cell : face.cells) worst[cell] = std::max(worst[cell], jumpOf(face, kind).max);
  return worst;
}

std::map<int, JumpBin> jumpHistogram(const Jumps& jumps, JumpKind kind) {
  std::map<int, JumpBin> bins;
  for (const Interface& face : jumps.interfaces) {
    const double jump = jumpOf(face, kind).max;
    if (!(jump > 0)) continue;
    JumpBin& bin = bins[static_cast<int>(std::floor(std::log10(jump)))];
    ++bin.interfaces;
    bin.area += face.area;
  }
  return bins;
}

}  // namespace hpsdf
