#include "coloring/quantity.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "hpsdf/error.h"

namespace hpsdf::render {
namespace {

/// Evaluates a quantity at all points, in one batch, and writes the values to `out`.
void measure(const Field& field, ColorBy quantity, const ReferenceData& reference, std::span<const Vector3> points,
             std::span<double> out) {
  const auto differences = [&](const auto& evaluateExpected) {
    std::vector<double> expected(points.size());
    field.values(points, out);
    evaluateExpected(expected);
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = std::abs(out[i] - expected[i]);
  };
  switch (quantity) {
    case ColorBy::slope: {
      std::vector<ValueAndGradient> results(points.size());
      field.valuesAndGradients(points, results);
      for (std::size_t i = 0; i < points.size(); ++i) out[i] = std::abs(results[i].gradient.norm() - 1);
      return;
    }
    case ColorBy::error:
      return differences([&](std::vector<double>& expected) { (*reference.exact)(points, expected); });
    case ColorBy::difference:
      return differences([&](std::vector<double>& expected) { reference.other->values(points, expected); });
    default:
      throw Error("this quantity is not evaluated at single points");
  }
}

/// A value of a quantity, and its weight in the choice of a colour scale's limits.
struct Weighted {
  double value, weight;
};

/// Returns the range of the positive values without outliers, which are the lowest 1 % and the highest 0.1 % of the
/// total weight. Otherwise a few outliers could stretch a colour scale so far that all other values have one colour.
std::array<double, 2> rangeWithoutOutliers(std::vector<Weighted> values) {
  std::erase_if(values, [](const Weighted& v) { return !(v.value > 0) || !std::isfinite(v.value); });
  if (values.empty()) return {0, 0};
  std::ranges::sort(values, {}, &Weighted::value);
  double total = 0;
  for (const Weighted& v : values) total += v.weight;
  const auto quantile = [&](double share) {
    double sum = 0;
    for (const Weighted& v : values)
      if ((sum += v.weight) > share * total) return v.value;
    return values.back().value;
  };
  return {quantile(0.01), quantile(0.999)};
}

/// Returns the values of the cells, each weighted by the volume of its cell. Many tiny cells in a corner then do not
/// decide the scale.
std::vector<Weighted> weighted(const Field& field, const std::vector<double>& ofCells) {
  std::vector<Weighted> values;
  field.forEachCell([&](const Cell& cell) { values.push_back({ofCells[cell.id], cell.box.volume()}); });
  return values;
}

/// Picks at most a million samples at even intervals, to represent all samples. Gives each of them the weight 1.
std::vector<Weighted> weighted(const std::vector<float>& ofSamples) {
  constexpr std::size_t kMost = 1'000'000;
  std::vector<Weighted> values;
  for (std::size_t i = 0; i < ofSamples.size(); i += ofSamples.size() / kMost + 1) values.push_back({ofSamples[i], 1});
  return values;
}

}  // namespace

std::span<const ColorMode> colorModes() {
  static const std::vector<ColorMode> modes = {
      {ColorBy::normal, "normal"},
      {ColorBy::degree, "degree", "", {"polynomial degree", "degree"}},
      {ColorBy::depth, "depth", "", {"octree depth", "depth"}},
      {ColorBy::distance, "distance"},
      {ColorBy::valueJump,
       "value-jump",
       "value-jump and gradient-jump show the greatest jump at a cell's faces",
       {"worst jump of the value", "jump of value", "value jump"}},
      {ColorBy::gradientJump, "gradient-jump", "", {"worst jump of the gradient", "jump of gradient", "gradient jump"}},
      {ColorBy::slope,
       "slope",
       "slope the difference of the gradient's length from 1",
       {"slope error ||∇f| − 1|", "||∇f| − 1|", "slope error"}},
      {ColorBy::error, "error", "error the difference from the exact distance", {"error |f − exact|", "error"}},
      {ColorBy::difference,
       "difference",
       "difference the difference from another field",
       {"difference |f − other|", "difference"}},
      {ColorBy::cellError,
       "cell-error",
       "cell-error the estimated RMS error of a cell",
       {"estimated cell error", "cell error"}}};
  return modes;
}

std::span<const std::string> titlesOf(ColorBy color) { return colorModes()[std::size_t(color)].titles; }

void requireReferenceData(ColorBy color, const ReferenceData& reference) {
  if ((color == ColorBy::valueJump || color == ColorBy::gradientJump) && reference.jumps == nullptr)
    throw Error("colours of jumps need the field's jumps");
  if (color == ColorBy::error && reference.exact == nullptr)
    throw Error("colours of the error need the exact distance");
  if (color == ColorBy::difference && reference.other == nullptr)
    throw Error("colours of the difference need another field");
}

std::vector<double> quantityOfCells(const Field& field, ColorBy quantity, const ReferenceData& reference) {
  if (quantity == ColorBy::valueJump) return worstJumpOfCells(field, *reference.jumps, JumpKind::value);
  if (quantity == ColorBy::gradientJump) return worstJumpOfCells(field, *reference.jumps, JumpKind::gradient);
  if (quantity != ColorBy::cellError) return {};
  std::vector<double> errors(field.data().nodes.size(), 0.0);
  field.forEachCell([&](const Cell& cell) { errors[cell.id] = std::sqrt(cell.error / cell.box.volume()); });
  return errors;
}

std::vector<float> quantityOfSamples(const Field& field, const ViewBuffers& buffers,
                                     const std::function<Vector3(int, int)>& pointAt, ColorBy quantity,
                                     const ReferenceData& reference, const std::vector<double>& ofCells) {
  std::vector<float> result(buffers.cell.size(), std::numeric_limits<float>::quiet_NaN());
  tbb::parallel_for(tbb::blocked_range<int>(0, buffers.height), [&](const tbb::blocked_range<int>& rows) {
    std::vector<std::size_t> pixels;
    std::vector<Vector3> points;
    std::vector<double> values;
    for (int y = rows.begin(); y < rows.end(); ++y) {
      pixels.clear();
      points.clear();
      for (int x = 0; x < buffers.width; ++x) {
        const std::size_t i = std::size_t(y) * buffers.width + x;
        if (!buffers.hit(i)) continue;
        pixels.push_back(i);
        if (ofCells.empty())
          points.push_back(pointAt(x, y));
        else
          result[i] = static_cast<float>(ofCells[buffers.cell[i]]);
      }
      if (!ofCells.empty()) continue;
      values.resize(points.size());
      measure(field, quantity, reference, points, values);
      for (std::size_t n = 0; n < pixels.size(); ++n) result[pixels[n]] = static_cast<float>(values[n]);
    }
  });
  return result;
}

std::vector<float> quantityOfPoints(const Field& field, std::span<const Vector3> points, ColorBy quantity,
                                    const ReferenceData& reference, const std::vector<double>& ofCells) {
  std::vector<double> values(points.size());
  if (ofCells.empty())
    measure(field, quantity, reference, points, values);
  else
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = ofCells[field.cellAt(points[i]).id];
  return {values.begin(), values.end()};
}

ColorScale colorScale(const ScaleOptions& options, const Field& field, const std::vector<double>& ofCells,
                      const std::vector<float>& ofSamples) {
  if (options.limits) {
    const auto [low, high] = *options.limits;
    if (!(low < high) || !std::isfinite(low) || !std::isfinite(high))
      throw Error("range: expected LOW,HIGH with LOW below HIGH");
    if (options.logarithmic && !(low > 0))
      throw Error("range: a logarithmic scale needs limits above 0; give others, or a linear scale");
    return {low, high, options.logarithmic, options.map};
  }
  const auto [least, greatest] = rangeWithoutOutliers(ofCells.empty() ? weighted(ofSamples) : weighted(field, ofCells));
  return ColorScale::around(least, greatest, options.logarithmic, options.map);
}

}  // namespace hpsdf::render
