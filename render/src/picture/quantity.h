#pragma once
// Quantities that colours stand for, at the points of a view.

#include <functional>
#include <vector>

#include "hpsdf/render/picture.h"
#include "image/colormap.h"

namespace hpsdf::render {

/// Throws `Error` when the reference data that the colour needs is missing.
void requireReferenceData(ColorBy color, const ReferenceData& reference);

/// By `Cell::id`, for quantities that belong to a whole cell; empty for the others.
std::vector<double> quantityOfCells(const Field& field, ColorBy quantity, const ReferenceData& reference);

/// At each sample of the buffers; NaN where there is nothing. `pointAt(x, y)` is the sample's point; `ofCells` as
/// above.
std::vector<float> quantityOfSamples(const Field& field, const ViewBuffers& buffers,
                                     const std::function<Vector3(int, int)>& pointAt, ColorBy quantity,
                                     const ReferenceData& reference, const std::vector<double>& ofCells);

/// As asked, or chosen from the values of the field's cells, or, where those are empty, from those of samples. Throws
/// `Error` for limits that make no scale.
ColorScale colorScale(const ScaleOptions& options, const Field& field, const std::vector<double>& ofCells,
                      const std::vector<float>& ofSamples);

}  // namespace hpsdf::render
