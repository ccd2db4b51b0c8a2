#pragma once
// Evaluation of blended fields. Blending is a partition of unity: the weights of neighbouring leaves overlap at
// their common faces (docs/design.md).

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <variant>

#include "field/query/evaluate.h"
#include "field/query/quantized.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/detail/lookup_grid.h"

namespace hpsdf::query {

/// Returns a bit mask of axes, with bit 0 for x. A set bit means that the point is near a face of its leaf
/// perpendicular to that axis, where other leaves may have a weight too. Returns 0 for a field without blending.
inline unsigned blendZoneAxes(const FieldData& field, const std::array<double, 3>& local) {
  if (!(field.blend > 0)) return 0;
  const double core = 1 - 2 * field.blend;
  const auto bit = [&](int axis) { return unsigned(std::abs(local[axis]) > core) << axis; };
  return bit(0) | bit(1) | bit(2);
}

/// One of the three factors of a leaf's blending weight, each of which depends on the position along one axis.
struct Ramp {
  double value;
  double slope;      ///< derivative of the value with respect to the world coordinate
  double curvature;  ///< second derivative, which jumps where the ramp begins and ends
};

/// Evaluates the ramp S(t) = 1/2 + 3t/4 − t³/4, the gentlest step with a continuous slope from 0 at t = −1 to 1
/// at t = 1. Here t is the signed distance to the nearer of the leaf's two faces perpendicular to `axis`, divided
/// by the half width of the zone in which leaves are blended at this face.
inline Ramp rampAlong(const FieldData& field, const LookupGrid& lookupGrid, const LeafPoint& leaf, int axis) {
  const GridFrame& frame = lookupGrid.frame;
  const bool upper = leaf.local[axis] > 0;
  const int depth = blend_extent::depth(lookupGrid.blendExtents[leaf.blendExtentsIndex], axis, upper);
  if (depth == blend_extent::kDomainFace) return {1, 0, 0};
  // The factor 2^(depth − leaf.depth) / (2 · blend) converts local coordinates to half widths of the blend zone.
  const double scale = std::bit_cast<double>(std::uint64_t(1022 + depth - leaf.depth) << 52) / field.blend;
  const double t = std::clamp((1 - std::abs(leaf.local[axis])) * scale, -1.0, 1.0);
  const double toWorld = 2.0 * (std::uint32_t{1} << leaf.depth) * frame.cells[axis] / frame.size[axis];
  const double curvature = std::abs(t) < 1 ? -1.5 * t * (scale * toWorld) * (scale * toWorld) : 0;
  return {0.5 + t * (0.75 - 0.25 * t * t), (upper ? -0.75 : 0.75) * (1 - t * t) * scale * toWorld, curvature};
}

/// Returns the fixed-point coordinate just across the lower or upper face of a cell. If the domain ends at that
/// face, the result is below 0 or beyond the grid.
inline std::int64_t fixedPointAcross(std::int64_t cellIndex, int depth, bool upper) {
  return upper ? (cellIndex + 1) << (kMaxDepth - depth) : (cellIndex << (kMaxDepth - depth)) - 1;
}

/// Returns true if only two leaves have a weight at a point, which is the usual case in blend zones. The point must be
/// near exactly one face of its leaf, perpendicular to `axis`. `localAcross` holds the point's local coordinates in the
/// leaf on the other side of this face.
inline bool onlyTwoOverlap(const FieldData& field, const std::array<double, 3>& localAcross, int axis) {
  return (blendZoneAxes(field, localAcross) & ~(1U << axis)) == 0;
}

/// Returns the mean of the values a and b of two leaves, weighted by the leaves' ramps along the axis
/// perpendicular to their common face.
inline double blendTwo(double a, const Ramp& rampA, double b, const Ramp& rampB, int) {
  return a + rampB.value / (rampA.value + rampB.value) * (b - a);
}
inline ValueAndGradient blendTwo(const ValueAndGradient& a, const Ramp& rampA, const ValueAndGradient& b,
                                 const Ramp& rampB, int axis) {
  const double sum = rampA.value + rampB.value, share = rampB.value / sum, difference = b.value - a.value;
  ValueAndGradient result{a.value + share * difference, a.gradient + share * (b.gradient - a.gradient)};
  result.gradient[axis] += difference * (rampB.slope * rampA.value - rampB.value * rampA.slope) / (sum * sum);
  return result;
}

inline ValueGradientHessian blendTwo(const ValueGradientHessian& a, const Ramp& rampA, const ValueGradientHessian& b,
                                     const Ramp& rampB, int axis) {
  ValueGradientHessian result;
  setFirstDerivatives(result, blendTwo(firstDerivatives(a), rampA, firstDerivatives(b), rampB, axis));
  const double sum = rampA.value + rampB.value, share = rampB.value / sum, difference = b.value - a.value;
  const double shareSlope = (rampB.slope * rampA.value - rampB.value * rampA.slope) / (sum * sum);
  const double shareCurvature = (rampB.curvature * rampA.value - rampB.value * rampA.curvature) / (sum * sum) -
                                2 * shareSlope * (rampA.slope + rampB.slope) / sum;
  result.hessian = a.hessian + share * (b.hessian - a.hessian) +
                   symmetricProduct(shareSlope * Vector3::Unit(axis), b.gradient - a.gradient);
  result.hessian(axis, axis) += difference * shareCurvature;
  return result;
}

/// The cells of one depth whose distance from a point along each axis is at most `blend` times the cell's edge:
/// one or two cells along each axis.
struct CandidateCells {
  CellIndex first;
  std::array<int, 3> extra;  ///< number of cells besides the first along each axis, 0 or 1

