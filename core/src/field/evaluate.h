#pragma once
// Descent to a leaf and evaluation of its polynomial: what every query shares.

#include <algorithm>
#include <cmath>
#include <cstdint>

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

/// Edge lengths of a cell of the given depth.
inline Vector3 cellSize(const FieldData& field, int depth) {
  const Vector3 size = field.domain.max() - field.domain.min();
  const double scale = std::ldexp(1.0, -depth);
  return {size.x() / field.grid[0] * scale, size.y() / field.grid[1] * scale, size.z() / field.grid[2] * scale};
}

/// The polynomial at local coordinates in [-1, 1]³.
template <typename T>
double evaluate(const T* c, int degree, const std::array<double, 3>& local) {
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

/// Also the gradient with respect to the local coordinates.
template <typename T>
ValueAndGradient evaluateWithGradient(const T* c, int degree, const std::array<double, 3>& local) {
  double x[kMaxDegree + 1], y[kMaxDegree + 1], z[kMaxDegree + 1];
  double dx[kMaxDegree + 1], dy[kMaxDegree + 1], dz[kMaxDegree + 1];
  legendreValuesAndDerivatives(local[0], degree, x, dx);
  legendreValuesAndDerivatives(local[1], degree, y, dy);
  legendreValuesAndDerivatives(local[2], degree, z, dz);
  ValueAndGradient result{0, Vector3::Zero()};
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
    result.value += plane * x[i];
    result.gradient += Vector3(plane * dx[i], planeDy * x[i], planeDz * x[i]);
  }
  return result;
}

}  // namespace hpsdf
