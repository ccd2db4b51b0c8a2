#pragma once

#include <vector>

#include "hpsdf/field.h"

namespace hpsdf::render {

/// Relative rounding error that bounds of the field allow for on devices that compute in single precision.
constexpr double kFloatRounding = 4e-6;

/// Bounds of the blending within a leaf. The field there is F = f + Σ wₙ dₙ / Σ wₙ, where f is the leaf's polynomial
/// and dₙ the difference to f of the polynomial of another leaf whose weight wₙ extends into this leaf.
struct BlendZoneBounds {
  float valueDifference = 0;     ///< greatest |dₙ| where wₙ > 0, and so greatest |F − f|
  float gradientDifference = 0;  ///< greatest |∇dₙ| where wₙ > 0, in local coordinates
  /// The shortest distance over which any weight within the leaf falls from a half to zero, in local coordinates. Over
  /// a step of a quarter of it, F sags below its chord by at most a few hundredths of `valueDifference`.
  float extent = 0;
};

/// The bounds of all nodes, widened by the rounding errors of single precision; empty for a field without blending.
std::vector<BlendZoneBounds> blendZoneBounds(const Field& field);

}  // namespace hpsdf::render
