#pragma once
// What pictures of fields and of meshes are put together from.

#include "hpsdf/render/image.h"
#include "legend.h"

namespace hpsdf::render {

/// Throws `Error` for a size or sample count out of range: 16 to 16384 pixels, 1 to 8, no more than 64 Mi samples in
/// all.
void checkPictureSize(int width, int height, int samples);

/// Of thin lines, pixels.
double lineWidthOf(const Frame& frame);

/// A picture with the backdrop of a view of this height at its top.
Image backdropPicture(int width, int height, int viewHeight);

/// Copies the view into the picture's upper left corner.
void place(Image& picture, const Image& view);

}  // namespace hpsdf::render
