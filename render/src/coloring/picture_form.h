#pragma once
// The form in which pictures are finished: how large their pixels are, and whether they have a background.

#include <cmath>
#include <optional>
#include <vector>

#include "coloring/color_view.h"
#include "hpsdf/render/picture_settings.h"
#include "hpsdf/render/vector_picture.h"

namespace hpsdf::render {

/// Throws `Error` if the size of a picture is out of range (`checkPictureSize`), before or after it is enlarged.
void checkPictureForm(int width, int height, int samples, const PictureForm& form);

/// Returns the number of pixels of a finished picture for a length in pixels of its size.
inline int enlargedLength(int length, const PictureForm& form) {
  return static_cast<int>(std::lround(length * form.pixelRatio));
}

/// Returns the image that `drawOn(paper)` draws. `paper` is the colour of the background; if it is absent, the
/// background is the usual one. A transparent picture is drawn twice, on white and on black.
template <typename DrawOn>
Image finished(const PictureForm& form, const DrawOn& drawOn) {
  Image image = form.transparent ? withoutBackground(drawOn(Color{255, 255, 255}), drawOn(Color{0, 0, 0}))
                                 : drawOn(std::optional<Color>());
  image.dpi = kScreenDpi * form.pixelRatio;
  return image;
}

/// Returns the vector picture with these layers, over paper, of the size of its image.
VectorPicture vectorPicture(const Image& image, const PictureForm& form, std::vector<VectorLayer> layers);

}  // namespace hpsdf::render
