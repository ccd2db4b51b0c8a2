#include "hpsdf/jumps.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <span>
#include <utility>
#include <variant>

#include "basis/legendre.h"
#include "field/query/blend.h"
#include "field/query/evaluate.h"
#include "field/query/leaves.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "util/chunks.h"

namespace hpsdf {

using namespace query;

namespace {

/// Sample coordinates in [−1, 1] along one axis of a face: the points of a Gauss rule, and both ends with
/// weight 0. The product of two such lists samples the interior, the edges and the corners of the face.
struct Samples {
  std::vector<double> points, weights;

  /// Makes samples that integrate the square of a polynomial of this degree exactly.
  explicit Samples(int degree) {
    const basis::QuadratureRule rule = basis::gaussLegendre(degree + 1);
    points = {-1, 1};
    weights = {0, 0};
    points.insert(points.end() - 1, rule.points.begin(), rule.points.end());
    weights.insert(weights.end() - 1, rule.weights.begin(), rule.weights.end());
  }
};

/// Returns the two axes in the plane of a face that is perpendicular to `axis`, in cyclic order after `axis`.
constexpr std::array<int, 2> axesAlong(int axis) { return {(axis + 1) % 3, (axis + 2) % 3}; }

/// The trace of a leaf's field on a face: values and gradients in world units at sample points. The points form a
/// grid in the plane of the face, with the second in-plane coordinate varying fastest.
class FaceTrace {
 public:
  const double* value() const { return out_[0].data(); }
  const double* derivative(int axis) const { return out_[1 + axis].data(); }

  void resize(std::size_t size) {
    for (auto& out : out_) out.resize(size);
  }
  void set(std::size_t at, const ValueAndGradient& result) {
    out_[0][at] = result.value;
    for (int axis = 0; axis < 3; ++axis) out_[1 + axis][at] = result.gradient[axis];
  }

  /// Evaluates a leaf's polynomial on the plane perpendicular to `axis` at the leaf's local coordinate t. `along`
  /// holds the local coordinates of the samples along `axesAlong(axis)`. `toWorld` converts local derivatives to
  /// world units.
  template <typename T>
  void evaluate(const T* coefficients, int degree, int axis, double t, const std::array<std::vector<double>, 2>& along,
                const Vector3& toWorld) {
    tabulateBasis(degree, along);
    restrictToPlane(coefficients, degree, axis, t);
    const std::size_t size[2] = {along[0].size(), along[1].size()};
    resize(size[0] * size[1]);
    for (std::size_t s1 = 0; s1 < size[1]; ++s1) {
      restrictToLine(degree, s1);
      for (std::size_t s0 = 0; s0 < size[0]; ++s0) evaluatePoint(degree, axis, s0, s0 * size[1] + s1, toWorld);
    }
  }

 private:
  /// Evaluates the Legendre polynomials at all sample coordinates.
  void tabulateBasis(int degree, const std::array<std::vector<double>, 2>& along) {
    const int n = degree + 1;
    for (int side = 0; side < 2; ++side) {
      basis_[side].resize(along[side].size() * n);
      slope_[side].resize(along[side].size() * n);
      for (std::size_t s = 0; s < along[side].size(); ++s)
        basis::legendreValuesAndDerivatives(along[side][s], degree, &basis_[side][s * n], &slope_[side][s * n]);
    }
  }

  /// Restricts the leaf's polynomial, and its derivative perpendicular to the face, to the plane of the face.
  template <typename T>
  void restrictToPlane(const T* coefficients, int degree, int axis, double t) {
    const int n = degree + 1;
    double across[kMaxDegree + 1], acrossSlope[kMaxDegree + 1];
    basis::legendreValuesAndDerivatives(t, degree, across, acrossSlope);
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
  }

  /// Restricts the polynomials in the plane to the line through sample s1 of the second in-plane axis.
  void restrictToLine(int degree, std::size_t s1) {
    const int n = degree + 1;
    for (int i = 0; i < n; ++i) {
      line_[i] = {};
      for (int j = 0; i + j < n; ++j) {
        const double* c = &plane_[2 * (i * n + j)];
        line_[i].value += c[0] * basis_[1][s1 * n + j];
        line_[i].across += c[1] * basis_[1][s1 * n + j];
        line_[i].along += c[0] * slope_[1][s1 * n + j];
      }
    }
  }

