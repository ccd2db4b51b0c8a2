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

/// The leaf that holds x. Grid coordinates are ((x - lo) / size) · grid in this very order, because a plane through the
/// middle of the domain then lands exactly on the face between two base cells. Points outside and NaN are clamped.
inline Location locate(const FieldData& field, const Vector3& x) {
  Location at;
  const Vector3 lo = field.domain.min();
  const Vector3 size = field.domain.max() - lo;
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = field.grid[axis];
    const double g = std::min(std::max(0.0, ((x[axis] - lo[axis]) / size[axis]) * cells), cells);
    at.base[axis] = std::min(static_cast<std::uint32_t>(g), field.grid[axis] - 1);
    at.fraction[axis] = g - at.base[axis];
  }
  at.node = (at.base[2] * field.grid[1] + at.base[1]) * field.grid[0] + at.base[0];
  at.depth = 0;
  std::uint64_t bits = field.nodes[at.node];
  while (!node::isLeaf(bits)) {
    std::uint32_t child = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double doubled = 2 * at.fraction[axis];
      const std::uint32_t upper = doubled >= 1;
      at.fraction[axis] = doubled - upper;
      at.path[axis] = 2 * at.path[axis] + upper;
      child |= upper << axis;
    }
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
  const Vector3 lo = field.domain.min();
  const Vector3 size = field.domain.max() - lo;
  const std::uint32_t fine = std::uint32_t{1} << directory.depth;
  std::array<double, 3> g;
  std::array<std::uint32_t, 3> at;
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = field.grid[axis];
    g[axis] = std::min(std::max(0.0, ((x[axis] - lo[axis]) / size[axis]) * cells), cells);
    at[axis] = std::min(static_cast<std::uint32_t>(g[axis] * fine), field.grid[axis] * fine - 1);
  }
  const std::size_t row = std::size_t(at[2]) * (field.grid[1] * fine) + at[1];
  FoundLeaf found;
  found.bits = directory.entries[row * (field.grid[0] * fine) + at[0]];
  found.depth = static_cast<int>((found.bits >> 40) & 0xff);
  // scaling by a power of two and taking off the whole part are exact
  const double scale = std::uint32_t{1} << found.depth;
  std::array<double, 3> fraction;
  for (int axis = 0; axis < 3; ++axis) fraction[axis] = g[axis] * scale - (at[axis] >> (directory.depth - found.depth));
  while (!node::isLeaf(found.bits)) {
    std::uint32_t child = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double doubled = 2 * fraction[axis];
      const std::uint32_t upper = doubled >= 1;
      fraction[axis] = doubled - upper;
      child |= upper << axis;
    }
    found.bits = field.nodes[node::firstChild(found.bits) + child];
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

/// f(0) to f(N-1) as straight code, each argument a constant of its own type.
template <int N, typename F>
[[gnu::always_inline]] inline void unrolled(F&& f) {
  [&]<int... I>(std::integer_sequence<int, I...>) __attribute__((always_inline)) {
    (f(std::integral_constant<int, I>()), ...);
  }
  (std::make_integer_sequence<int, N>());
}

/// The polynomial of constant degree P: the operations of the loops below, in their order.
template <int P, typename T>
double evaluateFixed(const T* c, const std::array<double, 3>& local) {
  double x[P + 1], y[P + 1], z[P + 1];
  legendreValues(local[0], P, x);
  legendreValues(local[1], P, y);
  legendreValues(local[2], P, z);
  double value = 0;
  unrolled<P + 1>([&](auto i) __attribute__((always_inline)) {
    double plane = 0;
    unrolled<P - i + 1>([&](auto j) __attribute__((always_inline)) {
      double line = 0;
      unrolled<P - i - j + 1>([&](auto k) __attribute__((always_inline)) { line += double(*c++) * z[k]; });
      plane += line * y[j];
    });
    value += plane * x[i];
  });
  return value;
}

