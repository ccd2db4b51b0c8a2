#pragma once
// Descent to a leaf and evaluation of its polynomial: what every query shares.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "basis/legendre.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/detail/lookup_grid.h"

namespace hpsdf {

/// A point of the domain in units of base cells.
struct GridPoint {
  std::array<double, 3> coordinates;
  std::array<std::int64_t, 3> fixed;  ///< the same with kMaxDepth binary digits after the point
  std::uint64_t path;                 ///< those digits, 21 bits an axis: they name the children on its way down

  /// The cell of a depth that holds it, in units of such cells.
  std::int64_t cell(int axis, int depth) const { return fixed[axis] >> (kMaxDepth - depth); }
};

/// The number of the cell of a depth on a point's way, among its parent's children.
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
    frame.last[axis] = (std::int64_t{field.grid[axis]} << kMaxDepth) - 1;
  }
  return frame;
}

/// `GridPoint::path` of these numbers along one axis.
inline std::uint64_t pathAlong(int axis, std::int64_t fixed) {
  return static_cast<std::uint64_t>(fixed & ((std::int64_t{1} << kMaxDepth) - 1)) << (21 * axis);
}

/// Coordinates are ((x - lo) / size) · grid in this very order, because a plane through the middle of the domain then
/// lands exactly on the face between two base cells.
inline GridPoint gridPoint(const GridFrame& frame, const Vector3& x) {
  constexpr auto kOne = std::int64_t{1} << kMaxDepth;
  GridPoint at;
  at.path = 0;
  for (int axis = 0; axis < 3; ++axis) {
    at.coordinates[axis] = ((x[axis] - frame.lower[axis]) / frame.size[axis]) * frame.cells[axis];
    at.fixed[axis] = std::min(static_cast<std::int64_t>(at.coordinates[axis] * kOne), frame.last[axis]);
    at.path |= pathAlong(axis, at.fixed[axis]);
  }
  return at;
}

/// The way back from grid coordinates.
inline Vector3 worldPoint(const GridFrame& frame, const std::array<double, 3>& coordinates) {
  Vector3 x;
  for (int axis = 0; axis < 3; ++axis)
    x[axis] = frame.lower[axis] + coordinates[axis] / frame.cells[axis] * frame.size[axis];
  return x;
}

/// Of a cell of a depth, by its place in such cells.
inline Box boxOf(const GridFrame& frame, int depth, const std::array<std::int64_t, 3>& place) {
  std::array<double, 3> lower, upper;
  for (int axis = 0; axis < 3; ++axis) {
    lower[axis] = std::ldexp(static_cast<double>(place[axis]), -depth);
    upper[axis] = std::ldexp(static_cast<double>(place[axis] + 1), -depth);
  }
  return Box(worldPoint(frame, lower), worldPoint(frame, upper));
}

/// The leaf that holds a point.
struct Location {
  std::uint32_t node;
  int depth;
};

inline Location locate(const FieldData& field, const GridPoint& x) {
  Location at{static_cast<std::uint32_t>((x.cell(2, 0) * field.grid[1] + x.cell(1, 0)) * field.grid[0] + x.cell(0, 0)),
              0};
  while (!node::isLeaf(field.nodes[at.node]))
    at.node = node::firstChild(field.nodes[at.node]) + childOnPath(x.path, ++at.depth);
  return at;
}

/// A leaf as queries need it.
struct FoundLeaf {
  std::uint64_t bits;  ///< of its node
  int depth;
  std::array<double, 3> local;        ///< in [-1, 1]
  std::array<std::int64_t, 3> place;  ///< in cells of its depth, counted from the domain's lower corner
  std::size_t number;  ///< its node's or, where the lookup grid names it, that of all nodes + its entry's
};

/// A leaf for a point in grid coordinates.
inline FoundLeaf leafWithin(std::uint64_t bits, int depth, std::size_t number, const std::array<std::int64_t, 3>& place,
                            const std::array<double, 3>& coordinates) {
  FoundLeaf leaf{bits, depth, {}, place, number};
  // scaling by a power of two and taking off the whole part are exact
  const double scale = std::uint32_t{1} << depth;
  for (int axis = 0; axis < 3; ++axis)
    leaf.local[axis] = 2 * (coordinates[axis] * scale - static_cast<double>(place[axis])) - 1;
  return leaf;
}

