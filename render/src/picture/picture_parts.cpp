#include "picture/picture_parts.h"

#include <algorithm>
#include <cstddef>
#include <string>

#include "hpsdf/error.h"
#include "image/color.h"
#include "picture/color_view.h"

namespace hpsdf::render {
namespace {

constexpr int kSmallestSize = 16;
constexpr int kLargestSize = 16384;
constexpr int kMostSamples = 8;
// A sample of a surface takes 27 bytes in the buffers, and as much again while a renderer fills them; bodies take 28
// more, and 12 meanwhile.
constexpr std::size_t kMostSamplesInAll = std::size_t{1} << 26;

}  // namespace

void checkPictureSize(int width, int height, int samples) {
  const auto size = [&] { return std::to_string(width) + "x" + std::to_string(height); };
  if (std::min(width, height) < kSmallestSize || std::max(width, height) > kLargestSize)
    throw Error("picture size " + size() + " is out of range: give 16 to 16384 pixels a side");
  if (samples < 1 || samples > kMostSamples)
    throw Error("samples = " + std::to_string(samples) + " is out of range: give 1 to 8 samples an axis and pixel");
  if (std::size_t(width) * height * samples * samples > kMostSamplesInAll)
    throw Error("a picture of " + size() + " with " + std::to_string(samples) + "x" + std::to_string(samples) +
                " samples a pixel takes more than 64 million samples: give a smaller size or fewer samples");
}

double lineWidthOf(const Frame& frame) { return std::max(0.7, frame.textSize / 15); }

Image backdropPicture(int width, int height, int viewHeight) {
  Image image(width, height, paperColor());
  for (int y = 0; y < viewHeight; ++y)
    std::fill_n(&image.at(0, y), width, encodeSrgb(backdropColor((y + 0.5) / viewHeight)));
  return image;
}

void place(Image& picture, const Image& view) {
  for (int y = 0; y < view.height; ++y)
    std::copy_n(&view.pixels[std::size_t(y) * view.width], view.width, &picture.at(0, y));
}

}  // namespace hpsdf::render