  /// Evaluates the polynomial and its gradient on the line, at sample s0 of the first in-plane axis.
  void evaluatePoint(int degree, int axis, std::size_t s0, std::size_t at, const Vector3& toWorld) {
    const int n = degree + 1;
    double value = 0, d0 = 0, d1 = 0, dAcross = 0;
    for (int i = 0; i < n; ++i) {
      const double b = basis_[0][s0 * n + i];
      value += b * line_[i].value;
      dAcross += b * line_[i].across;
      d0 += slope_[0][s0 * n + i] * line_[i].value;
      d1 += b * line_[i].along;
    }
    out_[0][at] = value;
    const auto derivative = [&](int a, double d) { out_[1 + a % 3][at] = d * toWorld[a % 3]; };
    derivative(axis, dAcross);
    derivative(axis + 1, d0);
    derivative(axis + 2, d1);
  }

  /// Coefficients on a line in the plane of a face: of the polynomial, of its derivative perpendicular to the
  /// plane, and of its derivative along the second in-plane axis.
  struct LineCoefficients {
    double value = 0, across = 0, along = 0;
  };

  std::array<std::vector<double>, 2> basis_, slope_;   ///< L_i and L_i' at the samples of each axis
  std::vector<double> plane_;                          ///< coefficient pairs: polynomial and its normal derivative
  std::array<LineCoefficients, kMaxDegree + 1> line_;  ///< by degree along the first in-plane axis
  std::array<std::vector<double>, 4> out_;             ///< at all samples: value, derivatives along x, y and z
};

/// Measures the jumps of a field on faces. Each thread needs an object of its own.
class FaceMeter {
 public:
  FaceMeter(const Field& field, std::span<const Samples> samples)
      : field_(field), data_(field.data()), samplesOfDegree_(samples) {}

  /// Measures the faces that `forEachInterface` visits for a leaf, and appends them to `faces`.
  void measureLeaf(const OctreeNode& leaf, std::vector<Interface>& faces) {
    forEachInterface(data_, leaf, [&](int axis, int step, const OctreeNode& neighbour) {
      faces.push_back(measure(leaf, neighbour, axis, step));
    });
  }

 private:
  /// Measures the jump on one face of the leaf `small`. The face is at the leaf's lower (step −1) or upper (step
  /// 1) end along `axis`. The leaf `large` lies on the other side.
  Interface measure(const OctreeNode& small, const OctreeNode& large, int axis, int step) {
    const std::array<const OctreeNode*, 2> sides = {step > 0 ? &small : &large, step > 0 ? &large : &small};
    Interface face;
    face.axis = axis;
    for (int side = 0; side < 2; ++side) {
      face.cells[side] = sides[side]->node;
      face.degrees[side] = static_cast<std::uint8_t>(node::degree(data_.nodes[sides[side]->node]));
      face.depths[side] = static_cast<std::uint8_t>(sides[side]->depth);
    }

    // Evaluate the field on both sides of the face, at the samples for the higher one of the two leaves' degrees.
    const auto bits = [&](int side) { return data_.nodes[sides[side]->node]; };
    const Samples& samples = samplesOfDegree_[std::max(sampleDegree(bits(0)), sampleDegree(bits(1)))];
    for (int side = 0; side < 2; ++side) {
      if (data_.blend > 0 || node::isExact(bits(side)))
        tracePoints(traces_[side], *sides[side], small, axis, step, samples);
      else
        tracePolynomial(traces_[side], *sides[side], small, axis, side == 0 ? 1 : -1, samples);
    }
    const std::size_t worst = compareTraces(samples, face);

    // Compute the positions of the face's center and of the sample with the greatest jump.
    const Vector3 size = cellSize(data_, small.depth);
    const auto [axis0, axis1] = axesAlong(axis);
    face.area = size[axis0] * size[axis1];
    std::array<double, 3> local{};
    local[axis] = step;
    face.center = worldAt(small, local);
    if (face.value.max > 0) {
      local[axis0] = samples.points[worst / samples.points.size()];
      local[axis1] = samples.points[worst % samples.points.size()];
    }
    face.worst = worldAt(small, local);
    return face;
  }