/// The same leaf as `locate` finds, by the lookup grid.
inline FoundLeaf find(const FieldData& field, const LookupGrid& lookupGrid, const GridPoint& at) {
  const int top = lookupGrid.depth;
  const std::int64_t entry = at.cell(2, top) * lookupGrid.slab + at.cell(1, top) * lookupGrid.row + at.cell(0, top);
  std::uint64_t bits = lookupGrid.entries[entry];
  int depth = LookupGrid::depthOf(bits);
  std::size_t number = field.nodes.size() + entry;
  while (!node::isLeaf(bits)) {
    number = node::firstChild(bits) + childOnPath(at.path, ++depth);
    bits = field.nodes[number];
  }
  return leafWithin(bits, depth, number, {at.cell(0, depth), at.cell(1, depth), at.cell(2, depth)}, at.coordinates);
}

/// Edge lengths of a cell of the given depth.
inline Vector3 cellSize(const FieldData& field, int depth) {
  const Vector3 size = field.domain.max() - field.domain.min();
  const double scale = std::ldexp(1.0, -depth);
  return {size.x() / field.grid[0] * scale, size.y() / field.grid[1] * scale, size.z() / field.grid[2] * scale};
}

// A degree that is known when compiling is a type, `Constant<P>`, with which the loops below become straight code; one
// that is not is an int.
template <int P>
using Constant = std::integral_constant<int, P>;

constexpr int minus(int a, int b) { return a - b; }
template <int A, int B>
constexpr Constant<A - B> minus(Constant<A>, Constant<B>) {
  return {};
}

/// Room for a number a degree up to this one.
template <typename Degree>
constexpr int kRoom = kMaxDegree + 1;
template <int P>
constexpr int kRoom<Constant<P>> = P + 1;

#include "field/query/polynomial-inl.h"

/// f(degree), the common degrees as constants.
template <typename F>
auto withDegree(int degree, const F& f) {
  switch (degree) {
    case 2:
      return f(Constant<2>());
    case 3:
      return f(Constant<3>());
    case 4:
      return f(Constant<4>());
    default:
      return f(degree);
  }
}

/// The polynomial at local coordinates in [-1, 1]³.
template <typename T>
double evaluate(const T* c, int degree, const std::array<double, 3>& local) {
  return withDegree(degree, [&](auto known) { return evaluateAt(c, known, local); });
}

/// Also the gradient with respect to the local coordinates.
template <typename T>
ValueAndGradient evaluateWithGradient(const T* c, int degree, const std::array<double, 3>& local) {
  const auto [value, x, y, z] = withDegree(degree, [&](auto known) { return evaluateWithGradientAt(c, known, local); });
  return {value, {x, y, z}};
}

/// As one condition: six branches would cost more than the comparisons. NaN is not within.
inline bool contains(const GridFrame& domain, const Vector3& x) {
  bool within = true;
  for (int axis = 0; axis < 3; ++axis)
    within &= static_cast<int>(x[axis] >= domain.lower[axis]) & static_cast<int>(x[axis] <= domain.upper[axis]);
  return within;
}

/// The closest point of the domain; for NaN some point.
inline Vector3 closestWithin(const GridFrame& domain, const Vector3& x) {
  Vector3 closest;
  for (int axis = 0; axis < 3; ++axis)
    closest[axis] = x[axis] > domain.lower[axis] ? std::min(x[axis], domain.upper[axis]) : domain.lower[axis];
  return closest;
}

/// Without squares, which overflow or vanish far from the domain or very close to it. (The hypot of three arguments
/// of GCC 12 loses NaN and infinity.)
inline double length(const Vector3& v) { return std::hypot(std::hypot(v.x(), v.y()), v.z()); }

/// From f(q) at the closest point q of the domain to f(q) + |x - q|; `beyond` is x - q.
inline void extend(const Vector3& beyond, double& value) { value += length(beyond); }

inline void extend(const Vector3& beyond, ValueAndGradient& result) {
  const double distance = length(beyond);
  result.value += distance;
  for (int axis = 0; axis < 3; ++axis)
    if (beyond[axis] != 0) result.gradient[axis] = 0;  // along an axis on which x is clamped, f(q) does not change
  result.gradient += beyond / distance;
}

template <typename T>
void answer(const T* coefficients, const GridFrame&, const FoundLeaf& leaf, double& value) {
  value = evaluate(coefficients + node::offset(leaf.bits), node::degree(leaf.bits), leaf.local);
}

template <typename T>
void answer(const T* coefficients, const GridFrame& frame, const FoundLeaf& leaf, ValueAndGradient& result) {
  result = evaluateWithGradient(coefficients + node::offset(leaf.bits), node::degree(leaf.bits), leaf.local);
  const double scale = 2.0 * (std::uint32_t{1} << leaf.depth);
  for (int axis = 0; axis < 3; ++axis) result.gradient[axis] *= scale * frame.cells[axis] / frame.size[axis];
}

}  // namespace hpsdf
