#pragma once
// The quantities that the colours of a picture show, evaluated at the samples of a view.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "hpsdf/render/picture_settings.h"
#include "image/colormap.h"

namespace hpsdf::render {

/// The titles of a colour's legend, from the longest to the shortest. The first one that fits stands above the legend,
/// the last one is for captions.
std::span<const std::string> titlesOf(ColorBy color);

/// Throws `Error` if `reference` lacks the data that colouring by `color` needs.
void requireReferenceData(ColorBy color, const ReferenceData& reference);

/// The values of a quantity that is constant in each cell, indexed by `Cell::id`. Empty for any other quantity.
std::vector<double> quantityOfCells(const Field& field, ColorBy quantity, const ReferenceData& reference);

/// The value of the quantity at each sample of the buffers. It is NaN if the sample does not show the field.
/// `pointAt(x, y)` returns the point of a sample. `ofCells` is the result of `quantityOfCells`.
std::vector<float> quantityOfSamples(const Field& field, const ViewBuffers& buffers,
                                     const std::function<Vector3(int, int)>& pointAt, ColorBy quantity,
                                     const ReferenceData& reference, const std::vector<double>& ofCells);

/// The value of the quantity at each point. `ofCells` is the result of `quantityOfCells`.
std::vector<float> quantityOfPoints(const Field& field, std::span<const Vector3> points, ColorBy quantity,
                                    const ReferenceData& reference, const std::vector<double>& ofCells);

/// The colour scale for a quantity. If the options set no limits, the limits are chosen from `ofCells`, or from
/// `ofSamples` if `ofCells` is empty. Throws `Error` if the limits make no valid scale.
ColorScale colorScale(const ScaleOptions& options, const Field& field, const std::vector<double>& ofCells,
                      const std::vector<float>& ofSamples);

}  // namespace hpsdf::render
