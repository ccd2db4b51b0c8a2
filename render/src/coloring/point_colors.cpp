#include "hpsdf/render/point_colors.h"

#include <map>

#include "coloring/quantity.h"
#include "hpsdf/error.h"
#include "image/colormap.h"

namespace hpsdf::render {
namespace {

PointColors colorsOfLevels(const Field& field, std::span<const Vector3> points, ColorBy color,
                           const ScaleOptions& options) {
  const FieldStatistics figures = statistics(field);
  std::map<int, double> shares = color == ColorBy::degree ? figures.degreeVolume : figures.depthVolume;
  for (const int level : options.levels) shares.try_emplace(level, 0.0);
  PointColors result{.colors = {}, .scale = options};
  result.scale.levels.clear();
  for (const auto& [level, share] : shares) result.scale.levels.push_back(level);
  for (const Vector3& point : points) {
    const Cell cell = field.cellAt(point);
    result.colors.push_back(levelColor(color == ColorBy::degree ? cell.degree : cell.depth));
  }
  return result;
}

PointColors colorsOfQuantity(const Field& field, std::span<const Vector3> points, ColorBy quantity,
                             const ScaleOptions& options, const ReferenceData& reference) {
  const std::vector<double> ofCells = quantityOfCells(field, quantity, reference);
  const std::vector<float> values = quantityOfPoints(field, points, quantity, reference, ofCells);
  const ColorScale scale = colorScale(options, field, ofCells, values);
  PointColors result{.colors = {}, .scale = options};
  result.scale.limits = {scale.low(), scale.high()};
  for (const float value : values) result.colors.push_back(encodeSrgb(scale(value)));
  return result;
}

}  // namespace

PointColors pointColors(const Field& field, std::span<const Vector3> points, ColorBy color, const ScaleOptions& options,
                        const ReferenceData& reference) {
  if (color == ColorBy::normal || color == ColorBy::distance)
    throw Error("points have no colours of normals or distances: choose another colour");
  requireReferenceData(color, reference);
  return isQuantity(color) ? colorsOfQuantity(field, points, color, options, reference)
                           : colorsOfLevels(field, points, color, options);
}

}  // namespace hpsdf::render