  /// Computes the jumps at a face from the fields of the leaves on its two sides. Returns the index of the sample
  /// with the greatest jump of the value.
  std::size_t compareTraces(const Samples& samples, Interface& face) const {
    const std::size_t n = samples.points.size();
    std::size_t worst = 0;
    double valueSquares = 0, gradientSquares = 0, maxGradientSquare = 0;
    for (std::size_t at = 0; at < n * n; ++at) {
      const double jump = std::abs(traces_[1].value()[at] - traces_[0].value()[at]);
      double gradientSquare = 0;
      for (int a = 0; a < 3; ++a) {
        const double difference = traces_[1].derivative(a)[at] - traces_[0].derivative(a)[at];
        gradientSquare += difference * difference;
      }
      const double weight = samples.weights[at / n] * samples.weights[at % n] / 4;
      valueSquares += weight * jump * jump;
      gradientSquares += weight * gradientSquare;
      maxGradientSquare = std::max(maxGradientSquare, gradientSquare);
      if (jump > face.value.max) {
        face.value.max = jump;
        worst = at;
      }
    }
    face.value.rms = std::sqrt(valueSquares);
    face.gradient = {std::sqrt(gradientSquares), std::sqrt(maxGradientSquare)};
    return worst;
  }

  /// Evaluates a leaf's polynomial at the samples of a face of the leaf `small`. The face lies at the local
  /// coordinate t of `leaf`.
  void tracePolynomial(FaceTrace& trace, const OctreeNode& leaf, const OctreeNode& small, int axis, double t,
                       const Samples& samples) {
    const int levels = small.depth - leaf.depth;
    const double scale = std::ldexp(1.0, -levels);
    for (int side = 0; side < 2; ++side) {
      const int along = axesAlong(axis)[side];
      const auto offset = static_cast<double>(small.cellIndex[along] - (leaf.cellIndex[along] << levels));
      along_[side] = samples.points;
      if (levels > 0)
        for (double& u : along_[side]) u = (2 * offset + u + 1) * scale - 1;
    }
    const std::uint64_t bits = data_.nodes[leaf.node];
    const Vector3 toWorld = 2 * cellSize(data_, leaf.depth).cwiseInverse();
    withCoefficients(data_, bits,
                     [&](const auto* c) { trace.evaluate(c, node::degree(bits), axis, t, along_, toWorld); });
  }

  /// Evaluates the field, blended or exact, point by point at the samples of a face of the leaf `small`. The results
  /// are the limits from within `leaf`.
  void tracePoints(FaceTrace& trace, const OctreeNode& leaf, const OctreeNode& small, int axis, int step,
                   const Samples& samples) {
    const std::size_t n = samples.points.size();
    trace.resize(n * n);
    std::array<double, 3> local{};
    local[axis] = step;
    for (std::size_t at = 0; at < n * n; ++at) {
      local[(axis + 1) % 3] = samples.points[at / n];
      local[(axis + 2) % 3] = samples.points[at % n];
      const std::array<double, 3> coordinates = gridCoordinatesAt(small, local);
      const LeafPoint point = leafPoint(data_.nodes[leaf.node], leaf.depth, leaf.node, leaf.cellIndex, coordinates);
      trace.set(at, evaluateInLeaf<ValueAndGradient>(data_, field_.lookupGrid(), coordinates, point));
    }
  }

  static std::array<double, 3> gridCoordinatesAt(const OctreeNode& leaf, const std::array<double, 3>& local) {
    std::array<double, 3> coordinates;
    for (int axis = 0; axis < 3; ++axis)
      coordinates[axis] = std::ldexp(static_cast<double>(leaf.cellIndex[axis]) + (local[axis] + 1) / 2, -leaf.depth);
    return coordinates;
  }

  Vector3 worldAt(const OctreeNode& leaf, const std::array<double, 3>& local) const {
    return worldPoint(field_.lookupGrid().frame, gridCoordinatesAt(leaf, local));
  }

  const Field& field_;
  const FieldData& data_;
  std::span<const Samples> samplesOfDegree_;
  std::array<FaceTrace, 2> traces_;           ///< traces of the leaves on the lower and on the upper side
  std::array<std::vector<double>, 2> along_;  ///< local coordinates of the samples along the face
};

/// Sums over interfaces, from which their totals follow.
struct JumpSums {
  JumpTotals totals;
  double valueSquares = 0, gradientSquares = 0;

