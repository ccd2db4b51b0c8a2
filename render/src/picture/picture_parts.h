#pragma once
// What pictures of fields and of meshes are put together from.

#include "hpsdf/render/image.h"
#include "picture/legend.h"

namespace hpsdf::render {

/// Of thin lines, pixels.
double lineWidthOf(const Frame& frame);

/// A picture with the backdrop of a view of this height at its top.
Image backdropPicture(int width, int height, int viewHeight);

/// Copies the view into the picture's upper left corner.
void place(Image& picture, const Image& view);

}  // namespace hpsdf::render
