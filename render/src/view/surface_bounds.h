#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/blend_zone_bounds.h"

namespace hpsdf::render {

/// Stands for the second derivatives of exact leaves, which are unbounded: so great that no step relies on them.
constexpr float kExactCurve = 1e30F;

/// Bounds of the field within a node. With them, a ray can skip a node without an evaluation of the field, and step
/// within a leaf without missing a root. All bounds except the range [lo, hi] are for the leaf's polynomial, before
/// blending. They follow from the coefficients and from bounds of the Legendre polynomials L_i on [−1, 1]: |L_i| ≤ 1,
/// |L_i'| ≤ i(i+1)/2 and |L_i''| ≤ (i−1)i(i+1)(i+2)/8. In an exact leaf, whose distance changes by at most the length
/// of the way, the linear part is the value at the centre alone.
struct SurfaceBounds {
  float lo;  ///< lower bound of the field within the node, including any blending
  float hi;  ///< upper bound of the field within the node, including any blending
  /// In leaves: upper bound of |∇(polynomial − its linear part)| in local coordinates. In internal nodes: −1.
  float gradientDeviation;
  float valueDeviation;         ///< leaves: upper bound of |polynomial − its linear part|
  float secondDerivative;       ///< leaves: upper bound of second derivatives along unit vectors, in local coordinates
  std::array<float, 4> linear;  ///< leaves: the linear part's coefficients c_100, c_010, c_001 and c_000
};

/// The bounds of all nodes, widened by the rounding errors of single precision. `zones` are the blend zone
/// bounds of a blended field.
std::vector<SurfaceBounds> surfaceBounds(const FieldData& field, const std::vector<BlendZoneBounds>& zones = {});

/// Packs the range [lo, hi] into 32 bits. The high bits are the upper half of the float hi, rounded up. The low
/// bits are the upper half of the float lo, rounded down.
std::uint32_t packOutwards(float lo, float hi);

}  // namespace hpsdf::render
