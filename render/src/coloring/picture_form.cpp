#include "coloring/picture_form.h"

#include <utility>

#include "hpsdf/error.h"

namespace hpsdf::render {

void checkPictureForm(int width, int height, int samples, const PictureForm& form) {
  checkPictureSize(width, height, samples);
  if (!(form.pixelRatio > 0) || !(form.pixelRatio <= 1000))
    throw Error("a picture cannot be enlarged by a factor of " + std::to_string(form.pixelRatio) +
                ": give a number above 0 and up to 1000");
  checkPictureSize(enlargedLength(width, form), enlargedLength(height, form), samples);
}

VectorPicture vectorPicture(const Image& image, const PictureForm& form, std::vector<VectorLayer> layers) {
  VectorPicture picture{image.width, image.height, image.dpi};
  const Eigen::Vector2d corner(image.width, image.height);
  const Polyline border = {{0, 0}, {corner.x(), 0}, corner, {0, corner.y()}, {0, 0}};
  if (!form.transparent) picture.layers.push_back({"paper", {FilledShape{{border}, paperColor()}}});
  for (VectorLayer& layer : layers) picture.layers.push_back(std::move(layer));
  return picture;
}

}  // namespace hpsdf::render
