#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hpsdf/field.h"
#include "view/blend_zone_bounds.h"

namespace hpsdf::render {

/// Bounds of the field within a node, derived from its coefficients by |L_i| ≤ 1, |L_i'| ≤ i(i+1)/2 and
/// |L_i''| ≤ (i−1)i(i+1)(i+2)/8 on [−1, 1]. They let a ray pass a node without an evaluation, and step within a leaf
/// without passing a zero. All but the range [lo, hi] bound the leaf's polynomial, before blending.
struct SurfaceBounds {
  float lo;  ///< least value of the field within the node, blended or not
  float hi;  ///< greatest value of the field within the node, blended or not
  /// Leaves: greatest length of the difference between the polynomial's gradient and that of its linear part, in local
  /// coordinates. Internal nodes: −1.
  float gradientDeviation;
  float valueDeviation;         ///< leaves: greatest difference between the polynomial and its linear part
  float secondDerivative;       ///< leaves: greatest second derivative along any unit vector, in local coordinates
  std::array<float, 4> linear;  ///< leaves: the linear part's coefficients c_100, c_010, c_001 and c_000
};

/// The bounds of all nodes, widened by the rounding errors of single precision. `zones` are those of a blended field.
std::vector<SurfaceBounds> surfaceBounds(const FieldData& field, const std::vector<BlendZoneBounds>& zones = {});

/// The range [lo, hi] in 32 bits: the upper halves of the two floats, that of hi in the high bits, lo rounded down and
/// hi rounded up.
std::uint32_t packOutwards(float lo, float hi);

}  // namespace hpsdf::render
