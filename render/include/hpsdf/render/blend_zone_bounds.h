#pragma once

#include <vector>

#include "hpsdf/field.h"

namespace hpsdf::render {

/// Bounds of the field are widened by this relative rounding error, because devices compute in single precision.
constexpr double kFloatRounding = 4e-6;

/// Bounds of the blended field F within a leaf. F = f + (Σ wₙ dₙ) / (Σ wₙ), where f is the polynomial or
/// exact distance of this leaf, wₙ is the blending weight of leaf n, and dₙ is the function of leaf n minus f. Where a
/// polynomial meets an exact distance, the bound of their difference is an estimate from samples.
struct BlendZoneBounds {
  float valueDifference = 0;     ///< upper bound of |dₙ| where wₙ > 0, and therefore of |F − f|
  float gradientDifference = 0;  ///< upper bound of |∇dₙ| where wₙ > 0, in local coordinates
  /// The shortest distance, in local coordinates, over which any weight within the leaf falls from a half to zero. Over
  /// a step of a quarter of this distance, blending makes F sag below its chord by at most a few hundredths of
  /// `valueDifference`.
  float extent = 0;
};

/// The blend zone bounds of all nodes, widened by the rounding errors of single precision. Empty for a field
/// without blending.
std::vector<BlendZoneBounds> blendZoneBounds(const Field& field);

}  // namespace hpsdf::render
