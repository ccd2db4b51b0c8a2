#pragma once

#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// The coverage, 0 to 1, of each pixel of the buffers by the cells' edges, drawn as lines of `lineWidth` pixels.
/// Lines are hidden behind what the buffers show. They fade with their distance, and vanish where their cells are
/// small in the picture. A clipping plane cuts cells.
std::vector<float> cellLines(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells,
                             const ViewBuffers& buffers, double lineWidth);

}  // namespace hpsdf::render
