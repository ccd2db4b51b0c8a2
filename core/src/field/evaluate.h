#pragma once
// Descent to a leaf and evaluation of its polynomial: what every query shares.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "basis/legendre.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// A point on its way down the octree.
struct Location {
  std::uint32_t node;  ///< index of the leaf's node
  int depth;
  std::array<std::uint32_t, 3> base;    ///< base cell
  std::array<double, 3> fraction;       ///< within the cell, in [0, 1]
  std::array<std::uint32_t, 3> path{};  ///< the cell's place within its base cell: `depth` bits an axis
};

/// Grid coordinates are ((x - lo) / size) · grid in this very order, because a plane through the middle of the domain
/// then lands exactly on the face between two base cells. Points outside and NaN are clamped.
inline std::array<double, 3> gridCoordinates(const FieldData& field, const Vector3& x) {
  const Vector3 lo = field.domain.min();
  const Vector3 size = field.domain.max() - lo;
  std::array<double, 3> g;
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = field.grid[axis];
    g[axis] = std::min(std::max(0.0, ((x[axis] - lo[axis]) / size[axis]) * cells), cells);
  }
  return g;
}

/// The number of the child that holds the point; `fraction` becomes its place within that child.
inline std::uint32_t enterChild(std::array<double, 3>& fraction) {
  std::uint32_t child = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double doubled = 2 * fraction[axis];
    const std::uint32_t upper = doubled >= 1;
    fraction[axis] = doubled - upper;
    child |= upper << axis;
  }
  return child;
}

/// The leaf that holds x.
inline Location locate(const FieldData& field, const Vector3& x) {
  Location at;
  const std::array<double, 3> g = gridCoordinates(field, x);
  for (int axis = 0; axis < 3; ++axis) {
    at.base[axis] = std::min(static_cast<std::uint32_t>(g[axis]), field.grid[axis] - 1);
    at.fraction[axis] = g[axis] - at.base[axis];
  }
  at.node = (at.base[2] * field.grid[1] + at.base[1]) * field.grid[0] + at.base[0];
  at.depth = 0;
  std::uint64_t bits = field.nodes[at.node];
  while (!node::isLeaf(bits)) {
    const std::uint32_t child = enterChild(at.fraction);
    for (int axis = 0; axis < 3; ++axis) at.path[axis] = 2 * at.path[axis] + (child >> axis & 1);
    at.node = node::firstChild(bits) + child;
    ++at.depth;
    bits = field.nodes[at.node];
  }
  return at;
}

/// A leaf as queries need it.
struct FoundLeaf {
  std::uint64_t bits;  ///< of its node
  int depth;
  std::array<double, 3> local;  ///< in [-1, 1]
};

/// The same leaf as `locate` finds, by the directory.
inline FoundLeaf find(const FieldData& field, const Directory& directory, const Vector3& x) {
  const std::array<double, 3> g = gridCoordinates(field, x);
  const std::uint32_t fine = std::uint32_t{1} << directory.depth;
  std::array<std::uint32_t, 3> at;
  for (int axis = 0; axis < 3; ++axis)
    at[axis] = std::min(static_cast<std::uint32_t>(g[axis] * fine), field.grid[axis] * fine - 1);
  const std::size_t row = std::size_t(at[2]) * (field.grid[1] * fine) + at[1];
  FoundLeaf found;
  found.bits = directory.entries[row * (field.grid[0] * fine) + at[0]];
  found.depth = Directory::depthOf(found.bits);
  // scaling by a power of two and taking off the whole part are exact
  const double scale = std::uint32_t{1} << found.depth;
  std::array<double, 3> fraction;
  for (int axis = 0; axis < 3; ++axis) fraction[axis] = g[axis] * scale - (at[axis] >> (directory.depth - found.depth));
  while (!node::isLeaf(found.bits)) {
    found.bits = field.nodes[node::firstChild(found.bits) + enterChild(fraction)];
    ++found.depth;
  }
  for (int axis = 0; axis < 3; ++axis) found.local[axis] = 2 * fraction[axis] - 1;
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

/// The polynomial at local coordinates in [-1, 1]³.
template <typename T>
double evaluate(const T* c, int degree, const std::array<double, 3>& local) {
  switch (degree) {  // the common ones
    case 2:
      return evaluateAt(c, Constant<2>(), local);
    case 3:
      return evaluateAt(c, Constant<3>(), local);
    case 4:
      return evaluateAt(c, Constant<4>(), local);
    default:
      return evaluateAt(c, degree, local);
  }
}

/// Also the gradient with respect to the local coordinates.
template <typename T>
ValueAndGradient evaluateWithGradient(const T* c, int degree, const std::array<double, 3>& local) {
  switch (degree) {
    case 2:
      return evaluateWithGradientAt(c, Constant<2>(), local);
    case 3:
      return evaluateWithGradientAt(c, Constant<3>(), local);
    case 4:
      return evaluateWithGradientAt(c, Constant<4>(), local);
    default:
      return evaluateWithGradientAt(c, degree, local);
  }
}

}  // namespace hpsdf
