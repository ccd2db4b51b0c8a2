#pragma once
// Differences of colours as they look to readers with normal and with deficient colour vision.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

namespace hpsdf::support {

/// A colour in CIELAB, relative to the white of sRGB (D65).
using Lab = std::array<double, 3>;

/// The colour difference ΔE2000 with all weights 1, as in Sharma, Wu and Dalal, "The CIEDE2000 color-difference
/// formula: implementation notes, supplementary test data, and mathematical observations", 2005.
inline double colorDifference2000(const Lab& one, const Lab& other) {
  constexpr double kDegree = std::numbers::pi / 180;
  const auto seventh = [](double x) { return std::sqrt(std::pow(x, 7) / (std::pow(x, 7) + std::pow(25.0, 7))); };
  const double meanChroma = (std::hypot(one[1], one[2]) + std::hypot(other[1], other[2])) / 2;
  const double stretch = 1.5 - 0.5 * seventh(meanChroma);
  const auto chromaOf = [&](const Lab& lab) { return std::hypot(stretch * lab[1], lab[2]); };
  const auto hueOf = [&](const Lab& lab) {
    if (lab[1] == 0 && lab[2] == 0) return 0.0;
    const double hue = std::atan2(lab[2], stretch * lab[1]) / kDegree;
    return hue < 0 ? hue + 360 : hue;
  };
  const double c1 = chromaOf(one), c2 = chromaOf(other), h1 = hueOf(one), h2 = hueOf(other);
  const bool isGrey = c1 * c2 == 0;
  double hueStep = isGrey ? 0 : h2 - h1;
  if (hueStep > 180) hueStep -= 360;
  if (hueStep < -180) hueStep += 360;
  double hue = h1 + h2;
  if (!isGrey) hue = std::abs(h1 - h2) <= 180 ? hue / 2 : hue < 360 ? (hue + 360) / 2 : (hue - 360) / 2;

  const double lightness = (one[0] + other[0]) / 2, chroma = (c1 + c2) / 2;
  const double t = 1 - 0.17 * std::cos((hue - 30) * kDegree) + 0.24 * std::cos(2 * hue * kDegree) +
                   0.32 * std::cos((3 * hue + 6) * kDegree) - 0.20 * std::cos((4 * hue - 63) * kDegree);
  const double fromMiddle = (lightness - 50) * (lightness - 50);
  const double dL = (other[0] - one[0]) / (1 + 0.015 * fromMiddle / std::sqrt(20 + fromMiddle));
  const double dC = (c2 - c1) / (1 + 0.045 * chroma);
  const double dH = 2 * std::sqrt(c1 * c2) * std::sin(hueStep / 2 * kDegree) / (1 + 0.015 * chroma * t);
  const double turn = 60 * std::exp(-std::pow((hue - 275) / 25, 2));
  return std::sqrt(dL * dL + dC * dC + dH * dH - 2 * seventh(chroma) * std::sin(turn * kDegree) * dC * dH);
}

/// Colour vision: normal, or without one of the three kinds of cones.
struct Vision {
  std::string name;
  std::array<double, 9> linear;  ///< rows of the matrix that is applied to linear sRGB
};

/// Normal vision and the three deficiencies at severity 1.0, after Machado, Oliveira and Fernandes, "A
/// physiologically-based model for simulation of color vision deficiency", 2009.
inline const std::array<Vision, 4>& visions() {
  static const std::array<Vision, 4> all = {{
      {"normal vision", {1, 0, 0, 0, 1, 0, 0, 0, 1}},
      {"protanopia", {0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998}},
      {"deuteranopia", {0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881}},
      {"tritanopia", {1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602, 0.004733, 0.691367, 0.303900}},
  }};
  return all;
}

using Rgb = std::array<std::uint8_t, 3>;

/// Returns the colour that a reader with this vision sees.
inline Lab seenAs(const Rgb& color, const Vision& vision) {
  std::array<double, 3> linear{}, seen{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double encoded = color[i] / 255.0;
    linear[i] = encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
  }
  for (std::size_t i = 0; i < 9; ++i) seen[i / 3] += vision.linear[i] * linear[i % 3];
  for (double& channel : seen) channel = std::clamp(channel, 0.0, 1.0);

  constexpr std::array<std::array<double, 3>, 3> kXyzFromLinear = {
      {{0.4124564, 0.3575761, 0.1804375}, {0.2126729, 0.7151522, 0.0721750}, {0.0193339, 0.1191920, 0.9503041}}};
  std::array<double, 3> f{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& row = kXyzFromLinear[i];
    const double t = (row[0] * seen[0] + row[1] * seen[1] + row[2] * seen[2]) / (row[0] + row[1] + row[2]);
    f[i] = t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116;
  }
  return {116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
}

/// The smallest difference of two colours among all kinds of vision, and the vision that sees it.
struct LeastDifference {
  double difference = 1e9;
  std::string text = {};  ///< for messages: the names of the two colours, the difference and the vision
};

struct NamedColor {
  std::string name;
  Rgb color;
};

/// Returns the pair of colours of `marks` and `grounds` that is hardest to tell apart.
inline LeastDifference leastDifference(const std::vector<NamedColor>& marks, const std::vector<NamedColor>& grounds) {
  LeastDifference least;
  for (const Vision& vision : visions())
    for (const NamedColor& mark : marks)
      for (const NamedColor& ground : grounds) {
        const double difference = colorDifference2000(seenAs(mark.color, vision), seenAs(ground.color, vision));
        if (difference < least.difference)
          least = {difference,
                   mark.name + " and " + ground.name + ": " + std::to_string(difference) + ", " + vision.name};
      }
  return least;
}

/// Returns the two colours of a set that are hardest to tell apart.
inline LeastDifference leastDifference(const std::vector<NamedColor>& colors) {
  LeastDifference least;
  for (std::size_t n = 1; n < colors.size(); ++n) {
    const LeastDifference found = leastDifference({colors[n]}, {colors.begin(), colors.begin() + std::ptrdiff_t(n)});
    if (found.difference < least.difference) least = found;
  }
  return least;
}

}  // namespace hpsdf::support
