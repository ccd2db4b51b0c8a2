#pragma once

#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// The edges of a drawn box in parts of those of its cell: below 1, so that the camera sees between boxes.
constexpr double kBoxShare = 0.8;

/// Shows each cell as a solid box about its centre where it is the nearest thing to the eye: the face that a pixel's
/// ray enters, with f there and the outward normal. A clipping plane cuts boxes; a box that contains the eye is left
/// out.
void addBoxes(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells, ViewBuffers& buffers);

}  // namespace hpsdf::render
