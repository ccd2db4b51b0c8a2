#include "quantity.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "hpsdf/error.h"

namespace hpsdf::render {
namespace {

/// out[i] of the points of one row.
void measure(const Field& field, ColorBy quantity, const Evidence& evidence, std::span<const Vector3> points,
             std::span<double> out) {
  if (quantity == ColorBy::slope) {
    std::vector<ValueAndGradient> results(points.size());
    field.valuesAndGradients(points, results);
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = std::abs(results[i].gradient.norm() - 1);
    return;
  }
  std::vector<double> exact(points.size());
  field.values(points, out);
  (*evidence.exact)(points, exact);
  for (std::size_t i = 0; i < points.size(); ++i) out[i] = std::abs(out[i] - exact[i]);
}

/// The least and the greatest value above 0, but for the lowest hundredth and the highest thousandth: a few outliers
/// would leave all else one colour.
std::array<double, 2> spread(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !(v > 0) || !std::isfinite(v); });
  if (values.empty()) return {0, 0};
  const auto nth = [&](std::size_t n) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(n);
    std::nth_element(values.begin(), place, values.end());
    return *place;
  };
  return {nth(values.size() / 100), nth(values.size() - 1 - values.size() / 1000)};
}

}  // namespace

void requireEvidence(ColorBy color, const Evidence& evidence) {
  if ((color == ColorBy::valueJump || color == ColorBy::gradientJump) && evidence.jumps == nullptr)
    throw Error("colours of jumps need the field's jumps");
  if (color == ColorBy::error && evidence.exact == nullptr) throw Error("colours of the error need the exact distance");
}

std::vector<double> quantityOfCells(const Field& field, ColorBy quantity, const Evidence& evidence) {
  if (quantity == ColorBy::valueJump) return worstJumpOfCells(field, *evidence.jumps, JumpKind::value);
  if (quantity == ColorBy::gradientJump) return worstJumpOfCells(field, *evidence.jumps, JumpKind::gradient);
  if (quantity != ColorBy::cellError) return {};
  std::vector<double> errors(field.data().nodes.size(), 0.0);
  field.forEachCell([&](const Cell& cell) { errors[cell.id] = std::sqrt(cell.error / cell.box.volume()); });
  return errors;
}

std::vector<float> quantityOfSamples(const Field& field, const ViewBuffers& buffers,
                                     const std::function<Vector3(int, int)>& pointAt, ColorBy quantity,
                                     const Evidence& evidence, const std::vector<double>& ofCells) {
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
      measure(field, quantity, evidence, points, values);
      for (std::size_t n = 0; n < pixels.size(); ++n) result[pixels[n]] = static_cast<float>(values[n]);
    }
  });
  return result;
}

ColorScale colorScale(const ScaleOptions& options, const std::vector<double>& ofCells,
                      const std::vector<float>& ofSamples) {
  if (options.limits) {
    const auto [low, high] = *options.limits;
    if (!(low < high) || !std::isfinite(low) || !std::isfinite(high))
      throw Error("range: expected LOW,HIGH with LOW below HIGH");
    if (options.logarithmic && !(low > 0))
      throw Error("range: a logarithmic scale needs limits above 0; give others, or a linear scale");
    return {low, high, options.logarithmic};
  }
  const auto [least, greatest] =
      spread(ofCells.empty() ? std::vector<double>(ofSamples.begin(), ofSamples.end()) : ofCells);
  return ColorScale::around(least, greatest, options.logarithmic);
}

}  // namespace hpsdf::render
