#include "pictures/picture_arguments.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "console/console.h"
#include "hpsdf/error.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

using render::ColorBy;

/// Returns a list of the colour modes that show a quantity, in words such as "slope, error and difference".
std::string quantityNames() {
  std::vector<std::string_view> names;
  for (const render::ColorMode& mode : render::colorModes())
    if (render::isQuantity(mode.color)) names.push_back(mode.name);
  const std::string_view last = names.back();
  names.pop_back();
  return fmt::format("{} and {}", fmt::join(names, ", "), last);
}

/// Returns the kind of the colour maps that suit a colour mode. Returns std::nullopt if its colours are fixed.
std::optional<render::MapKind> mapKind(ColorBy color) {
  if (color == ColorBy::distance) return render::MapKind::diverging;
  return render::isQuantity(color) ? std::optional(render::MapKind::ordered) : std::nullopt;
}

struct NamedView {
  std::string_view name;
  double azimuthDegrees, elevationDegrees;
};
constexpr NamedView kViews[] = {{"front", 0, 0},
                                {"back", 180, 0},
                                {"left", -90, 0},
                                {"right", 90, 0},
                                {"top", 0, 90},
                                {"bottom", 0, -90},
                                {"corner", 45, 35.264389682754654}};

render::ShownCells shownCells(const Arguments& arguments) {
  const std::string style = arguments.text("cells");
  for (const char* name : {"degrees", "depths", "at-surface"})
    if (style == "none" && arguments.given(name))
      throw Error(fmt::format("{}: needs cells=lines or cells=boxes, of which it chooses some", name));
  return {cellStyle(style), levelList(arguments.textOr("degrees", ""), "degrees", kMaxDegree),
          levelList(arguments.textOr("depths", ""), "depths", kMaxDepth), arguments.flag("at-surface")};
}

render::FreePlane freePlane(const std::vector<double>& n) { return {{n[0], n[1], n[2]}, {n[3], n[4], n[5]}}; }

render::AxisPlane axisPlane(const Arguments& arguments, const char* axisName, const char* offsetName, const Box& box) {
  const int axis = arguments.text(axisName)[0] - 'x';
  return {axis, arguments.given(offsetName) ? arguments.number(offsetName) : defaultOffset(box, axis)};
}

std::string targetText(const std::optional<Vector3>& target) { return target ? coordinatesText(*target) : "center"; }

std::string planeText(const render::Plane& plane) {
  if (const auto* free = std::get_if<render::FreePlane>(&plane))
    return fmt::format("through={},{}", coordinatesText(free->point), coordinatesText(free->normal));
  const auto& axis = std::get<render::AxisPlane>(plane);
  return fmt::format("axis={} offset={}", "xyz"[axis.axis], axis.offset);
}

/// Sets the size of a picture and its number of samples per pixel.
template <typename Picture>
void setPixels(Picture& picture, const Arguments& arguments) {
  picture.width = arguments.size("size")[0];
  picture.height = arguments.size("size")[1];
  picture.samples = arguments.whole("samples");
}

/// Returns the plane that `render` draws, given by six numbers or by an axis with an offset. Returns
/// std::nullopt if no plane is given.
std::optional<render::Plane> scenePlane(const Arguments& arguments, const Box& box) {
  if (!arguments.given("plane")) {
    if (arguments.given("plane-offset")) throw Error("plane-offset: needs plane, the axis that it lies on");
    return std::nullopt;
  }
  if (const auto numbers = arguments.numbers("plane"); !numbers.empty()) {
    if (arguments.given("plane-offset"))
      throw Error("plane-offset: is for a plane across an axis; a point and a normal tell where theirs lies");
    return freePlane(numbers);
  }
  return axisPlane(arguments, "plane", "plane-offset", box);
}

}  // namespace

std::vector<std::string> viewNames() {
  std::vector<std::string> names;
  for (const NamedView& view : kViews) names.emplace_back(view.name);
  return names;
}

void turnTo(render::OrbitCamera& camera, std::string_view view) {
  const NamedView& named = *std::ranges::find(kViews, view, &NamedView::name);
  camera.azimuthDegrees = named.azimuthDegrees;
  camera.elevationDegrees = named.elevationDegrees;
}

std::string viewName(const render::OrbitCamera& camera) {
  for (const NamedView& view : kViews)
    if (view.azimuthDegrees == camera.azimuthDegrees && view.elevationDegrees == camera.elevationDegrees)
      return std::string(view.name);
  return {};
}

std::string upName(const render::OrbitCamera& camera) { return camera.up == render::UpAxis::y ? "y" : "z"; }

