#include "image/color.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace hpsdf::render {
namespace {

// decodeChannel and encodeChannel are the transfer function of sRGB (IEC 61966-2-1) and its inverse.
double decodeChannel(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}
double encodeChannel(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

// The number of steps of the lookup table for encodeChannel. The function changes by at most 1/20 of an 8-bit code per
// step, so that table and function rarely round differently.
constexpr int kEncodeSteps = 65535;

const std::vector<std::uint8_t>& encodeTable() {
  static const std::vector<std::uint8_t> table = [] {
    std::vector<std::uint8_t> t(kEncodeSteps + 1);
    for (int i = 0; i <= kEncodeSteps; ++i)
      t[i] = static_cast<std::uint8_t>(std::lround(255 * encodeChannel(double(i) / kEncodeSteps)));
    return t;
  }();
  return table;
}

const std::array<float, 256>& decodeTable() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> t{};
    for (int i = 0; i < 256; ++i) t[i] = static_cast<float>(decodeChannel(i / 255.0));
    return t;
  }();
  return table;
}

// The matrices are from Ottosson (2020).
LinearColor oklabToLinear(const Oklab& color) {
  const double l = std::pow(color.lightness + 0.3963377774 * color.a + 0.2158037573 * color.b, 3);
  const double m = std::pow(color.lightness - 0.1055613458 * color.a - 0.0638541728 * color.b, 3);
  const double s = std::pow(color.lightness - 0.0894841775 * color.a - 1.2914855480 * color.b, 3);
  return LinearColor(static_cast<float>(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
                     static_cast<float>(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
                     static_cast<float>(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s));
}

bool displayable(const LinearColor& color) { return color.minCoeff() >= -1e-5F && color.maxCoeff() <= 1 + 1e-5F; }

}  // namespace

LinearColor decodeSrgb(Color color) {
  const auto& table = decodeTable();
  return LinearColor(table[color[0]], table[color[1]], table[color[2]]);
}

Color encodeSrgb(const LinearColor& color) {
  const auto& table = encodeTable();
  Color encoded;
  for (int i = 0; i < 3; ++i)
    encoded[i] = table[static_cast<int>(std::clamp(color[i], 0.0F, 1.0F) * float(kEncodeSteps) + 0.5F)];
  return encoded;
}

Oklab toOklab(const LinearColor& color) {
  const double r = color[0], g = color[1], b = color[2];
  const double l = std::cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const double m = std::cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const double s = std::cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return {0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s,
          1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s,
          0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s};
}

LinearColor fromOklab(const Oklab& color) {
  LinearColor linear = oklabToLinear(color);
  // If sRGB cannot display the colour, bisect for the largest share of its chroma at which the colour is displayable.
  if (!displayable(linear)) {
    double inside = 0, outside = 1;
    for (int i = 0; i < 24; ++i) {
      const double middle = (inside + outside) / 2;
      const bool fits = displayable(oklabToLinear({color.lightness, middle * color.a, middle * color.b}));
      (fits ? inside : outside) = middle;
    }
    linear = oklabToLinear({color.lightness, inside * color.a, inside * color.b});
  }
  return linear.cwiseMax(0.0F).cwiseMin(1.0F);
}

LinearColor fromOklch(double lightness, double chroma, double hueDegrees) {
  const double hue = hueDegrees * std::numbers::pi / 180;
  return fromOklab({lightness, chroma * std::cos(hue), chroma * std::sin(hue)});
}

double colorDifference(const Oklab& a, const Oklab& b) {
  return std::hypot(a.lightness - b.lightness, a.a - b.a, a.b - b.b);
}

}  // namespace hpsdf::render
