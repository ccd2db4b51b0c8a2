#pragma once

#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// The share of each pixel, 0 to 1, that lines of `lineWidth` pixels along the edges of cells cover. Lines behind the
/// objects in the buffers are hidden. Lines fade with their distance, and vanish if their cells are small in the
/// picture. A clipping plane cuts cells.
std::vector<float> cellLines(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells,
                             const ViewBuffers& buffers, double lineWidth);

}  // namespace hpsdf::render
