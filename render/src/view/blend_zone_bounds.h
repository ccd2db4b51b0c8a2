#pragma once

#include <vector>

#include "hpsdf/field.h"

namespace hpsdf::render {

/// The relative rounding error that bounds of the field allow for, because devices compute in single precision.
constexpr double kFloatRounding = 4e-6;

/// Bounds of the blending within a leaf. The field there is F = f + Σ wₙ dₙ / Σ wₙ, where f is the polynomial
/// of the leaf. For another leaf n whose weight wₙ extends into this leaf, dₙ is the polynomial of leaf n minus
/// f.
struct BlendZoneBounds {
  float valueDifference = 0;     ///< greatest |dₙ| where wₙ > 0, and so greatest |F − f|
  float gradientDifference = 0;  ///< greatest |∇dₙ| where wₙ > 0, in local coordinates
  /// The shortest distance, in local coordinates, over which any weight within the leaf falls from a half to
  /// zero. Over a step of a quarter of this distance, F sags below its chord by at most a few hundredths of
  /// `valueDifference`.
  float extent = 0;
};

/// The blend zone bounds of all nodes, widened by the rounding errors of single precision. Empty for a field
/// without blending.
std::vector<BlendZoneBounds> blendZoneBounds(const Field& field);

}  // namespace hpsdf::render
