#pragma once
// The quantities that colours stand for, at the samples of a view.

#include <functional>
#include <vector>

#include "hpsdf/render/picture_settings.h"
#include "image/colormap.h"

namespace hpsdf::render {

/// Throws `Error` if the reference data that the colour needs is missing.
void requireReferenceData(ColorBy color, const ReferenceData& reference);

/// The values of a quantity that belongs to whole cells, by `Cell::id`; empty for other quantities.
std::vector<double> quantityOfCells(const Field& field, ColorBy quantity, const ReferenceData& reference);

/// The quantity at each sample of the buffers; NaN where a sample does not show the field. `pointAt(x, y)` returns the
/// point of a sample; `ofCells` is the result of `quantityOfCells`.
std::vector<float> quantityOfSamples(const Field& field, const ViewBuffers& buffers,
                                     const std::function<Vector3(int, int)>& pointAt, ColorBy quantity,
                                     const ReferenceData& reference, const std::vector<double>& ofCells);

/// The scale with the limits of the options, or with limits chosen from `ofCells` if there are any, else from
/// `ofSamples`. Throws `Error` for limits that make no scale.
ColorScale colorScale(const ScaleOptions& options, const Field& field, const std::vector<double>& ofCells,
                      const std::vector<float>& ofSamples);

}  // namespace hpsdf::render
