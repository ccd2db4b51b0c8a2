#pragma once
// Colour spaces: 8-bit sRGB for files, linear sRGB for shading and averaging, Oklab for the choice of colours.

#include <Eigen/Core>
#include <algorithm>

#include "hpsdf/render/image.h"

namespace hpsdf::render {

LinearColor decodeSrgb(Color color);

/// Converts linear sRGB to 8-bit sRGB. Clamps channels to the range 0 to 1.
Color encodeSrgb(const LinearColor& color);

/// A perceptually uniform colour space (Ottosson, "A perceptual color space for image processing", 2020): lightness 0
/// to 1, a towards red, b towards yellow.
struct Oklab {
  double lightness = 0;
  double a = 0;
  double b = 0;
};

Oklab toOklab(const LinearColor& color);

/// Converts an Oklab colour to linear sRGB. If the gamut of sRGB does not contain the colour, its chroma is
/// reduced, at the same lightness and hue, until it can be displayed.
LinearColor fromOklab(const Oklab& color);
/// Converts an Oklab colour in polar coordinates to linear sRGB: a = chroma · cos(hue), b = chroma · sin(hue).
LinearColor fromOklch(double lightness, double chroma, double hueDegrees);

/// Euclidean distance in Oklab. About 0.02 is just noticeable side by side.
double colorDifference(const Oklab& a, const Oklab& b);

inline LinearColor mix(const LinearColor& a, const LinearColor& b, float t) { return a + t * (b - a); }

/// Mixes a colour into a pixel, in linear light. `share` is the weight of the new colour, 0 to 1.
inline void mixInto(Color& pixel, const LinearColor& color, float share) {
  pixel = encodeSrgb(mix(decodeSrgb(pixel), color, share));
}

/// A function of x that rises smoothly from 0 at `low` to 1 at `high`. Its slope is 0 at both ends.
inline float smoothStep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return static_cast<float>(t * t * (3 - 2 * t));
}

}  // namespace hpsdf::render