std::vector<std::string> colorNames(std::optional<ColorBy> without) {
  std::vector<std::string> names;
  for (const render::ColorMode& mode : render::colorModes())
    if (mode.color != without) names.push_back(mode.name);
  return names;
}

std::string quantityHelp() {
  std::vector<std::string_view> explanations;
  for (const render::ColorMode& mode : render::colorModes())
    if (!mode.explanation.empty()) explanations.push_back(mode.explanation);
  return fmt::format("{}.", fmt::join(explanations, ", "));
}

std::string_view colorName(ColorBy color) { return render::colorModes()[std::size_t(color)].name; }

std::vector<std::string> mapNames(std::optional<ColorBy> color) {
  std::vector<std::string> names;
  for (const render::ColorMap& map : render::colorMaps())
    if (!color || map.kind == mapKind(*color)) names.push_back(map.name);
  return names;
}

void checkMap(const std::string& map, ColorBy color) {
  if (map.empty()) return;
  const std::vector<std::string> names = mapNames(color);
  if (names.empty())
    throw Error(fmt::format("map: color {} has no map; it is for distance, {}", colorName(color), quantityNames()));
  if (std::ranges::find(names, map) == names.end())
    throw Error(
        fmt::format("map: {} does not suit color {}; choose one of {}", map, colorName(color), fmt::join(names, ", ")));
}

/// Returns the colour mode of this name. The search always succeeds, because the registry accepts only `colorNames`.
ColorBy colorNamed(std::string_view name) {
  return std::ranges::find(render::colorModes(), name, &render::ColorMode::name)->color;
}

render::CellStyle cellStyle(std::string_view name) {
  return name == "lines"   ? render::CellStyle::lines
         : name == "boxes" ? render::CellStyle::boxes
                           : render::CellStyle::none;
}

std::string cellStyleName(render::CellStyle style) {
  return style == render::CellStyle::lines ? "lines" : style == render::CellStyle::boxes ? "boxes" : "none";
}

std::string levelText(const std::vector<int>& levels) {
  if (levels.empty()) return "all";
  std::vector<std::string> names;
  for (const int level : levels) names.push_back(levelName(level));
  return fmt::format("{}", fmt::join(names, ","));
}

std::string cameraLine(const render::OrbitCamera& camera) {
  return fmt::format("camera {},{},{} target={} up={} projection={}\n", camera.azimuthDegrees, camera.elevationDegrees,
                     camera.distance, targetText(camera.target), upName(camera),
                     camera.projection == render::Projection::perspective ? "perspective" : "orthographic");
}

std::string viewScript(const render::SlicePicture& picture) {
  return fmt::format("show slice\nplane {} zoom={} target={}\ncolor {} of=slice\n", planeText(picture.plane),
                     picture.zoom, targetText(picture.target), colorName(picture.color));
}

std::string viewScript(const render::SurfacePicture& picture) {
  std::string script = "show surface\n" + cameraLine(picture.camera) + fmt::format("surface offset={}", picture.offset);
  if (picture.clip) script += fmt::format(" clip={} clip-offset={}", "xyz"[picture.clip->axis], picture.clip->offset);
  if (picture.plane) script += fmt::format("\nplane {} in-space=true", planeText(*picture.plane));
  return script + fmt::format("\ncells {} depths={}\ncolor {} of=surface\n", cellStyleName(picture.cells.style),
                              levelText(picture.cells.depths), colorName(picture.color));
}

std::vector<int> levelList(const std::string& text, const char* name, int most) {
  if (text.empty()) return {};
  const auto refuse = [&] {
    throw Error(
        fmt::format("{}: expected whole numbers and ranges from 0 to {} with commas between them, as in 2,4-6; "
                    "found '{}'",
                    name, most, text));
  };
  const auto level = [&](std::string_view word) {
    if (most == kMaxDegree && word == levelName(kExactDegree)) return kExactDegree;
    const auto number = parseNumber(word);
    if (!number || *number != std::floor(*number) || !(*number >= 0 && *number <= most)) refuse();
    return static_cast<int>(*number);
  };
  std::vector<int> levels;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t end = std::min(text.find(',', start), text.size());
    const std::string_view part = std::string_view(text).substr(start, end - start);
    const std::size_t dash = part.find('-');
    const int first = level(part.substr(0, dash));
    const int last = dash == std::string_view::npos ? first : level(part.substr(dash + 1));
    if (first > last || (last == kExactDegree && first != last)) refuse();
    for (int i = first; i <= last; ++i) levels.push_back(i);
    start = end + 1;
  }
  std::ranges::sort(levels);
  levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
  return levels;
}

Vector3 pointOf(const Arguments& arguments, const char* name) {
  const auto p = arguments.numbers(name);
  return {p[0], p[1], p[2]};
}

