#include "hpsdf/render/bodies.h"

#include <cmath>

#include "image/color.h"

namespace hpsdf::render {

Color bodyColor(std::size_t index) {
  // Hues run from green over blue to pink, far from the clay's orange, in steps of the golden section. Three
  // lightnesses alternate.
  constexpr double kFirstHue = 125, kHues = 225, kChroma = 0.11;
  constexpr double kLightness[] = {0.66, 0.78, 0.56};
  const double turns = 0.6180339887498949 * double(index % 1000000);
  return encodeSrgb(fromOklch(kLightness[index % 3], kChroma, kFirstHue + kHues * (turns - std::floor(turns))));
}

// The destructor is defined here so that the virtual table exists once, in this library.
BodyRenderer::~BodyRenderer() = default;

}  // namespace hpsdf::render
