#include "image/colormap.h"

#include <algorithm>
#include <cmath>

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

ColorScale::ColorScale(double low, double high, bool logarithmic, const std::string& map)
    : low_(low), high_(high), logarithmic_(logarithmic), map_(&colorMap(MapKind::ordered, map)), table_(kSteps + 1) {
  for (int i = 0; i <= kSteps; ++i) table_[i] = map_->at(double(i) / kSteps);
}

ColorScale ColorScale::around(double least, double greatest, bool logarithmic, const std::string& map) {
  constexpr double kMostDecades = 6;
  if (!(greatest > 0)) return logarithmic ? ColorScale(0.1, 1, true, map) : ColorScale(0, 1, false, map);
  if (!logarithmic) return {0, niceCeil(greatest), false, map};
  const double top = std::ceil(std::log10(greatest) - 1e-9);
  const double bottom = std::clamp(std::floor(std::log10(least) + 1e-9), top - kMostDecades, top - 1);
  return {std::pow(10.0, bottom), std::pow(10.0, top), true, map};
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
