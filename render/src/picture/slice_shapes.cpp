#include "picture/slice_shapes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "coloring/line_style.h"
#include "image/color.h"
#include "vector/cell_section.h"
#include "vector/contour_lines.h"
#include "vector/paths.h"

namespace hpsdf::render {
namespace {

constexpr double kBorderTolerance = 1e-3;  // pixels by which a border of cells may move
constexpr double kSeamWidth = 1;           // pixels
constexpr double kMostIsoLines = 1000;     // more of them would be a grey area
constexpr int kOpacitySteps = 50;          // opacities of outlines are multiples of 1 / this

/// Finds the opacity with which a line, mixed in sRGB values as SVG and PDF mix colours, looks like a line with this
/// strength that is mixed in linear light. It depends on the colour of the ground; the best one for all grounds that
/// were added is returned.
class MatchingOpacity {
 public:
  MatchingOpacity(Color line, double strength) : line_(line), strength_(float(strength)) {}

  void add(const LinearColor& ground) {
    const Color from = encodeSrgb(ground), to = encodeSrgb(mix(ground, decodeSrgb(line_), strength_));
    for (std::size_t k = 0; k < 3; ++k) {
      const double whole = double(line_[k]) - from[k];
      sum_ += whole * (double(to[k]) - from[k]);
      squares_ += whole * whole;
    }
  }

  double best() const { return squares_ > 0 ? std::clamp(sum_ / squares_, 0.0, 1.0) : double(strength_); }

 private:
  Color line_;
  float strength_;
  double sum_ = 0, squares_ = 0;
};

/// Returns the colour of an image at a point.
LinearColor groundAt(const Image& ground, const Eigen::Vector2d& point) {
  const int x = std::clamp(int(point.x()), 0, ground.width - 1), y = std::clamp(int(point.y()), 0, ground.height - 1);
  return decodeSrgb(ground.at(x, y));
}

/// Draws the cells of a slice.
class CellDrawing {
 public:
  CellDrawing(const SliceContent& slice, int width, int height)
      : slice_(slice),
        section_(cellSection(slice.field, slice.view, width, height)),
        window_(areaOf({0, 0, width, height})) {
    for (const CellSection::Part& part : section_.parts) {
      colors_.push_back(slice.cellColor ? encodeSrgb(slice.cellColor(part.cell)) : Color{});
      const Eigen::Vector2d size = part.extent.intersection(window_).sizes();
      strengths_.push_back(smoothStep(kOutlineGoneBelow * slice.sampling.lineWidth,
                                      kOutlineFadesBelow * slice.sampling.lineWidth, size.maxCoeff()));
    }
  }

  /// Returns an area for each colour. Where two areas meet, programs that smooth edges would let the paper shine
  /// through: a line below the areas hides it.
  VectorLayer areas() const {
    std::map<Color, std::vector<Link>> borders, seams;
    for (const CellSection::Edge& edge : section_.edges) {
      if (!section_.isBorder(edge) && colorOf(edge.low) == colorOf(edge.high)) continue;
      for (const int side : {edge.low, edge.high})
        if (side >= 0) borders[colorOf(side)].push_back({edge.from, edge.to});
      if (!section_.isBorder(edge)) seams[colorOf(edge.low)].push_back({edge.from, edge.to});
    }
    VectorLayer layer{"cells", {}, window_};
    for (const auto& [color, links] : seams) layer.shapes.emplace_back(StrokedShape{linesOf(links), kSeamWidth, color});
    for (const auto& [color, links] : borders) layer.shapes.emplace_back(FilledShape{linesOf(links), color});
    return layer;
  }

  VectorLayer outlines() const {
    std::map<int, std::vector<Link>> links;
    for (const CellSection::Edge& edge : section_.edges)
      if (const int step = opacityStep(edge); step > 0) links[step].push_back({edge.from, edge.to});
    VectorLayer layer{"outlines", {}, window_};
    for (const auto& [step, ofStep] : links)
      layer.shapes.emplace_back(
          StrokedShape{linesOf(ofStep), slice_.sampling.lineWidth, kOutline, double(step) / kOpacitySteps});
    return layer;
  }

 private:
  Color colorOf(int part) const { return colors_[std::size_t(part)]; }

  std::vector<Polyline> linesOf(const std::vector<Link>& links) const {
    std::vector<Polyline> lines = joinedLinks(links, section_.points);
    for (Polyline& line : lines) line = simplified(line, kBorderTolerance);
    return lines;
  }

