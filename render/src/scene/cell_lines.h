#pragma once

#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Draws lines along the edges of cells. Returns the share of each pixel, 0 to 1, that the lines cover. `lineWidth` is
/// in pixels. Lines behind the objects in the buffers are hidden. Lines fade with their distance, and vanish if their
/// cells are small in the picture. The clipping plane of the view cuts cells. `hiddenStrength` is the share of
/// their opacity that lines keep where something hides them.
std::vector<float> cellLines(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells,
                             const ViewBuffers& buffers, double lineWidth, float hiddenStrength);

}  // namespace hpsdf::render