render::ScaleOptions scaleOptions(const Arguments& arguments) {
  render::ScaleOptions options{.logarithmic = arguments.text("scale") == "log"};
  const ColorBy color = colorNamed(arguments.text("color"));
  for (const char* name : {"range", "scale"})
    if (arguments.given(name) && !render::isQuantity(color) &&
        !(color == ColorBy::distance && name == std::string_view("range")))
      throw Error(
          fmt::format("{}: the colours of {} have none; it is for {}", name, arguments.text("color"), quantityNames()));
  options.map = arguments.textOr("map", "");
  checkMap(options.map, color);
  if (arguments.given("mesh") && color != ColorBy::error)
    throw Error(fmt::format("mesh: is for color error, not {}", arguments.text("color")));
  if (arguments.given("other") && color != ColorBy::difference)
    throw Error(fmt::format("other: is for color difference, not {}", arguments.text("color")));
  if (!arguments.given("other") && color == ColorBy::difference)
    throw Error("color difference: needs other, the file of the field to compare with");
  if (arguments.given("range")) {
    const auto limits = arguments.numbers("range");
    options.limits = {limits[0], limits[1]};
  }
  return options;
}

namespace {

/// Returns the colour scale of a picture, in which cells may have the colour of their greatest value.
render::ScaleOptions pictureScale(const Arguments& arguments) {
  render::ScaleOptions options = scaleOptions(arguments);
  options.perCell = arguments.flag("per-cell");
  if (options.perCell && !render::isQuantity(colorNamed(arguments.text("color"))))
    throw Error(fmt::format("per-cell: the colours of {} have no greatest value; it is for {}", arguments.text("color"),
                            quantityNames()));
  return options;
}

}  // namespace

render::SlicePicture slicePicture(const Arguments& arguments, const Box& box) {
  render::SlicePicture picture;
  if (arguments.given("plane")) {
    if (arguments.given("axis") || arguments.given("offset"))
      throw Error("plane: excludes axis and offset; give one or the other");
    picture.plane = freePlane(arguments.numbers("plane"));
  } else {
    picture.plane = axisPlane(arguments, "axis", "offset", box);
  }
  picture.zoom = arguments.number("zoom");
  if (arguments.given("target")) picture.target = pointOf(arguments, "target");
  picture.color = colorNamed(arguments.text("color"));
  picture.scale = pictureScale(arguments);
  setPixels(picture, arguments);
  picture.arrows = arguments.whole("arrows");
  picture.form = pictureForm(arguments);
  return picture;
}

std::vector<Parameter> cameraParameters(const Registry& registry) {
  std::vector<Parameter> parameters;
  for (const char* name : kCameraParameters) parameters.push_back(*findParameter(registry.command("render"), name));
  return parameters;
}

std::unique_ptr<render::BodyRenderer> makeBodyRenderer(std::vector<TriangleMesh> meshes, const Backend& backend) {
  return backend.cpu ? render::makeCpuBodyRenderer(std::move(meshes))
                     : render::makeGlBodyRenderer(std::move(meshes), backend.gl);
}

render::SurfacePicture cameraPicture(const Arguments& arguments) {
  render::SurfacePicture picture;
  if (arguments.has("camera")) {
    const auto camera = arguments.numbers("camera");
    if (!(std::abs(camera[1]) <= 90)) throw Error("camera: expected an elevation from -90 to 90 degrees");
    if (!(camera[2] > 0)) throw Error("camera: expected a distance above 0");
    picture.camera.azimuthDegrees = camera[0];
    picture.camera.elevationDegrees = camera[1];
    picture.camera.distance = camera[2];
  }
  if (arguments.given("view")) {
    if (arguments.given("camera")) throw Error("view: excludes camera; give one or the other");
    turnTo(picture.camera, arguments.text("view"));
  }
  if (arguments.given("target")) picture.camera.target = pointOf(arguments, "target");
  picture.camera.projection = arguments.text("projection") == "orthographic" ? render::Projection::orthographic
                                                                             : render::Projection::perspective;
  setPixels(picture, arguments);
  render::checkPictureSize(picture.width, picture.height, picture.samples);
  return picture;
}