  CandidateCells(const GridFrame& frame, const std::array<double, 3>& gridCoordinates, int depth, double blend) {
    const double scale = std::uint32_t{1} << depth;
    for (int axis = 0; axis < 3; ++axis) {
      const double coordinate = gridCoordinates[axis] * scale;
      const std::int64_t last = frame.last[axis] >> (kMaxDepth - depth);
      // The cast rounds small negative numbers to 0. The minimum is needed at the domain's upper end, where a
      // tiny blend width may be lost by rounding.
      first[axis] = std::min(static_cast<std::int64_t>(coordinate - blend), last);
      extra[axis] = std::min(static_cast<std::int64_t>(coordinate + blend), last) > first[axis];
    }
  }

  /// Calls f(slot, cell index) for each candidate cell. The slot is x + 2y + 4z, where (x, y, z) is the cell's offset
  /// from the first cell.
  template <typename F>
  void forEach(F&& f) const {
    for (int z = 0; z <= extra[2]; ++z)
      for (int y = 0; y <= extra[1]; ++y)
        for (int x = 0; x <= extra[0]; ++x) f(x + 2 * y + 4 * z, CellIndex{first[0] + x, first[1] + y, first[2] + z});
  }
};

/// The internal octree nodes among the candidate cells of one depth. Candidate cells are the cells near a point.
struct OpenNodes {
  CandidateCells cells;
  std::array<std::uint64_t, 8> bits;  ///< the packed node in each slot; 0 for a leaf
  bool any = false;
};

/// Visits the leaves among the candidate cells of the depth at which the search starts: the lookup grid's
/// depth, or 0. Returns the internal nodes among these cells.
template <typename Visit>
OpenNodes visitFirstDepth(const FieldData& field, const LookupGrid& lookupGrid,
                          const std::array<double, 3>& gridCoordinates, bool byLookupGrid, Visit&& visit) {
  const int depth = byLookupGrid ? lookupGrid.depth : 0;
  OpenNodes open{{lookupGrid.frame, gridCoordinates, depth, field.blend}, {}};
  open.cells.forEach([&](int slot, const CellIndex& cell) {
    const std::int64_t entry = byLookupGrid ? cell[2] * lookupGrid.slab + cell[1] * lookupGrid.row + cell[0]
                                            : (cell[2] * field.grid[1] + cell[1]) * field.grid[0] + cell[0];
    const std::uint64_t bits = byLookupGrid ? lookupGrid.entries[entry] : field.nodes[entry];
    open.bits[slot] = node::isLeaf(bits) ? 0 : bits;
    open.any |= open.bits[slot] != 0;
    if (open.bits[slot] != 0) return;
    const int levels = byLookupGrid ? depth - LookupGrid::depthOf(bits) : 0;
    CellIndex leaf;
    for (int axis = 0; axis < 3; ++axis) {
      leaf[axis] = cell[axis] >> levels;
      // A large leaf may cover several candidate cells. Visit it only at the first of these cells.
      if (cell[axis] > open.cells.first[axis] && leaf[axis] << levels != cell[axis]) return;
    }
    visit(leafPoint(bits, depth - levels, (byLookupGrid ? field.nodes.size() : 0) + entry, leaf, gridCoordinates));
  });
  return open;
}

/// Visits the leaves among the candidate cells of depth `depth` that are children of the internal nodes
/// `parents`. Returns the internal nodes among these cells.
template <typename Visit>
OpenNodes visitNextDepth(const FieldData& field, const GridFrame& frame, const std::array<double, 3>& gridCoordinates,
                         int depth, const OpenNodes& parents, Visit&& visit) {
  OpenNodes open{{frame, gridCoordinates, depth, field.blend}, {}};
  open.cells.forEach([&](int slot, const CellIndex& cell) {
    int parent = 0;
    std::uint32_t child = 0;
    for (int axis = 0; axis < 3; ++axis) {
      parent += static_cast<int>((cell[axis] >> 1) - parents.cells.first[axis]) << axis;
      child += static_cast<std::uint32_t>(cell[axis] & 1) << axis;
    }
    if (parents.bits[parent] == 0) return;
    child += node::firstChild(parents.bits[parent]);
    const std::uint64_t bits = field.nodes[child];
    if (node::isLeaf(bits)) return visit(leafPoint(bits, depth, child, cell, gridCoordinates));
    open.bits[slot] = bits;
    open.any = true;
  });
  return open;
}

/// Calls visit(LeafPoint) once for every leaf that may have a weight at a point of the domain. `ownDepth` is the depth
/// of the leaf that holds the point. The search proceeds depth by depth from candidate cells to their children. There
/// are at most eight candidates at each depth. No candidate is missed: (distance from the point to the cell) / (edge of
/// the cell) is not greater for a parent than for its child. The search starts in the lookup grid. If the leaf that
/// holds the point is larger than a cell of the lookup grid, the search starts at the base cells instead, because the
/// candidates in the lookup grid may then miss leaves.
template <typename Visit>
void visitOverlapping(const FieldData& field, const LookupGrid& lookupGrid,
                      const std::array<double, 3>& gridCoordinates, int ownDepth, Visit&& visit) {
  const bool byLookupGrid = ownDepth >= lookupGrid.depth;
  OpenNodes open = visitFirstDepth(field, lookupGrid, gridCoordinates, byLookupGrid, visit);
  for (int depth = (byLookupGrid ? lookupGrid.depth : 0) + 1; open.any; ++depth)
    open = visitNextDepth(field, lookupGrid.frame, gridCoordinates, depth, open, visit);
}

/// Computes the weighted mean (Σ wₙ fₙ) / (Σ wₙ) of values fₙ of leaves n with weights wₙ. It sums the differences fₙ −
/// f₀ from the first leaf's value f₀, so that equal values yield exactly that value.
template <typename Result>
class PartitionOfUnity;

template <>
class PartitionOfUnity<double> {
 public:
  void add(const std::array<Ramp, 3>& ramps, double f) {
    if (weights_ == 0) first_ = f;
    const double weight = ramps[0].value * ramps[1].value * ramps[2].value;
    weights_ += weight;
    sum_ += weight * (f - first_);
  }
  double result() const { return first_ + sum_ / weights_; }

