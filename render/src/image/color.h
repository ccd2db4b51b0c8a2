#pragma once
// Colour spaces: 8-bit sRGB for files, linear sRGB for shading and averaging, Oklab for everything that an eye judges.

#include <Eigen/Core>

#include "hpsdf/render/image.h"

namespace hpsdf::render {

/// Linear sRGB, 0 to 1.
using LinearColor = Eigen::Vector3f;

LinearColor decodeSrgb(Color color);

/// Values outside 0 to 1 are clamped.
Color encodeSrgb(const LinearColor& color);

/// Perceptual coordinates (Ottosson 2020): lightness 0 to 1, a towards red, b towards yellow.
struct Oklab {
  double lightness = 0;
  double a = 0;
  double b = 0;
};

Oklab toOklab(const LinearColor& color);

/// The displayable colour of this lightness and hue whose chroma is the given one or, beyond the gamut, the largest.
LinearColor fromOklab(const Oklab& color);
LinearColor fromOklch(double lightness, double chroma, double hueDegrees);

/// Euclidean distance in Oklab; about 0.02 is just noticeable side by side.
double colorDifference(const Oklab& a, const Oklab& b);

inline LinearColor mix(const LinearColor& a, const LinearColor& b, float t) { return a + t * (b - a); }

}  // namespace hpsdf::render
