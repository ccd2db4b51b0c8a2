#pragma once
// Descent to a leaf and evaluation of its polynomial: what every query shares.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "basis/legendre.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// A point of the domain in units of base cells.
struct GridPoint {
  std::array<double, 3> coordinates;
  std::array<std::int64_t, 3> fixed;  ///< the same with kMaxDepth binary digits after the point
  std::uint64_t way;                  ///< those digits, 21 bits an axis: they name the children on its way down

  /// The cell of a depth that holds it, in units of such cells.
  std::int64_t cell(int axis, int depth) const { return fixed[axis] >> (kMaxDepth - depth); }

  /// The number of that cell among its parent's children.
  std::uint32_t child(int depth) const {
    const std::uint64_t bits = (way >> (kMaxDepth - depth)) & (1 | std::uint64_t{1} << 21 | std::uint64_t{1} << 42);
    return static_cast<std::uint32_t>(bits | bits >> 20 | bits >> 40) & 7;
  }
};

/// Coordinates are ((x - lo) / size) · grid in this very order, because a plane through the middle of the domain then
/// lands exactly on the face between two base cells.
inline GridPoint gridPoint(const GridFrame& frame, const Vector3& x) {
  constexpr auto kOne = std::int64_t{1} << kMaxDepth;
  GridPoint at;
  at.way = 0;
  for (int axis = 0; axis < 3; ++axis) {
    at.coordinates[axis] = ((x[axis] - frame.lower[axis]) / frame.size[axis]) * frame.cells[axis];
    at.fixed[axis] = std::min(static_cast<std::int64_t>(at.coordinates[axis] * kOne), frame.last[axis]);
    at.way |= static_cast<std::uint64_t>(at.fixed[axis] & (kOne - 1)) << (21 * axis);
  }
  return at;
}

/// The leaf that holds a point.
struct Location {
  std::uint32_t node;
  int depth;
};

inline Location locate(const FieldData& field, const GridPoint& x) {
  Location at{static_cast<std::uint32_t>((x.cell(2, 0) * field.grid[1] + x.cell(1, 0)) * field.grid[0] + x.cell(0, 0)),
              0};
  while (!node::isLeaf(field.nodes[at.node])) at.node = node::firstChild(field.nodes[at.node]) + x.child(++at.depth);
  return at;
}

/// A leaf as queries need it.
struct FoundLeaf {
  std::uint64_t bits;  ///< of its node
  int depth;
  std::array<double, 3> local;  ///< in [-1, 1]
};

/// The same leaf as `locate` finds, by the directory. x lies in the domain.
inline FoundLeaf find(const FieldData& field, const Directory& directory, const Vector3& x) {
  const GridPoint at = gridPoint(directory.frame, x);
  const int top = directory.depth;
  FoundLeaf found;
  found.bits = directory.entries[at.cell(2, top) * directory.slab + at.cell(1, top) * directory.row + at.cell(0, top)];
  found.depth = Directory::depthOf(found.bits);
  while (!node::isLeaf(found.bits)) found.bits = field.nodes[node::firstChild(found.bits) + at.child(++found.depth)];
  // scaling by a power of two and taking off the whole part are exact
  const double scale = 1 << found.depth;
  for (int axis = 0; axis < 3; ++axis)
    found.local[axis] = 2 * (at.coordinates[axis] * scale - static_cast<double>(at.cell(axis, found.depth))) - 1;
  return found;
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

/// Calls f(0) to f(last).
template <typename F>
[[gnu::always_inline]] inline void upTo(int last, F&& f) {
  for (int i = 0; i <= last; ++i) f(i);
}
template <int Last, typename F>
[[gnu::always_inline]] inline void upTo(Constant<Last>, F&& f) {
  [&]<int... I>(std::integer_sequence<int, I...>) __attribute__((always_inline)) { (f(Constant<I>()), ...); }
  (std::make_integer_sequence<int, Last + 1>());
}

/// Room for a number a degree up to this one.
template <typename Degree>
constexpr int kRoom = kMaxDegree + 1;
template <int P>
constexpr int kRoom<Constant<P>> = P + 1;

template <typename T, typename Degree>
double evaluateAt(const T* c, Degree degree, const std::array<double, 3>& local) {
  double x[kRoom<Degree>], y[kRoom<Degree>], z[kRoom<Degree>];
  legendreValues(local[0], degree, x);
  legendreValues(local[1], degree, y);
  legendreValues(local[2], degree, z);
  double value = 0;
  upTo(
      degree, [&](auto i) __attribute__((always_inline)) {
        double plane = 0;
        upTo(
            minus(degree, i), [&](auto j) __attribute__((always_inline)) {
              double line = 0;
              upTo(
                  minus(minus(degree, i), j), [&](auto k)
                                                  __attribute__((always_inline)) { line += double(*c++) * z[k]; });
              plane += line * y[j];
            });
        value += plane * x[i];
      });
  return value;
}

template <typename T, typename Degree>
ValueAndGradient evaluateWithGradientAt(const T* c, Degree degree, const std::array<double, 3>& local) {
  double x[kRoom<Degree>], y[kRoom<Degree>], z[kRoom<Degree>];
  double dx[kRoom<Degree>], dy[kRoom<Degree>], dz[kRoom<Degree>];
  legendreValuesAndDerivatives(local[0], degree, x, dx);
  legendreValuesAndDerivatives(local[1], degree, y, dy);
  legendreValuesAndDerivatives(local[2], degree, z, dz);
  double value = 0, gx = 0, gy = 0, gz = 0;
  upTo(
      degree, [&](auto i) __attribute__((always_inline)) {
        double plane = 0, planeDy = 0, planeDz = 0;
        upTo(
            minus(degree, i), [&](auto j) __attribute__((always_inline)) {
              double line = 0, lineDz = 0;
              upTo(
                  minus(minus(degree, i), j), [&](auto k) __attribute__((always_inline)) {
                    const double coefficient = *c++;
                    line += coefficient * z[k];
                    lineDz += coefficient * dz[k];
                  });
              plane += line * y[j];
              planeDy += line * dy[j];
              planeDz += lineDz * y[j];
            });
        value += plane * x[i];
        gx += plane * dx[i];
        gy += planeDy * x[i];
        gz += planeDz * x[i];
      });
  return {value, {gx, gy, gz}};
}

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
  return withDegree(degree, [&](auto known) { return evaluateWithGradientAt(c, known, local); });
}

}  // namespace hpsdf
