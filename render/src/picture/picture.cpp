#include "hpsdf/render/picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hpsdf/error.h"
#include "picture/arrows.h"
#include "picture/color_view.h"
#include "picture/cracks.h"
#include "picture/defect_marks.h"
#include "picture/describe.h"
#include "picture/legend.h"
#include "picture/picture_parts.h"
#include "picture/quantity.h"
#include "view/body_meshes.h"
#include "view/cells.h"
#include "view/section.h"
#include "view/view_buffers.h"

namespace hpsdf::render {
namespace {

template <typename Picture>
Frame frameOf(const Picture& picture) {
  checkPictureSize(picture.width, picture.height, picture.samples);
  Frame result = frame(picture.width, picture.height);
  if (picture.bare) {
    result.view = {0, 0, picture.width, picture.height};
    result.panel = result.caption = {};
  }
  return result;
}

Frame frameOfSurface(const SurfacePicture& picture) {
  Frame result = frameOf(picture);
  if (!picture.caption || picture.color != ColorBy::normal) return result;
  result.view.x1 = picture.width;
  result.panel = {};
  return result;
}

// Where a slice shows the domain, in pixels.
PixelRect sectionOf(const ViewBuffers& buffers, int samples) {
  PixelRect samplesHit = {buffers.width, buffers.height, 0, 0};
  for (int y = 0; y < buffers.height; ++y)
    for (int x = 0; x < buffers.width; ++x) {
      if (!buffers.hit(std::size_t(y) * buffers.width + x)) continue;
      samplesHit = {std::min(samplesHit.x0, x), std::min(samplesHit.y0, y), std::max(samplesHit.x1, x + 1), y + 1};
    }
  const auto up = [&](int sample) { return (sample + samples - 1) / samples; };
  return {samplesHit.x0 / samples, samplesHit.y0 / samples, up(samplesHit.x1), up(samplesHit.y1)};
}

// A legend beside the section itself: a square domain leaves much of a wide view empty.
void moveBeside(Frame& frame, const PixelRect& section) {
  const int space = frame.panel.x0 - section.x1 - static_cast<int>(std::ceil(0.5 * frame.textSize));
  if (frame.panel.empty() || section.empty() || space <= 0) return;
  frame.panel.x0 -= space;
  frame.panel.x1 -= space;
}

// The axis that a direction runs along, if it is one.
std::optional<char> axisAlong(const Vector3& direction) {
  for (int axis = 0; axis < 3; ++axis)
    if (direction[axis] > 0 && direction[(axis + 1) % 3] == 0 && direction[(axis + 2) % 3] == 0) return "xyz"[axis];
  return std::nullopt;
}

// None on an oblique plane: its directions have no names.
void addAxesOf(Overlay& overlay, const Frame& frame, const SliceView& view, const PixelRect& section) {
  const auto right = axisAlong(view.right), up = axisAlong(view.up);
  if (right && up && !section.empty()) addAxes(overlay, frame, section, *right, *up);
}

std::string describePlane(const std::string& name, const Plane& plane) {
  if (const auto* axis = std::get_if<AxisPlane>(&plane))
    return name + " " + "xyz"[axis->axis] + " = " + formatNumber(axis->offset);
  const auto& free = std::get<FreePlane>(plane);
  return name + " through " + formatVector(free.point) + " with normal " + formatVector(free.normal);
}

/// "2, 4–6" of ascending levels.
std::string describeRuns(const std::vector<int>& levels) {
  std::string text;
  for (std::size_t i = 0, last; i < levels.size(); i = last + 1) {
    for (last = i; last + 1 < levels.size() && levels[last + 1] == levels[last] + 1;) ++last;
    text += (i == 0 ? "" : ", ") + std::to_string(levels[i]);
    if (last > i) text += "–" + std::to_string(levels[last]);
  }
  return text;
}

std::string describeCells(const ShownCells& cells) {
  std::string text = cells.style == CellStyle::lines ? "edges of cells" : "cells";
  if (!cells.degrees.empty()) text += " of degree " + describeRuns(cells.degrees);
  if (!cells.depths.empty())
    text += std::string(cells.degrees.empty() ? " of" : ",") + " depth " + describeRuns(cells.depths);
  return text;
}

std::vector<int> levelsOf(const std::map<int, double>& shares) {
  std::vector<int> levels;
  for (const auto& [level, share] : shares) levels.push_back(level);
  return levels;
}

std::string describeLevels(const std::map<int, double>& shares) {
  const int first = shares.begin()->first, last = shares.rbegin()->first;
  return first == last ? std::to_string(first) : std::to_string(first) + "–" + std::to_string(last);
}

std::string describeBytes(std::size_t bytes) {
  char text[32];
  if (bytes < 1000000)
    std::snprintf(text, sizeof text, "%.1f kB", double(bytes) / 1e3);
  else
    std::snprintf(text, sizeof text, "%.2f MB", double(bytes) / 1e6);
  return text;
}

DistanceScale scaleOf(const ViewBuffers& buffers, const ScaleOptions& options) {
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

// Legend of degrees or depths, those of the field and `others`; gives the colours that belong to it.
LevelMap addLevels(Overlay& overlay, const Frame& frame, const FieldStatistics& figures, bool degree,
                   const std::vector<int>& others) {
  static const std::string degreeTitles[] = {"polynomial degree", "degree"};
  static const std::string depthTitles[] = {"octree depth", "depth"};
  std::map<int, double> shares = degree ? figures.degreeVolume : figures.depthVolume;
  for (const int level : others) shares.try_emplace(level, 0.0);
  LevelMap map(levelsOf(shares));
  addLevelLegend(overlay, frame, degree ? degreeTitles : depthTitles, shares, map);
  return map;
}

Legend levelLegend(const FieldStatistics& figures, bool degree, const LevelMap& map) {
  Legend legend{.title = degree ? "polynomial degree" : "octree depth"};
  const auto& shares = degree ? figures.degreeVolume : figures.depthVolume;
  for (const int level : map.levels()) {
    const auto share = shares.find(level);
    legend.levels.push_back({level, encodeSrgb(map(level)), share == shares.end() ? 0 : share->second});
  }
  return legend;
}

// Of 256 colours that colorAt gives for places 0 to 1.
std::vector<Color> barOf(const std::function<LinearColor(double)>& colorAt) {
  std::vector<Color> bar;
  for (int i = 0; i < 256; ++i) bar.push_back(encodeSrgb(colorAt(i / 255.0)));
  return bar;
}

Legend distanceLegend(const DistanceScale& scale) {
  Legend legend{.title = "signed distance", .bar = barOf([](double t) { return divergingColor(2 * t - 1); })};
  for (const double share : {-1.0, -0.5, 0.0, 0.5, 1.0})
    legend.marks.push_back({0.5 + 0.5 * share, formatNumber(share * scale.range, 3)});
  return legend;
}

Legend scaleLegend(const std::string& title, const ColorScale& scale) {
  Legend legend{.title = title, .bar = barOf(orderedColor)};
  for (const double value : scaleMarks(scale)) legend.marks.push_back({scale.place(value), formatNumber(value, 3)});
  return legend;
}

// What a quantity is called: the first that fits stands above its colour bar, the last in the caption.
std::span<const std::string> titlesOf(ColorBy quantity) {
  static const std::string valueJump[] = {"worst jump of the value", "jump of value", "value jump"};
  static const std::string gradientJump[] = {"worst jump of the gradient", "jump of gradient", "gradient jump"};
  static const std::string slope[] = {"slope error ||∇f| − 1|", "||∇f| − 1|", "slope error"};
  static const std::string error[] = {"error |f − exact|", "error"};
  static const std::string difference[] = {"difference |f − other|", "difference"};
  static const std::string cellError[] = {"estimated cell error", "cell error"};
  switch (quantity) {
    case ColorBy::valueJump:
      return valueJump;
    case ColorBy::gradientJump:
      return gradientJump;
    case ColorBy::slope:
      return slope;
    case ColorBy::error:
      return error;
    case ColorBy::difference:
      return difference;
    default:
      return cellError;
  }
}

void checkArrows(int spacing) {
  if (spacing != 0 && (spacing < 4 || spacing > 1000))
    throw Error("arrows = " + std::to_string(spacing) + " is out of range: give 4 to 1000 pixels between them, or 0");
}

// Over the finished view, under legend and caption.
template <typename View>
void addArrows(Image& image, const Frame& frame, const Field& field, const View& view, const ViewBuffers& buffers,
               int samples, int spacing) {
  if (spacing > 0)
    paintArrows(image, frame.view, gradientArrows(field, view, buffers, samples, spacing), lineWidthOf(frame));
}

void checkColor(ColorBy color, ColorBy inapplicable, const ReferenceData& reference) {
  if (color == inapplicable)
    throw Error(color == ColorBy::normal ? "a slice has no normals to light: choose another colour"
                                         : "distances are one and the same on a surface: choose another colour");
  requireReferenceData(color, reference);
}

// A quantity of a view, and the scale of its colours.
struct Measured {
  std::vector<float> values;
  ColorScale scale;
};

Measured measure(const Field& field, const ViewBuffers& buffers, const std::function<Vector3(int, int)>& pointAt,
                 ColorBy quantity, const ScaleOptions& options, const ReferenceData& reference) {
  const std::vector<double> ofCells = quantityOfCells(field, quantity, reference);
  std::vector<float> values = quantityOfSamples(field, buffers, pointAt, quantity, reference, ofCells);
  const ColorScale scale = colorScale(options, field, ofCells, values);
  return {std::move(values), scale};
}

std::string describeGreatest(const std::vector<float>& values) {
  float greatest = -1;
  for (const float value : values)
    if (value > greatest) greatest = value;
  return greatest < 0 ? "nothing shown" : "up to " + formatNumber(greatest, 3);
}

template <typename View>
std::function<Vector3(int, int)> pointsOf(const View& view, const ViewBuffers& buffers) {
  return [&](int x, int y) { return pointAt(view, buffers, x, y); };
}

template <typename View>
std::vector<float> quantityIn(const Field& field, const View& view, const ViewBuffers& buffers, ColorBy quantity,
                              const ReferenceData& reference) {
  requireReferenceData(quantity, reference);
  return quantityOfSamples(field, buffers, pointsOf(view, buffers), quantity, reference,
                           quantityOfCells(field, quantity, reference));
}

std::string describeCracks(const Cracks& cracks) {
  if (cracks.pixels == 0) return "no cracks";
  return "cracks (magenta) in " + formatCount(cracks.pixels) + (cracks.pixels == 1 ? " pixel" : " pixels") +
         ", up to " + formatNumber(cracks.widest, 3);
}

void addFieldFacts(Overlay& overlay, const Frame& frame, const Field& field, const FieldStatistics& figures) {
  static const std::string titles[] = {"hp distance field", "field"};
  const std::pair<std::string, std::string> facts[] = {
      {"cells", formatCount(figures.leaves)},
      {"degrees", describeLevels(figures.degreeVolume)},
      {"depths", describeLevels(figures.depthVolume)},
      {"coefficients", formatCount(figures.coefficients)},
      {"memory", describeBytes(figures.bytes)},
      {"RMS estimate", formatNumber(field.metadata().rmsEstimate(field.domain()), 3)},
  };
  addFacts(overlay, frame, titles, facts);
}

}  // namespace

ViewSize viewSize(int pictureWidth, int pictureHeight) {
  checkPictureSize(pictureWidth, pictureHeight, 1);
  const PixelRect view = frame(pictureWidth, pictureHeight).view;
  return {view.width(), view.height()};
}

ViewSize viewSize(const SurfacePicture& picture) {
  const PixelRect view = frameOfSurface(picture).view;
  return {view.width(), view.height()};
}

namespace {

SliceView wholeSection(const Box& domain, const Plane& plane, int width, int height) {
  if (const auto* axis = std::get_if<AxisPlane>(&plane))
    return axisSlice(domain, axis->axis, axis->offset, width, height);
  const auto& free = std::get<FreePlane>(plane);
  return planeSlice(domain, free.point, free.normal, width, height);
}

}  // namespace

SliceView sliceView(const Field& field, const SlicePicture& picture, int width, int height) {
  if (!(picture.zoom > 0) || !std::isfinite(picture.zoom))
    throw Error("zoom = " + formatNumber(picture.zoom) + " is out of range: give a number above 0");
  if (picture.target && !picture.target->allFinite())
    throw Error("the slice's target is not finite: give three coordinates");
  SliceView view = wholeSection(field.domain(), picture.plane, width, height);
  if (picture.target)
    for (const Vector3& side : {view.right, view.up})  // only within the plane: its offset stays exact
      view.origin += side * (side.dot(*picture.target - view.origin) / side.squaredNorm());
  if (picture.zoom != 1) {
    view.right /= picture.zoom;
    view.up /= picture.zoom;
  }
  return view;
}

SliceView sliceView(const Field& field, const SlicePicture& picture) {
  const PixelRect view = frameOf(picture).view;
  return sliceView(field, picture, view.width(), view.height());
}

Image draw(Renderer& renderer, const Field& field, const SlicePicture& picture, const ReferenceData& reference) {
  return drawSlice(renderer, field, picture, reference).image;
}

Drawn drawSlice(Renderer& renderer, const Field& field, const SlicePicture& picture, const ReferenceData& reference) {
  Frame frame = frameOf(picture);
  checkColor(picture.color, ColorBy::normal, reference);
  checkArrows(picture.arrows);
  const SliceView view = sliceView(field, picture);
  const int samples = picture.samples;
  ViewBuffers buffers = renderer.slice(view, frame.view.width() * samples, frame.view.height() * samples);
  const PixelRect section = sectionOf(buffers, samples);
  moveBeside(frame, section);
  const double sampleSize = view.right.norm() / buffers.width;
  const Sampling sampling{samples, lineWidthOf(frame), sampleSize};
  const FieldStatistics figures = statistics(field);

  Overlay overlay;
  Image image(picture.width, picture.height, paperColor());
  Legend legend;
  std::vector<std::string> details;
  ScaleOptions drawn = picture.scale;
  if (picture.color == ColorBy::distance) {
    const DistanceScale scale = scaleOf(buffers, picture.scale);
    if (!drawn.limits) drawn.limits = {scale.minimum, scale.maximum};
    addDistanceBar(overlay, frame, scale);
    legend = distanceLegend(scale);
    place(image, colorDistanceSlice(buffers, scale, sampling));
    details = {"distance", describePlane("slice", picture.plane),
               formatNumber(scale.minimum) + " to " + formatNumber(scale.maximum),
               "lines every " + formatNumber(scale.step)};
  } else if (isQuantity(picture.color)) {
    const Measured measured = measure(field, buffers, pointsOf(view, buffers), picture.color, picture.scale, reference);
    addScaleBar(overlay, frame, titlesOf(picture.color), measured.scale);
    drawn.limits = {measured.scale.low(), measured.scale.high()};
    legend = scaleLegend(titlesOf(picture.color).front(), measured.scale);
    place(image, colorCellSlice(buffers, quantityColors(measured.values, measured.scale), sampling));
    details = {titlesOf(picture.color).back(), describePlane("slice", picture.plane),
               describeGreatest(measured.values)};
  } else {
    const bool degree = picture.color == ColorBy::degree;
    const LevelMap map = addLevels(overlay, frame, figures, degree, picture.scale.levels);
    drawn.levels = map.levels();
    legend = levelLegend(figures, degree, map);
    place(image, colorCellSlice(buffers, levelColors(buffers, map, picture.color), sampling));
    details = {degree ? "degree" : "depth", describePlane("slice", picture.plane)};
  }
  addArrows(image, frame, field, view, buffers, samples, picture.arrows);
  addAxesOf(overlay, frame, view, section);
  details.push_back(formatCount(figures.leaves) + " cells");
  details.push_back(describeTarget(field));
  addCaption(overlay, frame, describeSource(field), details);
  paint(image, overlay);
  return {std::move(image), view, std::move(buffers), samples, !section.empty(), std::move(legend), std::move(details),
          std::move(drawn)};
}

namespace {

// What is in a picture of a surface; `lines` are its cells' edges.
struct Scene {
  ViewBuffers buffers;
  std::vector<float> lines = {};

