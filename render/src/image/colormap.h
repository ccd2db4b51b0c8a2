#pragma once

#include <array>
#include <span>
#include <vector>

#include "image/color.h"

namespace hpsdf::render {

/// The ordered map for levels: 0 dark violet, over blue, teal and green, to 1, pale yellow. Lightness rises throughout.
LinearColor orderedColor(double t);

/// Colours of those levels (degrees or depths, 0 to 255) that occur, spread evenly over the ordered map.
class LevelMap {
 public:
  explicit LevelMap(std::span<const int> levels);

  /// Magenta, which the map does not hold, for a level that was not announced: a fault of the buffers must show.
  const LinearColor& operator()(int level) const { return colors_[static_cast<std::uint8_t>(level)]; }
  const std::vector<int>& levels() const { return levels_; }

 private:
  std::vector<int> levels_;
  std::array<LinearColor, 256> colors_;
};

/// From a quantity that is not negative to the ordered map: `low` and less is its dark end, `high` and more its light
/// one.
class ColorScale {
 public:
  /// low < high; above 0 when logarithmic.
  ColorScale(double low, double high, bool logarithmic);

  /// For values of which the least above 0 that counts and the greatest are given: whole powers of ten when logarithmic
  /// (six of them at most), else from 0 to a number of one or two digits. Where nothing is above 0, up to 1.
  static ColorScale around(double least, double greatest, bool logarithmic);

  LinearColor operator()(double value) const { return table_[static_cast<std::size_t>(place(value) * kSteps + 0.5)]; }
  /// 0 at `low`, 1 at `high`; 0 for NaN.
  double place(double value) const;

  double low() const { return low_; }
  double high() const { return high_; }
  bool logarithmic() const { return logarithmic_; }

 private:
  static constexpr int kSteps = 1024;
  double low_, high_;
  bool logarithmic_;
  std::vector<LinearColor> table_;
};

/// Values to mark on a scale, ascending: powers of ten, where there are two of them, else some five even steps.
std::vector<double> scaleMarks(const ColorScale& scale);

/// Of 1, 2 and 5 times a power of ten, the step that divides a span into as nearly so many lines as possible.
double niceStep(double span, double lines);

/// The largest power of ten that is not above x > 0.
double powerOfTenBelow(double x);

/// The diverging map for distances: −1 deep blue (inside), 0 white, 1 deep red (outside).
LinearColor divergingColor(double t);

/// What turns distances into colours and lines.
struct DistanceScale {
  double range = 1;                 ///< colours span [−range, range]
  double step = 0.1;                ///< between iso-lines, which stand at its multiples
  double minimum = 0, maximum = 0;  ///< of the values shown
};

/// For values within [minimum, maximum]: a range of one or two digits, and some twelve iso-lines at 1, 2 or 5 × 10^n.
DistanceScale distanceScale(double minimum, double maximum);

}  // namespace hpsdf::render