render::SurfacePicture surfacePicture(const Arguments& arguments, const Box& box) {
  render::SurfacePicture picture = cameraPicture(arguments);
  picture.camera.up = arguments.text("up") == "z" ? render::UpAxis::z : render::UpAxis::y;
  picture.offset = arguments.number("offset");
  if (arguments.given("clip")) {
    const render::AxisPlane cut = axisPlane(arguments, "clip", "clip-offset", box);
    picture.clip = render::ClipPlane{cut.axis, cut.offset};
  } else if (arguments.given("clip-offset")) {
    throw Error("clip-offset: needs clip, the axis that it lies on");
  }
  picture.cracks = arguments.flag("cracks");
  picture.surface = arguments.flag("surface");
  picture.shadows = arguments.flag("shadows");
  picture.edges = arguments.flag("edges");
  picture.plane = scenePlane(arguments, box);
  picture.cells = shownCells(arguments);
  picture.color = colorNamed(arguments.text("color"));
  picture.scale = pictureScale(arguments);
  picture.arrows = arguments.whole("arrows");
  picture.form = pictureForm(arguments);
  return picture;
}

std::string coordinatesText(const Vector3& v) { return fmt::format("{},{},{}", v.x(), v.y(), v.z()); }

Box shownBox(const Field& field) {
  const Box surface = field.domain().intersection(field.metadata().source.box);
  return surface.isEmpty() ? field.domain() : surface;
}

double defaultOffset(const Box& box, int axis) {
  const double middle = box.center()[axis], size = box.sizes()[axis];
  if (!(size > 0)) return middle;
  // A power of ten divides exactly enough that the quotient is the double with the fewest digits, but only if the power
  // itself is exact, as positive powers up to 10²² are.
  const double digits = 3 - std::floor(std::log10(size));
  const double rounded = digits >= 0 ? std::round(middle * std::pow(10, digits)) / std::pow(10, digits)
                                     : std::round(middle / std::pow(10, -digits)) * std::pow(10, -digits);
  return rounded + 0.0;  // turns -0 into 0
}

void noteOddSurface(const Console& console, const Field& field, const render::SurfacePicture& picture, bool seen) {
  if (!seen)
    note(console, picture.surface ? "no surface in view: move the camera, or give an offset nearer to 0"
                                  : "nothing of the field in view: move the camera, or choose a plane or cells");
  if (picture.surface && render::meetsWalls(field, picture.offset))
    note(console,
         fmt::format("the surface meets the walls of the domain and is cut off there: {} a field with a larger "
                     "margin",
                     picture.offset == 0 ? "build" : "give an offset nearer to 0, or build"));
}

render::ReferenceData referenceDataFor(Session& session, const Arguments& arguments,
                                       const render::SlicePicture& picture) {
  render::ReferenceData reference =
      session.reference(picture.color, arguments.textOr("mesh", ""), arguments.textOr("other", ""));
  const std::string operands = arguments.textOr("operands", "");
  if (!operands.empty()) reference.outlined = session.operands(operands);
  return reference;
}

render::ReferenceData referenceDataFor(Session& session, const Arguments& arguments,
                                       const render::SurfacePicture& picture) {
  render::ReferenceData reference =
      session.reference(picture.color, arguments.textOr("mesh", ""), arguments.textOr("other", ""));
  const std::string defects = arguments.textOr("defects", "");
  if (!defects.empty()) reference.defects = &session.defects(defects);
  return reference;
}

void requirePng(const std::string& file) {
  if (lowerExtension(file) != ".png") throw Error(fmt::format("{}: pictures are written as .png", file));
}

void requirePicture(const std::string& file) {
  const std::string kind = lowerExtension(file);
  if (kind == ".pdf") return render::requirePdf();
  if (kind != ".png" && kind != ".svg")
    throw Error(fmt::format("{}: pictures are written as .png, .svg or .pdf", file));
}

void savePicture(const render::Image& image, const render::VectorPicture& vectors, const std::string& file) {
  if (render::isVectorFile(file))
    saveVectorPicture(vectors, file);
  else
    savePng(image, file);
}

std::vector<Parameter> formParameters() {
  return {{"dpi", number().within(10, 2400).in("pixels per inch").byDefault("96").under(kPicture).advanced(),
           "Resolution. The size counts 96 pixels to an inch; at 192, a .png has twice as many pixels each way, with "
           "text and lines twice as large. Pictures of pixels within a .svg or .pdf become finer too."},
          {"transparent", flag().under(kPicture).advanced(),
           "Leaves the background out: the paper around what is drawn, and the backdrop of surfaces."}};
}

render::PictureForm pictureForm(const Arguments& arguments) {
  return {.pixelRatio = arguments.number("dpi") / render::kScreenDpi, .transparent = arguments.flag("transparent")};
}

void reportPicture(Session& session, const Arguments& arguments, const std::string& file, int width, int height,
                   const std::string& renderer) {
  if (session.wantsJson(arguments))
    return printJson(session.console().out,
                     {{"output", file}, {"width", width}, {"height", height}, {"renderer", renderer}});
  session.console().out << fmt::format("{}: {}x{}, {}\n", file, width, height, renderer);
}

}  // namespace hpsdf::app
