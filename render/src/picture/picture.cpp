#include "hpsdf/render/picture.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coloring/body_shadow.h"
#include "coloring/color_view.h"
#include "coloring/picture_form.h"
#include "coloring/quantity.h"
#include "hpsdf/error.h"
#include "picture/arrows.h"
#include "picture/color_key.h"
#include "picture/cracks.h"
#include "picture/defect_marks.h"
#include "picture/describe.h"
#include "picture/legend.h"
#include "picture/slice_lines.h"
#include "picture/slice_shapes.h"
#include "scene/body_view.h"
#include "scene/cell_boxes.h"
#include "scene/cell_lines.h"
#include "scene/feature_edges.h"
#include "scene/mesh_lines.h"
#include "scene/section.h"
#include "vector/paths.h"
#include "view/supersampling.h"
#include "view/view_buffers.h"
#include "view/view_checks.h"

namespace hpsdf::render {
namespace {

constexpr float kHiddenLines = 0.12F;  // opacity of cells' edges where something hides them

/// The size of a finished view.
template <typename Picture>
ViewSize finishedSize(const Picture& picture, const Frame& frame) {
  return {enlargedLength(frame.view.width(), picture.form), enlargedLength(frame.view.height(), picture.form)};
}

template <typename Picture>
Frame frameOf(const Picture& picture) {
  checkPictureForm(picture.width, picture.height, picture.samples, picture.form);
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

/// The smallest rectangle of pixels of a slice that contains all pixels which show the domain.
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

/// The least rectangle of a picture's size that holds a rectangle of the finished picture.
PixelRect beforeEnlarging(const PixelRect& rect, const PictureForm& form) {
  const auto low = [&](int x) { return static_cast<int>(std::floor(x / form.pixelRatio)); };
  const auto high = [&](int x) { return static_cast<int>(std::ceil(x / form.pixelRatio)); };
  return {low(rect.x0), low(rect.y0), high(rect.x1), high(rect.y1)};
}

/// Returns the view of a surface as a picture of pixels: the upper rows of the image.
VectorLayer viewLayer(const Image& image, int height) {
  const PixelRect part{0, 0, image.width, height};
  return {"view", {RasterShape{croppedTo(part, image), areaOf(part)}}};
}

/// Moves the panel next to the right edge of the section, because a square domain leaves much of a wide view
/// empty.
void movePanelTo(const PixelRect& section, Frame& frame) {
  const int space = frame.panel.x0 - section.x1 - static_cast<int>(std::ceil(0.5 * frame.textSize));
  if (frame.panel.empty() || section.empty() || space <= 0) return;
  frame.panel.x0 -= space;
  frame.panel.x1 -= space;
}

/// Adds arrows that name the axes to the picture of a slice, unless the slice is oblique.
void addAxesOf(Overlay& overlay, const Frame& frame, const SliceView& view, const PixelRect& section) {
  const int right = axisAlong(view.right), up = axisAlong(view.up);
  if (right >= 0 && up >= 0 && !section.empty()) addAxes(overlay, frame, section, "xyz"[right], "xyz"[up]);
}

void checkArrows(int spacing) {
  if (spacing != 0 && (spacing < 4 || spacing > 1000))
    throw Error("arrows = " + std::to_string(spacing) + " is out of range: give 4 to 1000 pixels between them, or 0");
}

/// Draws arrows along the gradient over the finished view. The legend and the caption are painted later, over the
/// arrows.
void addArrows(Image& image, const std::vector<Arrow>& arrows, const ViewBuffers& buffers, const Sampling& sampling) {
  const PixelRect view{0, 0, buffers.width / sampling.samples, buffers.height / sampling.samples};
  paintArrows(image, view, arrows, sampling.lineWidth);
}

/// The arrows along the gradient that a picture shows.
std::vector<Arrow> arrowsOf(const Field& field, const auto& view, const ViewBuffers& buffers, const auto& picture) {
  if (picture.arrows == 0) return {};
  return gradientArrows(field, view, buffers, picture.samples, enlargedLength(picture.arrows, picture.form));
}

void checkColor(ColorBy color, ColorBy inapplicable, const ReferenceData& reference) {
  if (color == inapplicable)
    throw Error(color == ColorBy::normal ? "a slice has no normals to light: choose another colour"
                                         : "distances are one and the same on a surface: choose another colour");
  requireReferenceData(color, reference);
}

std::function<Vector3(int, int)> pointsOf(const View& view, const ViewBuffers& buffers) {
  return [&](int x, int y) {
    return std::visit([&](const auto& plainView) { return pointAt(plainView, buffers, x, y); }, view);
  };
}

/// A view of the domain's section with a plane, framed for width × height pixels.
SliceView sectionView(const Box& domain, const Plane& plane, int width, int height) {
  if (const auto* axis = std::get_if<AxisPlane>(&plane))
    return axisSlice(domain, axis->axis, axis->offset, width, height);
  const auto& free = std::get<FreePlane>(plane);
  return planeSlice(domain, free.point, free.normal, width, height);
}

/// The view and the buffers of a picture of a surface, with all parts of the scene: surface, sections, cells and
/// bodies.
struct Scene {
  SurfaceView view;
  ViewBuffers buffers;
  std::vector<float> lines = {};  ///< share of each sample, 0 to 1, that lines cover; empty if none are drawn

  /// Returns true if any pixel shows a cell of the field or a line along the edge of a cell.
  bool showsField() const {
    return std::ranges::any_of(buffers.cell, [](std::uint32_t cell) { return cell != kNoCell; }) ||
           std::ranges::any_of(lines, [](float strength) { return strength > 0; });
  }
};

/// Adds lines to those that a scene already has. Where both cover a sample, the stronger ones are seen.
void addLines(std::vector<float> added, std::vector<float>& lines) {
  for (std::size_t i = 0; i < lines.size(); ++i) added[i] = std::max(added[i], lines[i]);
  lines = std::move(added);
}

/// Returns the buffers of the surface that a picture shows. Where colours show a quantity, its values belong to the
/// points of the surface themselves, so that all samples are traced.
ViewBuffers surfaceOf(Renderer& renderer, const SurfaceView& view, const SurfacePicture& picture, int width,
                      int height) {
  const int samples = picture.samples;
  if (!picture.surface) return emptyBuffers(samples * width, samples * height, true);
  if (isQuantity(picture.color)) return renderer.surface(view, samples * width, samples * height);
  const bool showsCells = picture.color != ColorBy::normal || picture.cracks;
  return supersampledSurface(renderer, view, width, height, samples, showsCells);
}

/// Renders a view of width × height pixels, with `picture.samples` samples along each side of a pixel. Lines
/// along cells and along the edges of `mesh` are `lineWidth` pixels wide. Throws `Error` if the camera, the offset or
/// the clipping plane is out of range.
Scene renderScene(Renderer& renderer, const Field& field, const SurfacePicture& picture, const ShownMesh& mesh,
                  int width, int height, double lineWidth) {
  checkOffset(picture.offset);
  checkClip(picture.clip);
  const ShownBodies& bodies = picture.bodies;
  Camera camera = cameraOf(picture.camera, field.domain(), width, height);
  // Parallel rays start in front of the domain. Move their start back to lie in front of the bodies too.
  if (bodies.renderer) camera = startingBefore(bodies.renderer->bounds(bodies.bodies), camera);
  const SurfaceView view{camera, picture.offset, picture.clip};
  Scene scene{view, {}};
  scene.buffers = surfaceOf(renderer, view, picture, width, height);
  width *= picture.samples;
  height *= picture.samples;
  lineWidth *= picture.samples;
  if (picture.surface) addSection(field, view, scene.buffers);
  if (picture.plane) addPlane(field, view, sectionView(field.domain(), *picture.plane, 1, 1), scene.buffers);
  std::vector<Cell> cells;
  if (picture.cells.style != CellStyle::none) cells = chosenCells(field, picture.cells, picture.offset);
  if (picture.cells.style == CellStyle::boxes) addBoxes(field, view, cells, scene.buffers);
  if (bodies.renderer) addBodies(bodies.renderer->view(view.camera, bodies.bodies, width, height), scene.buffers);
  if (picture.edges) scene.lines = featureEdges(view, scene.buffers, lineWidth);
  if (picture.cells.style == CellStyle::lines)
    addLines(cellLines(field, view, cells, scene.buffers, lineWidth, kHiddenLines), scene.lines);
  if (mesh.mesh != nullptr)
    addLines(meshLines(*mesh.mesh, mesh.tolerance, field.domain(), view, scene.buffers, lineWidth), scene.lines);
  return scene;
}

/// Adds facts about the field to the panel, in place of the legend of a picture without a colour scale.
void addFieldFacts(Overlay& overlay, const Frame& frame, const Field& field, const FieldStatistics& figures) {
  static const std::string titles[] = {"hp distance field", "field"};
  std::vector<std::pair<std::string, std::string>> facts = {{"cells", formatCount(figures.leaves)}};
  if (!frame.roomy) {  // there are no bars
    facts.emplace_back("degrees", describeLevels(figures.degreeVolume));
    facts.emplace_back("depths", describeLevels(figures.depthVolume));
  }
  facts.emplace_back("coefficients", formatCount(figures.coefficients));
  facts.emplace_back("memory", describeBytes(figures.bytes));
  if (const std::optional<Measurement>& m = field.metadata().measurement) {
    facts.emplace_back(frame.roomy ? "RMS error near surface" : "near RMS", formatNumber(m->near.rms, 3));
    facts.emplace_back(frame.roomy ? "max error near surface" : "near max", formatNumber(m->near.max, 3));
  }
  const double top = addFacts(overlay, frame, titles, facts);
  if (!frame.roomy) return;
  const double next = addShares(overlay, frame, top, "degrees by volume", figures.degreeVolume);
  addShares(overlay, frame, next, "depths by volume", figures.depthVolume);
}

/// The colours of a slice: those of cells or samples, or those of distances.
struct SliceColors {
  ColorKey key = {};
  std::optional<DistanceScale> distances = {};
  const ColorMap* map = nullptr;  ///< the colour map of distances
};

/// Chooses the colours of a slice. Adds their legend to the overlay, and to `drawn` the legend, the scale and the first
/// details of the caption.
SliceColors sliceColors(Overlay& overlay, const Frame& frame, const Field& field, const FieldStatistics& figures,
                        const SlicePicture& picture, const ReferenceData& reference, Drawn& drawn) {
  const ViewBuffers& buffers = drawn.buffers;
  const std::string plane = describePlane("slice", picture.plane);
  SliceColors colors;
  if (picture.color == ColorBy::distance) {
    const DistanceScale scale = distanceScaleFor(buffers, picture.scale);
    if (!drawn.scale.limits) drawn.scale.limits = {scale.minimum, scale.maximum};
    colors.map = &colorMap(MapKind::diverging, picture.scale.map);
    addDistanceBar(overlay, frame, scale, *colors.map);
    drawn.legend = distanceLegend(scale, *colors.map);
    drawn.details = {"distance", plane, formatNumber(scale.minimum) + " to " + formatNumber(scale.maximum),
                     "lines every " + formatNumber(scale.step)};
    colors.key.color = distanceColors(buffers, scale, *colors.map);
    colors.distances = scale;
    return colors;
  }
  colors.key = makeColorKey(overlay, frame, field, figures, buffers, pointsOf(drawn.view, buffers), picture.color,
                            picture.scale, reference);
  drawn.legend = colors.key.legend;
  drawn.scale = colors.key.scale;
  drawn.details = {colors.key.name, plane};
  if (!colors.key.range.empty()) drawn.details.push_back(colors.key.range);
  return colors;
}

/// Returns the layers of a slice in a vector picture, without the legend and the caption. The colours of `slice` are
/// those of `colors`.
std::vector<VectorLayer> layersOfSlice(SliceContent slice, const SliceColors& colors, const std::vector<Arrow>& arrows,
                                       const PictureForm& form, const ReferenceData& reference) {
  slice.ground = finished(form, [&](const std::optional<Color>& paper) {
    Sampling sampling = slice.sampling;
    sampling.paper = paper;
    return colorGround(slice.buffers, colors.key.color, sampling);
  });
  slice.cellColor = colors.key.cellColor;
  slice.distances = colors.distances ? &*colors.distances : nullptr;
  slice.map = colors.map;
  std::vector<VectorLayer> layers = sliceLayers(slice);
  const int width = slice.ground.width, height = slice.ground.height;
  const double lineWidth = slice.sampling.lineWidth;
  const Eigen::AlignedBox2d window = areaOf({0, 0, width, height});
  layers.push_back(
      {"lines", sliceLineShapes(slice.field, slice.view, slice.section, width, height, reference, lineWidth), window});
  layers.push_back({"arrows", arrowShapes(arrows, lineWidth), window});
  return layers;
}

/// Chooses the colours of a surface. Adds their legend, or facts about the field, to the overlay, and to `drawn` the
/// legend, the scale and the first details of the caption.
SampleColor surfaceColors(Overlay& overlay, const Frame& frame, const Field& field, const FieldStatistics& figures,
                          const SurfacePicture& picture, const ReferenceData& reference, const ViewBuffers& buffers,
                          Drawn& drawn) {
  const std::string surface = picture.offset == 0 ? "surface" : "offset surface at " + formatNumber(picture.offset);
  if (picture.color == ColorBy::normal) {
    if (reference.defects)
      addSwatches(overlay, frame, kDefectTitles, defectSwatches(*reference.defects));
    else
      addFieldFacts(overlay, frame, field, figures);
    if (picture.surface) drawn.details.push_back(surface);
    return {};
  }
  ColorKey key = makeColorKey(overlay, frame, field, figures, buffers, pointsOf(drawn.view, buffers), picture.color,
                              picture.scale, reference);
  drawn.legend = key.legend;
  drawn.scale = key.scale;
  drawn.details.push_back(key.name + (picture.surface ? " on the " + surface : ""));
  if (!key.range.empty()) drawn.details.push_back(key.range);
  return std::move(key.color);
}

std::vector<LinearColor> materialsOf(const ShownBodies& shown) {
  std::vector<LinearColor> materials;
  for (const Body& body : shown.bodies) materials.push_back(decodeSrgb(body.color));
  return materials;
}

/// Returns the materials and the light of a scene.
SurfaceLook lookOf(const Field& field, const SurfacePicture& picture, const Scene& scene, SampleColor color) {
  SurfaceLook look{.color = std::move(color),
                   .bodies = materialsOf(picture.bodies),
                   .lightTilt = lightTiltOf(picture.camera.elevationDegrees)};
  if (!picture.shadows || !picture.surface) return look;
  // Planes and cells beside the surface throw no shadow, so that a shadow on the ground would mislead.
  const bool hasBodies = picture.bodies.renderer != nullptr;
  const bool isAlone = !picture.plane && picture.cells.style == CellStyle::none && !hasBodies;
  const ShadowCaster caster{field, scene.view, picture.camera.up, isAlone, hasBodies};
  const Vector3 toKey = directionToKey(scene.view.camera, look.lightTilt);
  look.light = fieldLight(caster, scene.buffers, picture.samples, toKey);
  if (hasBodies)
    throwShadows(*picture.bodies.renderer, picture.bodies.bodies, scene.view, scene.buffers, toKey,
                 field.domain().diagonal().norm(), look.light.lit);
  return look;
}

/// Adds details to the caption of a surface's picture: about bodies, plane, drawn cells, camera and clipping plane.
void addSceneDetails(const SurfacePicture& picture, std::vector<std::string>& details) {
  if (picture.bodies.renderer) {
    if (!picture.bodies.note.empty()) details.push_back(picture.bodies.note);
    const std::size_t count = picture.bodies.bodies.size();
    details.push_back(formatCount(count) + (count == 1 ? " body" : " bodies"));
  }
  if (picture.plane) details.push_back(describePlane("plane", *picture.plane));
  if (picture.cells.style != CellStyle::none) details.push_back(describeCells(picture.cells));
  details.push_back(describeCamera(picture.camera));
  if (picture.clip) details.push_back(describePlane("cut at", AxisPlane{picture.clip->axis, picture.clip->offset}));
}

void addFieldDetails(const Field& field, const FieldStatistics& figures, std::vector<std::string>& details) {
  details.push_back(formatCount(figures.leaves) + " cells");
  details.push_back(describeTarget(field));
}

}  // namespace

ViewSize viewSize(const SurfacePicture& picture) { return finishedSize(picture, frameOfSurface(picture)); }

SliceView sliceView(const Field& field, const SlicePicture& picture, int width, int height) {
  if (!(picture.zoom > 0) || !std::isfinite(picture.zoom))
    throw Error("zoom = " + formatNumber(picture.zoom) + " is out of range: give a number above 0");
  if (picture.target && !picture.target->allFinite())
    throw Error("the slice's target is not finite: give three coordinates");
  SliceView view = sectionView(field.domain(), picture.plane, width, height);
  // Centre the view at the target, but move it only within its plane, so that the plane's offset stays exact.
  if (picture.target)
    for (const Vector3& side : {view.right, view.up})
      view.origin += side * (side.dot(*picture.target - view.origin) / side.squaredNorm());
  if (picture.zoom != 1) {
    view.right /= picture.zoom;
    view.up /= picture.zoom;
  }
  return view;
}

SliceView sliceView(const Field& field, const SlicePicture& picture) {
  const ViewSize size = finishedSize(picture, frameOf(picture));
  return sliceView(field, picture, size.width, size.height);
}

Image draw(Renderer& renderer, const Field& field, const SlicePicture& picture, const ReferenceData& reference) {
  return drawSlice(renderer, field, picture, reference).image;
}

Image draw(Renderer& renderer, const Field& field, const SurfacePicture& picture, const ReferenceData& reference) {
  return drawSurface(renderer, field, picture, reference).image;
}

Drawn drawSlice(Renderer& renderer, const Field& field, const SlicePicture& picture, const ReferenceData& reference) {
  // Lay out the picture, check its options, and render the buffers of its view.
  Frame frame = frameOf(picture);
  checkColor(picture.color, ColorBy::normal, reference);
  checkArrows(picture.arrows);
  const int samples = picture.samples;
  const ViewSize size = finishedSize(picture, frame);
  const int width = size.width, height = size.height;
  const SliceView view = sliceView(field, picture);
  Drawn drawn{.image = {},
              .view = view,
              .buffers = renderer.slice(view, width * samples, height * samples),
              .samples = samples,
              .scale = picture.scale};
  const ViewBuffers& buffers = drawn.buffers;
  const PixelRect section = sectionOf(buffers, samples);
  const PixelRect sectionInFrame = beforeEnlarging(section, picture.form);
  drawn.seen = !section.empty();
  movePanelTo(sectionInFrame, frame);

  // Choose the colours and the legend, and collect the caption's details about the colours.
  const FieldStatistics figures = statistics(field);
  const std::vector<Legend::Line> lines = lineLegend(reference);
  Overlay overlay;
  addLineLegend(overlay, frame, lines);
  const SliceColors colors = sliceColors(overlay, frame, field, figures, picture, reference, drawn);
  drawn.legend.lines = lines;

  // Add the axes and the caption to the overlay.
  if (!reference.outlined.empty())
    drawn.details.insert(drawn.details.begin() + 2, "dashed where they do not bound the solid");
  addAxesOf(overlay, frame, view, sectionInFrame);
  addFieldDetails(field, figures, drawn.details);
  addCaption(overlay, frame, describeSource(field), drawn.details);
  overlay = enlarged(std::move(overlay), picture.form.pixelRatio);

  // Draw the view, the lines, the arrows and the overlay.
  Sampling sampling{samples, frame.lineWidth() * picture.form.pixelRatio, view.right.norm() / buffers.width};
  const std::vector<Arrow> arrows = arrowsOf(field, view, buffers, picture);
  drawn.image = finished(picture.form, [&](const std::optional<Color>& paper) {
    Image image(enlargedLength(picture.width, picture.form), enlargedLength(picture.height, picture.form),
                paper.value_or(paperColor()));
    sampling.paper = paper;
    pasteView(image, colors.distances ? colorDistanceSlice(buffers, *colors.distances, *colors.map, sampling)
                                      : colorCellSlice(buffers, colors.key.color, sampling));
    paintSliceLines(image, field, view, section, width, height, reference, sampling.lineWidth);
    addArrows(image, arrows, buffers, sampling);
    paint(image, overlay);
    return image;
  });
  if (picture.form.vectors) {
    sampling.paper = {};
    std::vector<VectorLayer> layers =
        layersOfSlice({field, view, buffers, sampling, section}, colors, arrows, picture.form, reference);
    layers.push_back(overlayLayer(overlay));
    drawn.vectors = vectorPicture(drawn.image, picture.form, std::move(layers));
  }
  return drawn;
}

Drawn drawSurface(Renderer& renderer, const Field& field, const SurfacePicture& picture,
                  const ReferenceData& reference) {
  // Lay out the picture, check its options, and render the buffers of its view.
  const Frame frame = frameOfSurface(picture);
  checkColor(picture.color, ColorBy::distance, reference);
  checkArrows(picture.arrows);
  const int samples = picture.samples;
  const ViewSize size = finishedSize(picture, frame);
  const int width = size.width, height = size.height;
  Sampling sampling{samples, frame.lineWidth() * picture.form.pixelRatio, 1};
  Scene scene = renderScene(renderer, field, picture, reference.mesh, width, height, sampling.lineWidth);
  const ViewBuffers& buffers = scene.buffers;
  const Camera& camera = scene.view.camera;
  Drawn drawn{.image = {},
              .view = scene.view,
              .buffers = {},
              .samples = samples,
              .seen = scene.showsField(),
              .scale = picture.scale};

  // Choose the colours and the legend.
  const FieldStatistics figures = statistics(field);
  Overlay overlay;
  SampleColor color = surfaceColors(overlay, frame, field, figures, picture, reference, buffers, drawn);

  // Add the details about marks and scene, and the caption.
  if (picture.cracks) drawn.details.push_back(describeCracks(cracksOf(buffers, picture.offset, samples)));
  if (reference.defects) {
    drawn.legend.defects = defectLegend(*reference.defects);
    for (const auto& [name, count, shade] : drawn.legend.defects) drawn.details.push_back(name + ": " + count);
  }
  addSceneDetails(picture, drawn.details);
  addFieldDetails(field, figures, drawn.details);
  const Caption caption = picture.caption.value_or(Caption{describeSource(field), std::move(drawn.details)});
  addCaption(overlay, frame, caption.name, caption.details);
  drawn.details = caption.details;
  overlay = enlarged(std::move(overlay), picture.form.pixelRatio);

  // Draw the view with its marks and arrows, then the overlay.
  const SurfaceLook look = lookOf(field, picture, scene, std::move(color));
  const std::vector<Arrow> arrows = arrowsOf(field, scene.view, buffers, picture);
  const Image shown = finished(picture.form, [&](const std::optional<Color>& paper) {
    Image image = backdropPicture(enlargedLength(picture.width, picture.form),
                                  enlargedLength(picture.height, picture.form), height);
    if (paper) image.pixels.assign(image.pixels.size(), *paper);
    sampling.paper = paper;
    pasteView(image, colorSurface(buffers, camera, look, sampling, picture.offset, scene.lines));
    if (picture.cracks) markCracks(image, buffers, sampling);
    if (reference.defects) paintDefects(image, camera, buffers, samples, *reference.defects, sampling.lineWidth);
    addArrows(image, arrows, buffers, sampling);
    if (!picture.form.vectors) paint(image, overlay);
    return image;
  });
  drawn.image = shown;
  if (picture.form.vectors) {
    drawn.vectors = vectorPicture(shown, picture.form, {viewLayer(shown, height), overlayLayer(overlay)});
    paint(drawn.image, overlay);
  }
  drawn.buffers = std::move(scene.buffers);
  return drawn;
}

std::vector<float> quantityAt(const Field& field, const View& view, const ViewBuffers& buffers, ColorBy quantity,
                              const ReferenceData& reference) {
  requireReferenceData(quantity, reference);
  return quantityOfSamples(field, buffers, pointsOf(view, buffers), quantity, reference,
                           quantityOfCells(field, quantity, reference));
}

namespace {

/// Moves a point into its cell if it lies outside by a rounding error. Distances along rays have only single
/// precision, and the point of a crack lies on a face of the cell.
Vector3 withinCell(const Field& field, const Vector3& point, std::uint32_t cell) {
  if (field.cellAt(point).id == cell) return point;
  for (const double step : {1e-7, 1e-6, 1e-5})
    for (int n = 0; n < 27; ++n) {
      const Vector3 direction(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
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
  const Vector3 position = withinCell(field, pointsOf(drawn.view, buffers)(column, row), buffers.cell[i]);
  const Cell cell = field.cellAt(position);
  if (cell.id == buffers.cell[i])
    return Pick{position, buffers.cell[i], buffers.degree[i], buffers.depth[i], buffers.value[i]};
  // An interpolated sample has the cell of the middle of its pixel, which may end before it.
  return Pick{position, cell.id, cell.degree, cell.depth, buffers.value[i]};
}

bool meetsWalls(const Field& field, double offset) {
  constexpr int kPoints = 40;  // number of test points along each side of a wall
  const Box& domain = field.domain();
  bool below = false, above = false;
  for (int wall = 0; wall < 6; ++wall) {
    const int axis = wall / 2;
    for (int i = 0; i < kPoints; ++i)
      for (int j = 0; j < kPoints; ++j) {
        Vector3 t;  // coordinates in which the domain is [0, 1]³
        t[axis] = wall % 2;
        t[(axis + 1) % 3] = (i + 0.5) / kPoints;
        t[(axis + 2) % 3] = (j + 0.5) / kPoints;
        const double value = field.value(domain.min() + t.cwiseProduct(domain.sizes()));
        below |= value < offset;
        above |= value > offset;
      }
  }
  return below && above;
}

}  // namespace hpsdf::render