  /// Returns the opacity of the outline along an edge, in steps.
  int opacityStep(const CellSection::Edge& edge) const {
    double strength = 0;
    for (const int side : {edge.low, edge.high})
      if (side >= 0) strength = std::max<double>(strength, strengths_[std::size_t(side)]);
    if (strength == 0) return 0;
    MatchingOpacity opacity(kOutline, kOutlineStrength * strength);
    if (slice_.cellColor) {
      for (const int side : {edge.low, edge.high})
        if (side >= 0) opacity.add(decodeSrgb(colorOf(side)));
    } else {
      const Eigen::Vector2d middle =
          0.5 * (section_.points[std::size_t(edge.from)] + section_.points[std::size_t(edge.to)]);
      opacity.add(groundAt(slice_.ground, middle));
    }
    return int(std::lround(opacity.best() * kOpacitySteps));
  }

  const SliceContent& slice_;
  CellSection section_;
  Eigen::AlignedBox2d window_;
  std::vector<Color> colors_;     ///< of the section's parts
  std::vector<float> strengths_;  ///< of the outlines of the section's parts
};

VectorLayer groundLayer(const SliceContent& slice) {
  const PixelRect& part = slice.section;
  return {"colors", {RasterShape{croppedTo(part, slice.ground), areaOf(part)}}};
}

VectorLayer isoLineLayer(const SliceContent& slice, const Eigen::AlignedBox2d& window) {
  VectorLayer layer{"iso-lines", {}, window};
  const DistanceScale& scale = *slice.distances;
  const double first = std::ceil(scale.minimum / scale.step), last = std::floor(scale.maximum / scale.step);
  for (double line = first; line <= last && last - first <= kMostIsoLines; ++line) {
    if (line == 0) continue;
    MatchingOpacity opacity(kIsoLine, kIsoStrength);
    opacity.add(slice.map->at(0.5 + 0.5 * line * scale.step / scale.range));
    layer.shapes.emplace_back(StrokedShape{contourLines(slice.buffers, slice.sampling.samples, line * scale.step),
                                           slice.sampling.lineWidth, kIsoLine, opacity.best(), true});
  }
  layer.shapes.emplace_back(StrokedShape{contourLines(slice.buffers, slice.sampling.samples, 0),
                                         kZeroWidth * slice.sampling.lineWidth, kZeroLine, 1, true});
  return layer;
}

/// Returns the line along which the plane meets the field's surface, with its casing.
VectorLayer surfaceLayer(const SliceContent& slice, const Eigen::AlignedBox2d& window) {
  std::vector<Polyline> lines = contourLines(slice.buffers, slice.sampling.samples, 0);
  MatchingOpacity opacity(kLineCasing, kLineCasingStrength);
  for (const Polyline& line : lines)
    for (const Eigen::Vector2d& point : line) opacity.add(groundAt(slice.ground, point));
  const double thin = slice.sampling.lineWidth;
  return {"surface",
          {StrokedShape{lines, kCasingWidth * thin, kLineCasing, opacity.best(), true},
           StrokedShape{std::move(lines), kSurfaceWidth * thin, kSurfaceLine, 1, true}},
          window};
}

}  // namespace

std::vector<VectorLayer> sliceLayers(const SliceContent& slice) {
  if (slice.section.empty()) return {};
  const int width = slice.buffers.width / slice.sampling.samples,
            height = slice.buffers.height / slice.sampling.samples;
  const Eigen::AlignedBox2d window = areaOf({0, 0, width, height});
  if (slice.distances != nullptr) return {groundLayer(slice), isoLineLayer(slice, window)};
  const CellDrawing cells(slice, width, height);
  return {slice.cellColor ? cells.areas() : groundLayer(slice), cells.outlines(), surfaceLayer(slice, window)};
}

Image croppedTo(const PixelRect& part, const Image& image) {
  Image result(part.width(), part.height(), Color{});
  for (int y = 0; y < result.height; ++y)
    for (int x = 0; x < result.width; ++x) result.at(x, y) = image.at(part.x0 + x, part.y0 + y);
  if (!image.alpha.empty())
    for (int y = part.y0; y < part.y1; ++y) {
      const auto row = image.alpha.begin() + std::ptrdiff_t(y) * image.width;
      result.alpha.insert(result.alpha.end(), row + part.x0, row + part.x1);
    }
  return result;
}

}  // namespace hpsdf::render