  void add(const Interface& face) {
    totals.hanging += face.hanging();
    totals.area += face.area;
    valueSquares += face.area * face.value.rms * face.value.rms;
    gradientSquares += face.area * face.gradient.rms * face.gradient.rms;
    addMaxima(face.value, face.gradient);
  }
  void add(const JumpSums& other) {
    totals.hanging += other.totals.hanging;
    totals.area += other.totals.area;
    valueSquares += other.valueSquares;
    gradientSquares += other.gradientSquares;
    addMaxima(other.totals.value, other.totals.gradient);
  }
  JumpTotals result() const {
    JumpTotals all = totals;
    if (all.area > 0) {
      all.value.rms = std::sqrt(valueSquares / all.area);
      all.gradient.rms = std::sqrt(gradientSquares / all.area);
    }
    return all;
  }

 private:
  void addMaxima(const Jump& value, const Jump& gradient) {
    totals.value.max = std::max(totals.value.max, value.max);
    totals.gradient.max = std::max(totals.gradient.max, gradient.max);
  }
};

/// Measures the faces of all leaves of a field, in chunks of leaves.
class LeafJumps {
 public:
  static constexpr std::size_t kChunk = 256;

  explicit LeafJumps(const Field& field) : field_(field), leaves_(allLeaves(field.data())) {
    int maxDegree = 0;
    for (const OctreeNode& leaf : leaves_) maxDegree = std::max(maxDegree, sampleDegree(field.data().nodes[leaf.node]));
    for (int degree = 0; degree <= maxDegree; ++degree) samples_.emplace_back(degree);
  }

  std::size_t leaves() const { return leaves_.size(); }

  /// Appends the faces of a chunk to `faces`, which must be empty, and adds them to `sums`.
  void measure(std::size_t first, std::size_t count, std::vector<Interface>& faces, JumpSums& sums) const {
    FaceMeter meter(field_, samples_);
    for (std::size_t n = first; n < first + count; ++n) meter.measureLeaf(leaves_[n], faces);
    for (const Interface& face : faces) sums.add(face);
  }

 private:
  const Field& field_;
  std::vector<OctreeNode> leaves_;
  std::vector<Samples> samples_;  ///< for each degree
};

constexpr const char* kMeasuringJumps = "measuring jumps";

}  // namespace

JumpTotals measureJumps(const Field& field, int threads, const Progress& progress) {
  const LeafJumps leaves(field);
  const auto measure = [&](JumpSums& sums, std::size_t first, std::size_t count) {
    std::vector<Interface> faces;
    leaves.measure(first, count, faces, sums);
  };
  return withThreads(threads, [&] {
    return detail::sumOfChunks<JumpSums>(leaves.leaves(), LeafJumps::kChunk, progress, kMeasuringJumps, measure)
        .result();
  });
}

Jumps findJumps(const Field& field, int threads, const Progress& progress) {
  const LeafJumps leaves(field);
  std::vector<JumpSums> sumsOfChunks(detail::chunksOf(leaves.leaves(), LeafJumps::kChunk));
  const auto measure = [&](std::vector<Interface>& faces, std::size_t first, std::size_t count) {
    leaves.measure(first, count, faces, sumsOfChunks[first / LeafJumps::kChunk]);
  };
  Jumps jumps;
  jumps.interfaces = withThreads(threads, [&] {
    return detail::listOfChunks<Interface>(leaves.leaves(), LeafJumps::kChunk, progress, kMeasuringJumps, measure);
  });
  JumpSums sums;
  for (const JumpSums& ofChunk : sumsOfChunks) sums.add(ofChunk);
  static_cast<JumpTotals&>(jumps) = sums.result();
  return jumps;
}

std::vector<std::size_t> worstInterfaces(const Jumps& jumps, JumpKind kind, std::size_t count) {
  std::vector<std::size_t> order(jumps.interfaces.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t kept = std::min(count, order.size());
  std::ranges::partial_sort(order, order.begin() + static_cast<std::ptrdiff_t>(kept), {},
                            [&](std::size_t n) { return std::pair(-jumpOf(jumps.interfaces[n], kind).max, n); });
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