template <int P, typename T>
ValueAndGradient evaluateFixedWithGradient(const T* c, const std::array<double, 3>& local) {
  double x[P + 1], y[P + 1], z[P + 1], dx[P + 1], dy[P + 1], dz[P + 1];
  legendreValuesAndDerivatives(local[0], P, x, dx);
  legendreValuesAndDerivatives(local[1], P, y, dy);
  legendreValuesAndDerivatives(local[2], P, z, dz);
  double value = 0, gx = 0, gy = 0, gz = 0;
  unrolled<P + 1>([&](auto i) __attribute__((always_inline)) {
    double plane = 0, planeDy = 0, planeDz = 0;
    unrolled<P - i + 1>([&](auto j) __attribute__((always_inline)) {
      double line = 0, lineDz = 0;
      unrolled<P - i - j + 1>([&](auto k) __attribute__((always_inline)) {
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

template <typename T>
double evaluateAny(const T* c, int degree, const std::array<double, 3>& local) {
  double x[kMaxDegree + 1], y[kMaxDegree + 1], z[kMaxDegree + 1];
  legendreValues(local[0], degree, x);
  legendreValues(local[1], degree, y);
  legendreValues(local[2], degree, z);
  double value = 0;
  for (int i = 0; i <= degree; ++i) {
    double plane = 0;
    for (int j = 0; j <= degree - i; ++j) {
      const int length = degree - i - j + 1;
      double line = 0;
      for (int k = 0; k < length; ++k) line += double(c[k]) * z[k];
      c += length;
      plane += line * y[j];
    }
    value += plane * x[i];
  }
  return value;
}

template <typename T>
ValueAndGradient evaluateAnyWithGradient(const T* c, int degree, const std::array<double, 3>& local) {
  double x[kMaxDegree + 1], y[kMaxDegree + 1], z[kMaxDegree + 1];
  double dx[kMaxDegree + 1], dy[kMaxDegree + 1], dz[kMaxDegree + 1];
  legendreValuesAndDerivatives(local[0], degree, x, dx);
  legendreValuesAndDerivatives(local[1], degree, y, dy);
  legendreValuesAndDerivatives(local[2], degree, z, dz);
  double value = 0, gx = 0, gy = 0, gz = 0;
  for (int i = 0; i <= degree; ++i) {
    double plane = 0, planeDy = 0, planeDz = 0;
    for (int j = 0; j <= degree - i; ++j) {
      const int length = degree - i - j + 1;
      double line = 0, lineDz = 0;
      for (int k = 0; k < length; ++k) {
        line += double(c[k]) * z[k];
        lineDz += double(c[k]) * dz[k];
      }
      c += length;
      plane += line * y[j];
      planeDy += line * dy[j];
      planeDz += lineDz * y[j];
    }
    value += plane * x[i];
    gx += plane * dx[i];
    gy += planeDy * x[i];
    gz += planeDz * x[i];
  }
  return {value, {gx, gy, gz}};
}

/// The polynomial at local coordinates in [-1, 1]³.
template <typename T>
double evaluate(const T* c, int degree, const std::array<double, 3>& local) {
  switch (degree) {  // the common ones
    case 2:
      return evaluateFixed<2>(c, local);
    case 3:
      return evaluateFixed<3>(c, local);
    case 4:
      return evaluateFixed<4>(c, local);
    default:
      return evaluateAny(c, degree, local);
  }
}

/// Also the gradient with respect to the local coordinates.
template <typename T>
ValueAndGradient evaluateWithGradient(const T* c, int degree, const std::array<double, 3>& local) {
  switch (degree) {
    case 2:
      return evaluateFixedWithGradient<2>(c, local);
    case 3:
      return evaluateFixedWithGradient<3>(c, local);
    case 4:
      return evaluateFixedWithGradient<4>(c, local);
    default:
      return evaluateAnyWithGradient(c, degree, local);
  }
}

}  // namespace hpsdf
