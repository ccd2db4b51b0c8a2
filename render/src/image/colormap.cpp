#include "image/colormap.h"

#include <algorithm>
#include <cmath>

#include "hpsdf/types.h"

namespace hpsdf::render {
namespace {

constexpr double kIsoLines = 12;

double niceCeil(double x) {
  const double power = powerOfTenBelow(x);
  for (double digits : {1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0})
    if (digits * power >= x * (1 - 1e-9)) return digits * power;
  return 10 * power;
}

}  // namespace

double powerOfTenBelow(double x) { return std::pow(10.0, std::floor(std::log10(x) + 1e-12)); }

double niceStep(double span, double lines) {
  const double ideal = span / lines;
  const double power = powerOfTenBelow(ideal);
  double best = power;
  for (double digits : {2.0, 5.0, 10.0})
    if (std::abs(std::log(digits * power / ideal)) < std::abs(std::log(best / ideal))) best = digits * power;
  return best;
}

LinearColor orderedColor(double t) {
  t = std::clamp(t, 0.0, 1.0);
  const double lightness = 0.385 + 0.565 * t;
  // The hue runs from violet over blue, teal and green to yellow. The shorter way around the hue circle would
  // pass through muddy pinks.
  const double hue = 302 - 204 * std::pow(t, 0.92);
  // The chroma is lowest in the middle of the map, where the gamut of sRGB is narrow and greens would stand out.
  const double chroma = 0.103 + 0.034 * (2 * t - 1) * (2 * t - 1);
  return fromOklch(lightness, chroma, hue);
}

LinearColor exactColor() { return fromOklch(0.51, 0.20, 30); }

LevelMap::LevelMap(std::span<const int> levels) : levels_(levels.begin(), levels.end()) {
  std::sort(levels_.begin(), levels_.end());
  levels_.erase(std::unique(levels_.begin(), levels_.end()), levels_.end());
  colors_.fill(LinearColor(1, 0, 1));
  const auto ordered = levels_.size() - static_cast<std::size_t>(std::ranges::count(levels_, kExactDegree));
  std::size_t i = 0;
  for (const int level : levels_)
    colors_[static_cast<std::uint8_t>(level)] = level == kExactDegree ? exactColor()
                                                : ordered == 1        ? orderedColor(0.5)
                                                                      : orderedColor(double(i++) / double(ordered - 1));
}

ColorScale::ColorScale(double low, double high, bool logarithmic)
    : low_(low), high_(high), logarithmic_(logarithmic), table_(kSteps + 1) {
  for (int i = 0; i <= kSteps; ++i) table_[i] = orderedColor(double(i) / kSteps);
}

ColorScale ColorScale::around(double least, double greatest, bool logarithmic) {
  constexpr double kMostDecades = 6;
  if (!(greatest > 0)) return logarithmic ? ColorScale(0.1, 1, true) : ColorScale(0, 1, false);
  if (!logarithmic) return {0, niceCeil(greatest), false};
  const double top = std::ceil(std::log10(greatest) - 1e-9);
  const double bottom = std::clamp(std::floor(std::log10(least) + 1e-9), top - kMostDecades, top - 1);
  return {std::pow(10.0, bottom), std::pow(10.0, top), true};
}

double ColorScale::fraction(double value) const {
  const double t = logarithmic_ ? std::log(value / low_) / std::log(high_ / low_) : (value - low_) / (high_ - low_);
  return t > 0 ? std::min(t, 1.0) : 0.0;
}

std::vector<double> scaleMarks(const ColorScale& scale) {
  std::vector<double> marks;
  constexpr double kTolerance = 1e-9;
  if (scale.logarithmic()) {
    for (int n = static_cast<int>(std::ceil(std::log10(scale.low()) - kTolerance));
         n <= std::floor(std::log10(scale.high()) + kTolerance); ++n)
      marks.push_back(std::pow(10.0, n));
    if (marks.size() >= 2) return marks;
    marks.clear();
  }
  const double step = niceStep(scale.high() - scale.low(), 5);
  for (double n = std::ceil(scale.low() / step - kTolerance); n * step <= scale.high() + kTolerance * step; ++n)
    marks.push_back(n * step);
  return marks;
}

LinearColor divergingColor(double t) {
  // The colours from white to each end form a quadratic Bézier curve, whose control point is a light, saturated
  // colour. The sign of t is then visible even close to zero.
  const Oklab white = {0.985, 0, 0};
  const Oklab middle = t < 0 ? Oklab{0.77, -0.045, -0.105} : Oklab{0.80, 0.070, 0.085};
  const Oklab end = t < 0 ? Oklab{0.36, -0.015, -0.135} : Oklab{0.40, 0.125, 0.070};
  const double s = std::clamp(std::abs(t), 0.0, 1.0);
  const auto bend = [s](double a, double b, double c) {
    return (1 - s) * (1 - s) * a + 2 * s * (1 - s) * b + s * s * c;
  };
  return fromOklab({bend(white.lightness, middle.lightness, end.lightness), bend(white.a, middle.a, end.a),
                    bend(white.b, middle.b, end.b)});
}

DistanceScale distanceScale(double minimum, double maximum) {
  DistanceScale scale;
  scale.minimum = minimum;
  scale.maximum = maximum;
  const double largest = std::max(std::abs(minimum), std::abs(maximum));
  if (largest > 0) {
    scale.range = niceCeil(largest);
    // Space the iso-lines evenly over the span of the values, or over the range of the colours if the values are
    // constant.
    const double span = maximum - minimum;
    scale.step = niceStep(span > 1e-6 * largest ? span : 2 * scale.range, kIsoLines);
  }
  return scale;
}

}  // namespace hpsdf::render
