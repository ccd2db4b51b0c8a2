#pragma once
// Lines on which the field has a given value, in a slice.

#include <vector>

#include "hpsdf/render/vector_picture.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Returns the lines on which f = level, in pixels of a slice whose buffers hold samples × samples values for each
/// pixel (marching squares). The lines run between all neighbouring samples of which exactly one is below the level,
/// also where f jumps from cell to cell.
std::vector<Polyline> contourLines(const ViewBuffers& buffers, int samples, double level);

}  // namespace hpsdf::render
