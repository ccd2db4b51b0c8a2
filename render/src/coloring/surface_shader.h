#pragma once
// The lighting of the surface, of cell boxes and of bodies in a camera's picture.

#include <functional>
#include <span>

#include "hpsdf/render/view.h"
#include "image/color.h"

namespace hpsdf::render {

/// Returns a function that computes the lit colour of sample (x, y), which must show the surface, a box or a body.
/// `color` returns the unlit colour of a sample, given the sample's index. If `color` is empty, the surface and boxes
/// have plain materials. The returned function keeps references to all arguments except the camera.
std::function<LinearColor(int x, int y)> surfaceShader(const ViewBuffers& buffers, const Camera& camera,
                                                       const std::function<LinearColor(std::size_t)>& color,
                                                       std::span<const LinearColor> bodies);

}  // namespace hpsdf::render