  bool seen() const {
    return std::ranges::any_of(buffers.cell, [](std::uint32_t cell) { return cell != kNoCell; }) ||
           std::ranges::any_of(lines, [](float strength) { return strength > 0; });
  }
};

Scene sceneOf(Renderer& renderer, const Field& field, const SurfacePicture& picture, const SurfaceView& view, int width,
              int height, double lineWidth) {
  Scene scene{picture.surface ? renderer.surface(view, width, height) : emptyBuffers(width, height, true)};
  if (picture.surface) addSection(field, view, scene.buffers);
  if (picture.plane) addPlane(field, view, wholeSection(field.domain(), *picture.plane, 1, 1), scene.buffers);
  std::vector<Cell> cells;
  if (picture.cells.style != CellStyle::none) cells = chosenCells(field, picture.cells);
  if (picture.cells.style == CellStyle::boxes) addBoxes(field, view, cells, scene.buffers);
  if (picture.bodies.renderer)
    addBodies(picture.bodies.renderer->view(view.camera, picture.bodies.bodies, width, height), scene.buffers);
  if (picture.cells.style == CellStyle::lines) scene.lines = cellLines(field, view, cells, scene.buffers, lineWidth);
  return scene;
}

// Parallel rays start before the domain: bodies may be before it too.
Camera cameraBefore(const ShownBodies& bodies, const Camera& camera) {
  return bodies.renderer ? startingBefore(bodies.renderer->bounds(bodies.bodies), camera) : camera;
}

std::vector<LinearColor> materialsOf(const ShownBodies& shown) {
  std::vector<LinearColor> materials;
  for (const Body& body : shown.bodies) materials.push_back(decodeSrgb(body.color));
  return materials;
}

void addBodyDetails(const ShownBodies& shown, std::vector<std::string>& details) {
  if (!shown.renderer) return;
  if (!shown.note.empty()) details.push_back(shown.note);
  details.push_back(formatCount(shown.bodies.size()) + (shown.bodies.size() == 1 ? " body" : " bodies"));
}

}  // namespace

Image draw(Renderer& renderer, const Field& field, const SurfacePicture& picture, const ReferenceData& reference) {
  return drawSurface(renderer, field, picture, reference).image;
}

Drawn drawSurface(Renderer& renderer, const Field& field, const SurfacePicture& picture,
                  const ReferenceData& reference) {
  const Frame frame = frameOfSurface(picture);
  checkColor(picture.color, ColorBy::distance, reference);
  checkArrows(picture.arrows);
  checkOffset(picture.offset);
  checkClip(picture.clip);
  const int width = frame.view.width(), height = frame.view.height(), samples = picture.samples;
  const SurfaceView view{cameraBefore(picture.bodies, cameraOf(picture.camera, field.domain(), width, height)),
                         picture.offset, picture.clip};
  const Sampling sampling{samples, lineWidthOf(frame), 1};
  Scene scene =
      sceneOf(renderer, field, picture, view, width * samples, height * samples, sampling.lineWidth * samples);
  ViewBuffers& buffers = scene.buffers;
  const FieldStatistics figures = statistics(field);

  Overlay overlay;
  Image image = backdropPicture(picture.width, picture.height, height);
  const std::vector<LinearColor> materials = materialsOf(picture.bodies);
  const auto colorScene = [&](const SampleColor& color) {
    place(image, colorSurface(buffers, view.camera, color, sampling, picture.offset, scene.lines, materials));
  };
  Legend legend;
  const std::string surface = picture.offset == 0 ? "surface" : "offset surface at " + formatNumber(picture.offset);
  const std::string onSurface = picture.surface ? " on the " + surface : "";
  std::vector<std::string> details;
  ScaleOptions drawn = picture.scale;
  if (isQuantity(picture.color)) {
    const Measured measured = measure(field, buffers, pointsOf(view, buffers), picture.color, picture.scale, reference);
    addScaleBar(overlay, frame, titlesOf(picture.color), measured.scale);
    drawn.limits = {measured.scale.low(), measured.scale.high()};
    legend = scaleLegend(titlesOf(picture.color).front(), measured.scale);
    colorScene(quantityColors(measured.values, measured.scale));
    details = {titlesOf(picture.color).back() + onSurface, describeGreatest(measured.values)};
  } else if (picture.color == ColorBy::normal) {
    if (reference.defects)
      addSwatches(overlay, frame, kDefectTitles, defectSwatches(*reference.defects));
    else
      addFieldFacts(overlay, frame, field, figures);
    colorScene({});
    if (picture.surface) details = {surface};
  } else {
    const bool degree = picture.color == ColorBy::degree;
    const LevelMap map = addLevels(overlay, frame, figures, degree, picture.scale.levels);
    drawn.levels = map.levels();
    legend = levelLegend(figures, degree, map);
    colorScene(levelColors(buffers, map, picture.color));
    details = {(degree ? "degree" : "depth") + onSurface};
  }
  if (picture.cracks) {
    markCracks(image, buffers, sampling);
    details.push_back(describeCracks(cracksOf(buffers, picture.offset, samples)));
  }
  if (reference.defects) {
    paintDefects(image, view.camera, buffers, samples, *reference.defects, sampling.lineWidth);
    legend.defects = defectLegend(*reference.defects);
    for (const auto& [name, count, color] : legend.defects) details.push_back(name + ": " + count);
  }
  addArrows(image, frame, field, view, buffers, samples, picture.arrows);
  addBodyDetails(picture.bodies, details);
  if (picture.plane) details.push_back(describePlane("plane", *picture.plane));
  if (picture.cells.style != CellStyle::none) details.push_back(describeCells(picture.cells));
  const bool parallel = picture.camera.projection == Projection::orthographic;
  details.push_back((parallel ? "orthographic camera " : "camera ") + formatNumber(picture.camera.azimuthDegrees) +
                    "°, " + formatNumber(picture.camera.elevationDegrees) + "°" +
                    (picture.camera.target ? " at " + formatVector(*picture.camera.target) : ""));
  if (picture.clip)
    details.push_back(std::string("cut at ") + "xyz"[picture.clip->axis] + " = " + formatNumber(picture.clip->offset));
  details.push_back(formatCount(figures.leaves) + " cells");
  details.push_back(describeTarget(field));
  const Caption caption = picture.caption.value_or(Caption{describeSource(field), std::move(details)});
  addCaption(overlay, frame, caption.name, caption.details);
  paint(image, overlay);
  const bool seen = scene.seen();
  return {std::move(image), view, std::move(buffers), samples, seen, std::move(legend), caption.details,
          std::move(drawn)};
}

std::vector<float> quantityAt(const Field& field, const SliceView& view, const ViewBuffers& buffers, ColorBy quantity,
                              const ReferenceData& reference) {
  return quantityIn(field, view, buffers, quantity, reference);
}

std::vector<float> quantityAt(const Field& field, const SurfaceView& view, const ViewBuffers& buffers, ColorBy quantity,
                              const ReferenceData& reference) {
  return quantityIn(field, view, buffers, quantity, reference);
}

namespace {

// The point, or one next to it that lies in the cell: distances along rays are single precision, and a crack lies on a
// face itself.
Vector3 withinCell(const Field& field, const Vector3& point, std::uint32_t cell) {
  if (field.cellAt(point).id == cell) return point;
  for (const double step : {1e-7, 1e-6, 1e-5})
    for (int path = 0; path < 27; ++path) {
      const Vector3 direction(path % 3 - 1, path / 3 % 3 - 1, path / 9 - 1);
      const Vector3 moved = point + step * direction.cwiseProduct(field.domain().sizes());
      if (field.cellAt(moved).id == cell) return moved;
    }
  return point;
}

}  // namespace

std::optional<Pick> pickAt(const Field& field, const Drawn& drawn, int x, int y) {
  const Image& image = drawn.image;
  if (x < 0 || y < 0 || x >= image.width || y >= image.height)
    throw Error("pixel " + std::to_string(x) + "," + std::to_string(y) + " lies outside of the picture of " +
                std::to_string(image.width) + "x" + std::to_string(image.height));
  const ViewBuffers& buffers = drawn.buffers;
  const auto [left, top] = drawn.corner;
  if (x < left || y < top) return std::nullopt;
  const int column = (x - left) * drawn.samples + drawn.samples / 2;
  const int row = (y - top) * drawn.samples + drawn.samples / 2;
  if (column >= buffers.width || row >= buffers.height) return std::nullopt;
  const std::size_t i = std::size_t(row) * buffers.width + column;
  if (!buffers.hit(i)) return std::nullopt;
  const Vector3 position =
      std::visit([&](const auto& view) { return pointAt(view, buffers, column, row); }, drawn.view);
  return Pick{withinCell(field, position, buffers.cell[i]), buffers.cell[i], buffers.degree[i], buffers.depth[i],
              buffers.value[i]};
}

bool meetsWalls(const Field& field, double offset) {
  constexpr int kPoints = 40;  // along a wall's side
  const Box& domain = field.domain();
  bool below = false, above = false;
  for (int wall = 0; wall < 6; ++wall) {
    const int axis = wall / 2;
    for (int i = 0; i < kPoints; ++i)
      for (int j = 0; j < kPoints; ++j) {
        Vector3 share;  // of the way from the domain's lower corner to its upper one
        share[axis] = wall % 2;
        share[(axis + 1) % 3] = (i + 0.5) / kPoints;
        share[(axis + 2) % 3] = (j + 0.5) / kPoints;
        const double value = field.value(domain.min() + share.cwiseProduct(domain.sizes()));
        below |= value < offset;
        above |= value > offset;
      }
  }
  return below && above;
}

}  // namespace hpsdf::render
