#pragma once
// Colour maps and the scales that map numbers to them.

#include <array>
#include <span>
#include <vector>

#include "image/color.h"

namespace hpsdf::render {

/// The map for ordered values: from dark violet at 0 over blue, teal and green to pale yellow at 1. Its lightness rises
/// throughout.
LinearColor orderedColor(double t);

/// Colours of degrees or depths (levels, 0 to 255), spread evenly over the ordered map.
class LevelMap {
 public:
  explicit LevelMap(std::span<const int> levels);

  /// Magenta, which the map does not contain, for a level that is not in `levels`: a fault of the buffers must show.
  const LinearColor& operator()(int level) const { return colors_[static_cast<std::uint8_t>(level)]; }
  const std::vector<int>& levels() const { return levels_; }

 private:
  std::vector<int> levels_;
  std::array<LinearColor, 256> colors_;
};

/// Maps a quantity to the ordered map: values up to `low` to its dark end, values from `high` on to its light end.
class ColorScale {
 public:
  /// Requires low < high, and 0 < low on a logarithmic scale.
  ColorScale(double low, double high, bool logarithmic);

  /// A scale for values from `least` (above 0) to `greatest`. A logarithmic scale lies between powers of ten and
  /// spans at most six decades; a linear one runs from 0 to a number of one or two digits. Its high end is 1 where
  /// `greatest` is 0.
  static ColorScale around(double least, double greatest, bool logarithmic);

  LinearColor operator()(double value) const {
    return table_[static_cast<std::size_t>(fraction(value) * kSteps + 0.5)];
  }
  /// The value's position on the scale, clamped: 0 at `low`, 1 at `high`; 0 for NaN.
  double fraction(double value) const;

  double low() const { return low_; }
  double high() const { return high_; }
  bool logarithmic() const { return logarithmic_; }

 private:
  static constexpr int kSteps = 1024;
  double low_, high_;
  bool logarithmic_;
  std::vector<LinearColor> table_;
};

/// Values to mark on a scale, ascending: the powers of ten if the scale contains at least two, else about five even
/// steps.
std::vector<double> scaleMarks(const ColorScale& scale);

/// The step of the form {1, 2, 5} · 10^n that divides `span` into a number of parts as near to `lines` as possible.
double niceStep(double span, double lines);

/// The largest power of ten that is at most x; x must be above 0.
double powerOfTenBelow(double x);

/// The diverging map for distances: deep blue at −1 (inside), white at 0, deep red at 1 (outside).
LinearColor divergingColor(double t);

/// The colours and iso-lines of distances.
struct DistanceScale {
  double range = 1;                 ///< the colours span [−range, range]
  double step = 0.1;                ///< iso-lines are at the multiples of this value
  double minimum = 0, maximum = 0;  ///< least and greatest value shown
};

/// Chooses a range of one or two digits and about twelve iso-lines with a step of {1, 2, 5} · 10^n for values within
/// [minimum, maximum].
DistanceScale distanceScale(double minimum, double maximum);

}  // namespace hpsdf::render