 private:
  double first_ = 0, weights_ = 0, sum_ = 0;
};

template <>
class PartitionOfUnity<ValueAndGradient> {
 public:
  void add(const std::array<Ramp, 3>& ramps, const ValueAndGradient& f) {
    if (weights_ == 0) first_ = f;
    const auto& [x, y, z] = ramps;
    const double weight = x.value * y.value * z.value;
    const Vector3 slope = slopeOf(ramps);
    const double difference = f.value - first_.value;
    weights_ += weight;
    sum_ += weight * difference;
    weightsGradient_ += slope;
    sumGradient_ += slope * difference + weight * (f.gradient - first_.gradient);
  }
  ValueAndGradient result() const {
    const double mean = sum_ / weights_;
    return {first_.value + mean, first_.gradient + (sumGradient_ - mean * weightsGradient_) / weights_};
  }

 protected:
  /// Returns the gradient of a weight.
  static Vector3 slopeOf(const std::array<Ramp, 3>& ramps) {
    const auto& [x, y, z] = ramps;
    return {x.slope * y.value * z.value, x.value * y.slope * z.value, x.value * y.value * z.slope};
  }

  ValueAndGradient first_{0, Vector3::Zero()};
  double weights_ = 0, sum_ = 0;
  Vector3 weightsGradient_ = Vector3::Zero(), sumGradient_ = Vector3::Zero();
};

template <>
class PartitionOfUnity<ValueGradientHessian> : private PartitionOfUnity<ValueAndGradient> {
 public:
  void add(const std::array<Ramp, 3>& ramps, const ValueGradientHessian& f) {
    if (weights_ == 0) firstHessian_ = f.hessian;
    PartitionOfUnity<ValueAndGradient>::add(ramps, firstDerivatives(f));
    const double weight = ramps[0].value * ramps[1].value * ramps[2].value;
    const Eigen::Matrix3d curvature = curvatureOf(ramps);
    weightsHessian_ += curvature;
    sumHessian_ += curvature * (f.value - first_.value) +
                   symmetricProduct(slopeOf(ramps), f.gradient - first_.gradient) +
                   weight * (f.hessian - firstHessian_);
  }
  ValueGradientHessian result() const {
    ValueGradientHessian result;
    setFirstDerivatives(result, PartitionOfUnity<ValueAndGradient>::result());
    const double mean = sum_ / weights_;
    const Vector3 meanGradient = (sumGradient_ - mean * weightsGradient_) / weights_;
    result.hessian =
        firstHessian_ +
        (sumHessian_ - mean * weightsHessian_ - symmetricProduct(meanGradient, weightsGradient_)) / weights_;
    return result;
  }

