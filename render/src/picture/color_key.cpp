#include "picture/color_key.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "coloring/quantity.h"
#include "hpsdf/error.h"
#include "picture/describe.h"

namespace hpsdf::render {
namespace {

constexpr int kBarColors = 256;

/// Replaces the value of each sample by the greatest value among the samples of its cell. Ignores values that are NaN.
/// Returns these values of the cells.
std::unordered_map<std::uint32_t, float> spreadOverCells(const ViewBuffers& buffers, std::vector<float>& values) {
  std::unordered_map<std::uint32_t, float> greatest;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!buffers.hit(i) || std::isnan(values[i])) continue;
    float& most = greatest.try_emplace(buffers.cell[i], values[i]).first->second;
    most = std::max(most, values[i]);
  }
  for (std::size_t i = 0; i < values.size(); ++i)
    if (const auto found = greatest.find(buffers.cell[i]); found != greatest.end()) values[i] = found->second;
  return greatest;
}

ColorKey keyOfQuantity(Overlay& overlay, const Frame& frame, const Field& field, const ViewBuffers& buffers,
                       const std::function<Vector3(int, int)>& pointAt, ColorBy quantity, const ScaleOptions& options,
                       const ReferenceData& reference) {
  std::vector<double> ofCells = quantityOfCells(field, quantity, reference);
  std::vector<float> values = quantityOfSamples(field, buffers, pointAt, quantity, reference, ofCells);
  std::unordered_map<std::uint32_t, float> greatest;
  if (options.perCell) greatest = spreadOverCells(buffers, values);
  const ColorScale scale = colorScale(options, field, ofCells, values);
  const std::span<const std::string> titles = titlesOf(quantity);
  addScaleBar(overlay, frame, titles, scale);

  ColorKey key{.color = {}, .scale = options, .name = titles.back(), .range = describeGreatest(values)};
  if (options.perCell) key.name = "greatest " + key.name + " of each cell";
  key.legend = {.title = titles.front(), .bar = colorsOf(scale.map(), kBarColors)};
  for (const double value : scaleMarks(scale))
    key.legend.marks.push_back({scale.fraction(value), formatNumber(value, 3)});
  key.scale.limits = {scale.low(), scale.high()};
  key.color = quantityColors(std::move(values), scale);
  if (options.perCell)
    key.cellColor = [greatest = std::move(greatest), scale](const Cell& cell) {
      const auto found = greatest.find(cell.id);  // a cell may be too small for any sample
      return scale(found == greatest.end() ? 0 : found->second);
    };
  else if (!ofCells.empty())
    key.cellColor = [ofCells = std::move(ofCells), scale](const Cell& cell) { return scale(float(ofCells[cell.id])); };
  return key;
}

ColorKey keyOfLevels(Overlay& overlay, const Frame& frame, const FieldStatistics& figures, const ViewBuffers& buffers,
                     ColorBy color, const ScaleOptions& options) {
  const std::span<const std::string> titles = titlesOf(color);
  std::map<int, double> shares = color == ColorBy::degree ? figures.degreeVolume : figures.depthVolume;
  for (const int level : options.levels) shares.try_emplace(level, 0.0);

  ColorKey key{.color = {}, .legend = {.title = titles.front()}, .scale = options, .name = titles.back(), .range = {}};
  key.scale.levels.clear();
  for (const auto& [level, share] : shares) key.scale.levels.push_back(level);
  for (const auto& [level, share] : shares) key.legend.levels.push_back({level, levelColor(level), share});
  addLevelLegend(overlay, frame, titles, shares);
  key.cellColor = [color](const Cell& cell) {
    return decodeSrgb(levelColor(color == ColorBy::degree ? cell.degree : cell.depth));
  };
  key.color = levelColors(buffers, color);
  return key;
}

}  // namespace

ColorKey makeColorKey(Overlay& overlay, const Frame& frame, const Field& field, const FieldStatistics& figures,
                      const ViewBuffers& buffers, const std::function<Vector3(int, int)>& pointAt, ColorBy color,
                      const ScaleOptions& scale, const ReferenceData& reference) {
  return isQuantity(color) ? keyOfQuantity(overlay, frame, field, buffers, pointAt, color, scale, reference)
                           : keyOfLevels(overlay, frame, figures, buffers, color, scale);
}

DistanceScale distanceScaleFor(const ViewBuffers& buffers, const ScaleOptions& options) {
  double minimum = 0, maximum = 0;
  bool any = false;
  for (std::size_t i = 0; i < buffers.value.size(); ++i) {
    if (!buffers.hit(i)) continue;
    minimum = any ? std::min<double>(minimum, buffers.value[i]) : buffers.value[i];
    maximum = any ? std::max<double>(maximum, buffers.value[i]) : buffers.value[i];
    any = true;
  }
  if (!options.limits) return distanceScale(minimum, maximum);
  const auto [low, high] = *options.limits;
  if (!(low <= high) || !std::isfinite(low) || !std::isfinite(high))
    throw Error("range: expected LOW,HIGH with LOW below HIGH");
  DistanceScale scale = distanceScale(low, high);
  scale.minimum = minimum;
  scale.maximum = maximum;
  return scale;
}

Legend distanceLegend(const DistanceScale& scale, const ColorMap& map) {
  Legend legend{.title = "signed distance", .bar = colorsOf(map, kBarColors)};
  for (const double share : {-1.0, -0.5, 0.0, 0.5, 1.0})
    legend.marks.push_back({0.5 + 0.5 * share, formatNumber(share * scale.range, 3)});
  return legend;
}

}  // namespace hpsdf::render
