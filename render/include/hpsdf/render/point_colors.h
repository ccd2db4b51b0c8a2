#pragma once
// Colours of points of a field, such as the vertices of its contour, as pictures show them.

#include <span>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/picture_settings.h"

namespace hpsdf::render {

/// A colour for each point, and the scale by which the colours were chosen.
struct PointColors {
  std::vector<Color> colors;
  /// The given options with the chosen limits or levels. Points and pictures with equal scales have equal colours.
  ScaleOptions scale;
};

/// Returns the colours of points by degree, depth or a quantity, in the colours of pictures: those of the cells that
/// hold the points, or of the quantity at the points. Limits that are not given are chosen as for a picture, in which
/// the points take the place of the samples. `reference` holds what the quantity needs; it must be the data of `field`.
///
/// Throws `Error` for `ColorBy::normal` and `ColorBy::distance`, if the quantity's reference data is missing, and if
/// the limits of the scale are invalid.
PointColors pointColors(const Field& field, std::span<const Vector3> points, ColorBy color,
                        const ScaleOptions& options = {}, const ReferenceData& reference = {});

}  // namespace hpsdf::render