 private:
  /// Returns the Hessian of a weight.
  static Eigen::Matrix3d curvatureOf(const std::array<Ramp, 3>& ramps) {
    Eigen::Matrix3d curvature;
    for (int a = 0; a < 3; ++a) {
      const Ramp &along = ramps[a], &next = ramps[(a + 1) % 3], &last = ramps[(a + 2) % 3];
      curvature(a, a) = along.curvature * next.value * last.value;
      curvature(a, (a + 1) % 3) = curvature((a + 1) % 3, a) = along.slope * next.slope * last.value;
    }
    return curvature;
  }

  Eigen::Matrix3d firstHessian_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d weightsHessian_ = Eigen::Matrix3d::Zero(), sumHessian_ = Eigen::Matrix3d::Zero();
};

/// Evaluates one leaf at the point with the grid coordinates `gridCoordinates`, without blending. `Result` is double,
/// `ValueAndGradient` or `ValueGradientHessian`, here and below.
template <typename Result>
Result evaluateLeaf(const FieldData& field, const GridFrame& frame, const std::array<double, 3>& gridCoordinates,
                    const LeafPoint& leaf) {
  Result result;
  if (node::isExact(leaf.bits)) [[unlikely]] {
    const Vector3 x = worldPoint(frame, gridCoordinates);
    evaluateExact(field.exact, leaf.bits, octantOf(leaf.local), {&x, 1}, &result);
    return result;
  }
  std::visit([&](const auto& c) { evaluateLeaf(c, frame, leaf, result); }, field.coefficients);
  return result;
}

/// Returns the blended field at a point, from all leaves that have a weight at the point. `ownDepth` is the depth
/// of the leaf that holds the point.
template <typename Result>
Result blendAll(const FieldData& field, const LookupGrid& lookupGrid, const std::array<double, 3>& gridCoordinates,
                int ownDepth) {
  PartitionOfUnity<Result> blend;
  visitOverlapping(field, lookupGrid, gridCoordinates, ownDepth, [&](const LeafPoint& leaf) {
    std::array<Ramp, 3> ramps;
    for (int axis = 0; axis < 3; ++axis) {
      ramps[axis] = rampAlong(field, lookupGrid, leaf, axis);
      if (!(ramps[axis].value > 0)) return;
    }
    blend.add(ramps, evaluateLeaf<Result>(field, lookupGrid.frame, gridCoordinates, leaf));
  });
  return blend.result();
}

/// Returns the blended field at a point of `leaf` that lies in blend zones. `axes` is the bit mask from
/// `blendZoneAxes`.
template <typename Result>
Result blendInZone(const FieldData& field, const LookupGrid& lookupGrid, const std::array<double, 3>& gridCoordinates,
                   const LeafPoint& leaf, unsigned axes) {
  if (!std::has_single_bit(axes)) return blendAll<Result>(field, lookupGrid, gridCoordinates, leaf.depth);

  // Find the leaf on the other side of the only face to which the point is near.
  const GridFrame& frame = lookupGrid.frame;
  const int axis = std::countr_zero(axes);
  GridPoint across{gridCoordinates, {}, 0};
  for (int a = 0; a < 3; ++a) {
    across.fixedPoint[a] = a == axis ? fixedPointAcross(leaf.cellIndex[a], leaf.depth, leaf.local[a] > 0)
                                     : static_cast<std::int64_t>(gridCoordinates[a] * kFixedPointOne);
    across.path |= pathBits(a, across.fixedPoint[a]);
  }
  if (across.fixedPoint[axis] < 0 || across.fixedPoint[axis] > frame.last[axis])
    return evaluateLeaf<Result>(field, frame, gridCoordinates, leaf);
  const LeafPoint other = findLeaf(field, lookupGrid, across);

  // Blend the two leaves, or all leaves if a third one also has a weight at the point.
  if (!onlyTwoOverlap(field, other.local, axis))
    return blendAll<Result>(field, lookupGrid, gridCoordinates, leaf.depth);
  return blendTwo(evaluateLeaf<Result>(field, frame, gridCoordinates, leaf), rampAlong(field, lookupGrid, leaf, axis),
                  evaluateLeaf<Result>(field, frame, gridCoordinates, other), rampAlong(field, lookupGrid, other, axis),
                  axis);
}

/// Evaluates the field at a point of a leaf. If the point is on a face of the leaf, the result is the limit
/// from within the leaf.
template <typename Result>
Result evaluateInLeaf(const FieldData& field, const LookupGrid& lookupGrid,
                      const std::array<double, 3>& gridCoordinates, const LeafPoint& leaf) {
  if (const unsigned axes = blendZoneAxes(field, leaf.local); axes != 0)
    return blendInZone<Result>(field, lookupGrid, gridCoordinates, leaf, axes);
  return evaluateLeaf<Result>(field, lookupGrid.frame, gridCoordinates, leaf);
}

}  // namespace hpsdf::query
