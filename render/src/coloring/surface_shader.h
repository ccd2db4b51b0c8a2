#pragma once
// The light on the surface, boxes and bodies in the picture of a camera.

#include <functional>
#include <span>

#include "hpsdf/render/view.h"
#include "image/color.h"

namespace hpsdf::render {

/// The colour of a sample that shows the surface, a box or a body. `color` returns the colour of a sample by its index;
/// an empty function stands for the materials. The result refers to all arguments except the camera.
std::function<LinearColor(int x, int y)> surfaceShader(const ViewBuffers& buffers, const Camera& camera,
                                                       const std::function<LinearColor(std::size_t)>& color,
                                                       std::span<const LinearColor> bodies);

}  // namespace hpsdf::render
