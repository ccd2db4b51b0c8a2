#pragma once
// Search in the octree for the leaf that holds a point, and evaluation of the leaf's polynomial at the point.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "basis/legendre.h"
#include "field/query/exact_leaf.h"
#include "field/query/leaves.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/detail/lookup_grid.h"

namespace hpsdf::query {

/// The number 1 in the fixed-point format of `GridPoint`.
constexpr std::int64_t kFixedPointOne = std::int64_t{1} << kMaxDepth;

/// A point of the domain in grid coordinates, in which base cells have edges of length 1.
struct GridPoint {
  std::array<double, 3> coordinates;
  std::array<std::int64_t, 3> fixedPoint;  ///< the coordinates, rounded down to kMaxDepth binary digits
  std::uint64_t path;                      ///< octree path: the fractional bits of `fixedPoint`, 21 for each axis

  /// Returns the index of the cell of depth `depth` that holds the point.
  CellIndex cellIndex(int depth) const {
    const int shift = kMaxDepth - depth;
    return {fixedPoint[0] >> shift, fixedPoint[1] >> shift, fixedPoint[2] >> shift};
  }
};

/// Returns the number, 0 to 7, of the child that an octree path takes to reach depth `depth`.
inline std::uint32_t childOnPath(std::uint64_t path, int depth) {
  const std::uint64_t bits = (path >> (kMaxDepth - depth)) & (1 | std::uint64_t{1} << 21 | std::uint64_t{1} << 42);
  return static_cast<std::uint32_t>(bits | bits >> 20 | bits >> 40) & 7;
}

inline GridFrame gridFrame(const FieldData& field) {
  GridFrame frame;
  for (int axis = 0; axis < 3; ++axis) {
    frame.lower[axis] = field.domain.min()[axis];
    frame.upper[axis] = field.domain.max()[axis];
    frame.size[axis] = field.domain.max()[axis] - field.domain.min()[axis];
    frame.cells[axis] = field.grid[axis];
    frame.last[axis] = field.grid[axis] * kFixedPointOne - 1;
  }
  return frame;
}

/// Returns the bits that one coordinate of a point contributes to the point's octree path.
inline std::uint64_t pathBits(int axis, std::int64_t fixedPoint) {
  return static_cast<std::uint64_t>(fixedPoint & (kFixedPointOne - 1)) << (21 * axis);
}

/// Maps a world coordinate to a grid coordinate. With this order of the operations, a plane through the middle
/// of the domain lies exactly on the face between two base cells.
inline double gridCoordinate(const GridFrame& frame, int axis, double x) {
  return ((x - frame.lower[axis]) / frame.size[axis]) * frame.cells[axis];
}

/// Sets the point's fixed-point coordinate along one axis and adds its bits to the octree path. Points on the
/// domain's upper faces belong to the cells below these faces.
inline void setFixedPoint(const GridFrame& frame, int axis, GridPoint& point) {
  point.fixedPoint[axis] =
      std::min(static_cast<std::int64_t>(point.coordinates[axis] * kFixedPointOne), frame.last[axis]);
  point.path |= pathBits(axis, point.fixedPoint[axis]);
}

/// Makes a `GridPoint` from a point's grid coordinates.
inline GridPoint gridPoint(const GridFrame& frame, const std::array<double, 3>& coordinates) {
  GridPoint point{coordinates, {}, 0};
  for (int axis = 0; axis < 3; ++axis) setFixedPoint(frame, axis, point);
  return point;
}

/// Makes a `GridPoint` from the world coordinates of a point in the domain.
inline GridPoint gridPoint(const GridFrame& frame, const Vector3& x) {
  GridPoint point;
  point.path = 0;
  for (int axis = 0; axis < 3; ++axis) {
    point.coordinates[axis] = gridCoordinate(frame, axis, x[axis]);
    setFixedPoint(frame, axis, point);
  }
  return point;
}

/// Maps grid coordinates to world coordinates.
inline Vector3 worldPoint(const GridFrame& frame, const std::array<double, 3>& coordinates) {
  Vector3 x;
  for (int axis = 0; axis < 3; ++axis)
    x[axis] = frame.lower[axis] + coordinates[axis] / frame.cells[axis] * frame.size[axis];
  return x;
}

/// Returns the box of a cell in world coordinates.
inline Box cellBox(const GridFrame& frame, int depth, const CellIndex& cellIndex) {
  std::array<double, 3> lower, upper;
  for (int axis = 0; axis < 3; ++axis) {
    lower[axis] = std::ldexp(static_cast<double>(cellIndex[axis]), -depth);
    upper[axis] = std::ldexp(static_cast<double>(cellIndex[axis] + 1), -depth);
  }
  return Box(worldPoint(frame, lower), worldPoint(frame, upper));
}

/// Finds the leaf that holds a point. Descends the octree from the base cell that holds the point.
inline OctreeNode findLeafNode(const FieldData& field, const GridPoint& point) {
  const CellIndex base = point.cellIndex(0);
  auto node = static_cast<std::uint32_t>((base[2] * field.grid[1] + base[1]) * field.grid[0] + base[0]);
  int depth = 0;
  while (!node::isLeaf(field.nodes[node]))
    node = node::firstChild(field.nodes[node]) + childOnPath(point.path, ++depth);
  return {node, depth, point.cellIndex(depth)};
}

/// A point in the local coordinates of a leaf.
struct LeafPoint {
  std::uint64_t bits;  ///< packed node: the leaf's degree and the offset of its coefficients
  int depth;
  std::array<double, 3> local;  ///< in [−1, 1] within the leaf; beyond it, the polynomial is extrapolated
  CellIndex cellIndex;
  std::size_t blendExtentsIndex;  ///< index into `LookupGrid::blendExtents`
};

inline LeafPoint leafPoint(std::uint64_t bits, int depth, std::size_t blendExtentsIndex, const CellIndex& cellIndex,
                           const std::array<double, 3>& gridCoordinates) {
  LeafPoint leaf{bits, depth, {}, cellIndex, blendExtentsIndex};
  // Scaling by a power of two and subtracting the integer part are exact operations.
  const double scale = std::uint32_t{1} << depth;
  for (int axis = 0; axis < 3; ++axis)
    leaf.local[axis] = 2 * (gridCoordinates[axis] * scale - static_cast<double>(cellIndex[axis])) - 1;
  return leaf;
}

/// Finds the leaf that holds a point, like `findLeafNode`. The descent starts in the lookup grid, an array of the
/// nodes of one depth.
inline LeafPoint findLeaf(const FieldData& field, const LookupGrid& lookupGrid, const GridPoint& point) {
  const CellIndex top = point.cellIndex(lookupGrid.depth);
  const std::int64_t entry = top[2] * lookupGrid.slab + top[1] * lookupGrid.row + top[0];
  std::uint64_t bits = lookupGrid.entries[entry];
  int depth = LookupGrid::depthOf(bits);
  std::size_t index = field.nodes.size() + entry;
  while (!node::isLeaf(bits)) {
    index = node::firstChild(bits) + childOnPath(point.path, ++depth);
    bits = field.nodes[index];
  }
  return leafPoint(bits, depth, index, point.cellIndex(depth), point.coordinates);
}

/// Returns the edge lengths, in world units, of the cells of depth `depth`.
inline Vector3 cellSize(const FieldData& field, int depth) {
  const Vector3 size = field.domain.max() - field.domain.min();
  const double scale = std::ldexp(1.0, -depth);
  return {size.x() / field.grid[0] * scale, size.y() / field.grid[1] * scale, size.z() / field.grid[2] * scale};
}

/// A polynomial degree that is known at compile time, for which the compiler unrolls the loops over coefficients.
/// A degree that is known only at run time is an int.
template <int P>
using Constant = std::integral_constant<int, P>;

constexpr int minus(int a, int b) { return a - b; }
template <int A, int B>
constexpr Constant<A - B> minus(Constant<A>, Constant<B>) {
  return {};
}

/// Size of an array that holds one number for each degree from 0 up to `Degree`.
template <typename Degree>
constexpr int kDegreeCount = kMaxDegree + 1;
template <int P>
constexpr int kDegreeCount<Constant<P>> = P + 1;

using basis::legendreValues;
using basis::legendreValuesAndDerivatives;
#include "field/query/polynomial-inl.h"

/// Calls f with the degree. For the degrees that most leaves have, the argument is a compile-time `Constant`,
/// otherwise an int.
template <typename F>
auto withDegree(int degree, const F& f) {
  switch (degree) {
    case 1:
      return f(Constant<1>());
    case 2:
      return f(Constant<2>());
    case 3:
      return f(Constant<3>());
    case 4:
      return f(Constant<4>());
    case 5:
      return f(Constant<5>());
    default:
      return f(degree);
  }
}

/// Evaluates a polynomial at local coordinates in [−1, 1]³.
template <typename T>
double evaluate(const T* coefficients, int degree, const std::array<double, 3>& local) {
  return withDegree(degree, [&](auto known) { return evaluatePolynomial(coefficients, known, local); });
}

/// Evaluates a polynomial and its gradient with respect to the local coordinates.
template <typename T>
ValueAndGradient evaluateWithGradient(const T* coefficients, int degree, const std::array<double, 3>& local) {
  const auto [value, x, y, z] =
      withDegree(degree, [&](auto known) { return evaluatePolynomialWithGradient(coefficients, known, local); });
  return {value, {x, y, z}};
}

/// Scales a gradient from the local coordinates of a leaf to world units.
inline void toWorldUnits(const GridFrame& frame, const LeafPoint& leaf, Vector3& gradient) {
  const double scale = 2.0 * (std::uint32_t{1} << leaf.depth);
  for (int axis = 0; axis < 3; ++axis) gradient[axis] *= scale * frame.cells[axis] / frame.size[axis];
}

/// Scales a Hessian in the same way.
inline void toWorldUnits(const GridFrame& frame, const LeafPoint& leaf, Eigen::Matrix3d& hessian) {
  Vector3 scale = Vector3::Ones();
  toWorldUnits(frame, leaf, scale);
  hessian.array() *= (scale * scale.transpose()).array();
}

/// Returns u vᵀ + v uᵀ, which is symmetric to the bit.
inline Eigen::Matrix3d symmetricProduct(const Vector3& u, const Vector3& v) {
  return u * v.transpose() + v * u.transpose();
}

/// Returns the Hessian of a polynomial with respect to the local coordinates.
template <typename T>
Eigen::Matrix3d polynomialHessian(const T* coefficients, int degree, const std::array<double, 3>& local);

/// Returns a pointer to the coefficients of a leaf, which is not exact. `leaf` is the packed node. Throws `Error` if
/// they lie in a mapped file that is damaged. There is an overload for quantized coefficients (quantized.h).
template <typename T>
const T* leafOf(const FieldArray<T>& coefficients, std::uint64_t leaf) {
  return coefficients.at(node::offset(leaf), coefficientCount(node::degree(leaf)));
}

/// Evaluates the polynomial of a leaf, which is not exact, at a point. The overloads with derivatives give them in
/// world units. There are more overloads for quantized coefficients (quantized.h).
template <typename T>
void evaluateLeaf(const FieldArray<T>& coefficients, const GridFrame&, const LeafPoint& leaf, double& value) {
  value = evaluate(leafOf(coefficients, leaf.bits), node::degree(leaf.bits), leaf.local);
}

template <typename T>
void evaluateLeaf(const FieldArray<T>& coefficients, const GridFrame& frame, const LeafPoint& leaf,
                  ValueAndGradient& result) {
  result = evaluateWithGradient(leafOf(coefficients, leaf.bits), node::degree(leaf.bits), leaf.local);
  toWorldUnits(frame, leaf, result.gradient);
}

template <typename T>
void evaluateLeaf(const FieldArray<T>& coefficients, const GridFrame& frame, const LeafPoint& leaf,
                  ValueGradientHessian& result) {
  ValueAndGradient first;
  evaluateLeaf(coefficients, frame, leaf, first);
  setFirstDerivatives(result, first);
  result.hessian = polynomialHessian(leafOf(coefficients, leaf.bits), node::degree(leaf.bits), leaf.local);
  toWorldUnits(frame, leaf, result.hessian);
}

/// Returns true if x lies in the domain, and false if x contains NaN. A single combined condition is faster
/// than six branches.
inline bool contains(const GridFrame& domain, const Vector3& x) {
  bool inside = true;
  for (int axis = 0; axis < 3; ++axis)
    inside &= static_cast<int>(x[axis] >= domain.lower[axis]) & static_cast<int>(x[axis] <= domain.upper[axis]);
  return inside;
}

/// Returns the point of the domain that is closest to x. If x contains NaN, the result is some point of the
/// domain.
inline Vector3 closestInDomain(const GridFrame& domain, const Vector3& x) {
  Vector3 closest;
  for (int axis = 0; axis < 3; ++axis)
    closest[axis] = x[axis] > domain.lower[axis] ? std::min(x[axis], domain.upper[axis]) : domain.lower[axis];
  return closest;
}

/// Returns |v|. Avoids squares, which overflow for long vectors and underflow for short ones. The three-argument hypot
/// of GCC 12 would not propagate NaN and infinity.
inline double length(const Vector3& v) { return std::hypot(std::hypot(v.x(), v.y()), v.z()); }

/// Continues the field to a point x outside the domain: adds |x − q| to the field's value at q, the point of the domain
/// closest to x. `offset` is x − q.
inline void continueOutside(const Vector3& offset, double& value) { value += length(offset); }

inline void continueOutside(const Vector3& offset, ValueAndGradient& result) {
  const double distance = length(offset);
  result.value += distance;
  for (int axis = 0; axis < 3; ++axis)
    if (offset[axis] != 0) result.gradient[axis] = 0;  // the closest point does not depend on a clamped coordinate
  result.gradient += offset / distance;
}

inline void continueOutside(const Vector3& offset, ValueGradientHessian& result) {
  ValueAndGradient first = firstDerivatives(result);
  continueOutside(offset, first);
  setFirstDerivatives(result, first);
  const double distance = length(offset);
  const Vector3 direction = offset / distance;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      if (offset[a] != 0 || offset[b] != 0)
        result.hessian(a, b) = ((a == b ? 1 : 0) - direction[a] * direction[b]) / distance;
}

/// Makes the lookup grid of a field, an array of the octree nodes of one depth. Chooses the greatest depth at which the
/// array takes at most a sixteenth of the bytes of the nodes and coefficients, or an eighth if they are quantized, and
/// at most 2^28 bytes.
LookupGrid makeLookupGrid(const FieldData& field);

/// Evaluates a field at many points. On every instruction set, the results are bit for bit equal to those of
/// single queries.
void evaluateBatch(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                   std::span<double> out);
void evaluateBatch(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                   std::span<ValueAndGradient> out);

}  // namespace hpsdf::query
