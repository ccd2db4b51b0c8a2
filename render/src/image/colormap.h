#pragma once
// The scales that map numbers to positions on a colour map.

#include <vector>

#include "hpsdf/render/color_maps.h"
#include "image/color.h"

namespace hpsdf::render {

/// Maps values of a quantity to an ordered colour map. Values up to `low` get the dark end of the map, values
/// from `high` on get the light end.
class ColorScale {
 public:
  /// Requires low < high. A logarithmic scale also requires 0 < low. `map` is the name of an ordered map, or empty for
  /// the default one; throws `Error` for any other name.
  ColorScale(double low, double high, bool logarithmic, const std::string& map = "");

  /// A scale for values from `least` (above 0) to `greatest`. The ends of a logarithmic scale are powers of ten, at
  /// most six decades apart. A linear scale runs from 0 to `greatest`, rounded up to one or two digits, or to 1 if
  /// `greatest` is 0.
  static ColorScale around(double least, double greatest, bool logarithmic, const std::string& map = "");

  LinearColor operator()(double value) const {
    return table_[static_cast<std::size_t>(fraction(value) * kSteps + 0.5)];
  }
  /// The position of a value on the scale, clamped to the range 0 (at `low`) to 1 (at `high`). Returns 0 for NaN.
  double fraction(double value) const;

  double low() const { return low_; }
  double high() const { return high_; }
  bool logarithmic() const { return logarithmic_; }
  const ColorMap& map() const { return *map_; }

 private:
  static constexpr int kSteps = 1024;
  double low_, high_;
  bool logarithmic_;
  const ColorMap* map_;
  std::vector<LinearColor> table_;
};

/// The values to mark on a colour scale, ascending: powers of ten if a logarithmic scale contains at least two
/// of them, else about five values at even steps.
std::vector<double> scaleMarks(const ColorScale& scale);

/// The step of the form {1, 2, 5} · 10^n that divides `span` into a number of parts as near to `lines` as possible.
double niceStep(double span, double lines);

/// The largest power of ten that is at most x; x must be above 0.
double powerOfTenBelow(double x);

/// The range of the colours and the spacing of the iso-lines that show distances in a slice.
struct DistanceScale {
  double range = 1;                 ///< the colour map covers the distances [−range, range]
  double step = 0.1;                ///< iso-lines are drawn at the multiples of this distance
  double minimum = 0, maximum = 0;  ///< least and greatest distance shown
};

/// Chooses the scale for distances in [minimum, maximum]. The range of the colours is the greatest magnitude of the
/// distances, rounded up to one or two digits. There are about twelve iso-lines. Their step is 1, 2 or 5 times a
/// power of ten.
DistanceScale distanceScale(double minimum, double maximum);

}  // namespace hpsdf::render
