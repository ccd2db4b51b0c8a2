// The panels of the explorer's left column.

#include "explorer/explorer_commands.h"
#include "explorer/panels.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/build_settings.h"
#include "hpsdf/field.h"
#include "pictures/picture_arguments.h"
#include "session/field_summary.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

std::string axisName(int axis) { return {"xyz"[axis]}; }

void drawUp(const Controls& controls, const ViewState& view) {
  const std::string axis = upName(view.camera);
  controls.choice("view/up", "up", {"auto", "y", "z"}, view.guessesUp ? "auto" : axis, "camera up=");
  if (view.guessesUp) controls.ui.text("up axis guessed: " + axis, true);
}

void drawOrbit(const Controls& controls, const ViewState& view) {
  const render::OrbitCamera& c = view.camera;
  std::vector<std::string> directions = viewNames();
  directions.insert(directions.begin(), "any");
  controls.choice("view/direction", "direction", directions, viewName(c), "camera view=");
  const auto turn = [&](double azimuth, double elevation, double distance) {
    controls.commands.push_back(fmt::format("camera {},{},{}", number(azimuth), number(elevation), number(distance)));
  };
  Ui& ui = controls.ui;
  controls.describe("camera ");
  if (const auto v = ui.slider("view/azimuth", "azimuth", std::remainder(c.azimuthDegrees, 360), -180, 180, "%.1f°"))
    turn(*v, c.elevationDegrees, c.distance);
  controls.describe("camera ");
  if (const auto v = ui.slider("view/elevation", "elevation", c.elevationDegrees, -90, 90, "%.1f°"))
    turn(c.azimuthDegrees, *v, c.distance);
  controls.describe("camera ");
  if (const auto v = ui.slider("view/distance", "distance", c.distance, 0.05, 3, "%.3g"))
    turn(c.azimuthDegrees, c.elevationDegrees, *v);
  controls.choice("view/projection", "projection", {"perspective", "orthographic"},
                  c.projection == render::Projection::perspective ? "perspective" : "orthographic",
                  "camera projection=");
  drawUp(controls, view);
  const double usual = render::OrbitCamera{}.distance;
  const std::string whole =
      fmt::format("camera {},{},{} target=center", number(c.azimuthDegrees), number(c.elevationDegrees), number(usual));
  controls.button("view/center", "whole in view", whole.c_str(), c.target.has_value() || c.distance != usual,
                  "Look at the middle of the domain, from so far that all of it is in view.");
}

void drawSurface(const Controls& controls, const ViewState& view, const Box& domain) {
  const double span = 0.15 * domain.diagonal().norm();
  controls.slider("view/offset", "offset", view.surfaceOffset, -span, span, "surface offset=");
  controls.choice("view/clip", "cut across", {"none", "x", "y", "z"}, view.clip ? axisName(view.clip->axis) : "none",
                  "surface clip=");
  if (view.clip)
    controls.slider("view/clip-offset", "cut at", view.clip->offset, domain.min()[view.clip->axis],
                    domain.max()[view.clip->axis], "surface clip-offset=");
}

void drawPlaneOffset(const Controls& controls, const ViewState& view, const Field& field) {
  const Box& domain = field.domain();
  controls.choice("view/axis", "plane across", {"x", "y", "z"}, axisName(view.axis), "plane axis=");
  controls.slider("view/plane-offset", "plane at", view.planeOffset.value_or(defaultOffset(shownBox(field), view.axis)),
                  domain.min()[view.axis], domain.max()[view.axis], "plane offset=");
}

void drawZoom(const Controls& controls, const ViewState& view) {
  controls.slider("view/zoom", "zoom", view.zoom, 1, 32, "plane zoom=", "%.3g");
  controls.button("view/whole", "whole section", "plane zoom=1 target=center", view.sliceTarget || view.zoom != 1,
                  "Show the whole section of the domain again.");
}

void drawPlane(const Controls& controls, const ViewState& view, const Field& field) {
  drawPlaneOffset(controls, view, field);
  controls.field("view/operands", "operands", view.operands, "plane operands=", true);
}

/// Draws the controls that show or hide the surface, a plane and the cells of the octree in the picture of a surface.
void drawPlaneAndCells(const Controls& controls, const ViewState& view, const Field& field) {
  const float left = ImGui::GetCursorPosX(), third = widthLeft() / 3;
  controls.checkbox("view/surface", "surface", view.surface, "surface shown=");
  ImGui::SameLine(left + third);
  controls.checkbox("view/cracks", "cracks", view.cracks, "surface cracks=");
  ImGui::SameLine(left + 2 * third);
  controls.checkbox("view/plane", "plane", view.planeInSpace, "plane in-space=");
  controls.checkbox("view/shadows", "shadows", view.shadows, "surface shadows=");
  ImGui::SameLine(left + third);
  controls.checkbox("view/edges", "edges", view.edges, "surface edges=");
  if (view.planeInSpace) drawPlaneOffset(controls, view, field);
  controls.choice("view/cells", "cells", {"none", "lines", "boxes"}, cellStyleName(view.cells.style), "cells ");
  if (view.cells.style == render::CellStyle::none) return;
  controls.field("view/degrees", "their degrees", levelText(view.cells.degrees), "cells degrees=");
  controls.field("view/depths", "their depths", levelText(view.cells.depths), "cells depths=");
  controls.checkbox("view/at-surface", "at the surface", view.cells.atSurface, "cells at-surface=");
}

/// Draws the controls of the triangles that the command `contour` would write.
void drawTriangles(const Controls& controls, const ViewState& view) {
  controls.checkbox("view/triangles", "triangles", view.triangles, "triangles shown=");
  if (!view.triangles) return;
  ImGui::SameLine();
  controls.checkbox("view/simplify", "simplified", view.trianglesSimplified, "triangles simplify=");
  controls.field("view/tolerance", "tolerance", view.trianglesTolerance, "triangles tolerance=");
}

/// Draws the controls for the limits of the colour scale. `automatic` holds the limits that the present picture uses.
void drawColorRange(const Controls& controls, const Coloring& colors,
                    const std::optional<std::array<double, 2>>& automatic) {
  controls.describe(fmt::format("color {} range=", colorName(colors.by)),
                    "Keep the ends of the colour scale while the view changes, and set them.");
  const auto pin = [&](const std::string& range) {
    controls.commands.push_back(fmt::format("color {} range={}", colorName(colors.by), range));
  };
  const auto limits = [&](const std::string& low, const std::string& high) { pin(scriptWord(low + "," + high)); };
  if (const auto pinned = controls.ui.checkbox("view/pinned", "fixed range", colors.scale.limits.has_value())) {
    if (!*pinned)
      pin("auto");
    else if (automatic)
      limits(fmt::format("{}", (*automatic)[0]), fmt::format("{}", (*automatic)[1]));
  }
  if (!colors.scale.limits) return;
  const auto [low, high] = *colors.scale.limits;
  controls.describe("color range=");
  if (const auto text = controls.ui.field("view/low", "from", shortNumber(low))) limits(*text, fmt::format("{}", high));
  controls.describe("color range=");
  if (const auto text = controls.ui.field("view/high", "to", shortNumber(high))) limits(fmt::format("{}", low), *text);
}

}  // namespace

void drawColors(const Controls& controls, Explorer& explorer) {
  const ViewState& view = explorer.view();
  const std::optional<render::Drawn>& picture = explorer.picture();
  const Coloring& colors = view.colors();
  const render::ColorBy without = view.slice ? render::ColorBy::normal : render::ColorBy::distance;
  controls.choice("view/color", "colour by", colorNames(without), std::string(colorName(colors.by)), "color ");
  const std::string command = fmt::format("color {} ", colorName(colors.by));
  if (colors.by == render::ColorBy::difference)
    fieldFile(controls, "view/other", "other field", colors.other, command + "other=");
  if (colors.by == render::ColorBy::error)
    surfaceFile(controls, "view/mesh", "made from", colors.mesh, command + "mesh=");
  std::vector<std::string> maps = mapNames(colors.by);
  if (!maps.empty()) {
    maps.insert(maps.begin(), "auto");
    controls.choice("view/map", "map", maps, colors.scale.map.empty() ? "auto" : colors.scale.map, command + "map=");
  }
  if (!render::isQuantity(colors.by)) return;
  controls.checkbox("view/per-cell", "greatest of each cell", colors.scale.perCell, (command + "per-cell=").c_str());
  controls.choice("view/scale", "scale", {"log", "linear"}, colors.scale.logarithmic ? "log" : "linear",
                  command + "scale=");
  drawColorRange(controls, colors, picture ? picture->scale.limits : std::nullopt);
}

namespace {

/// Returns a number that stands for all three axes in place of three equal ones, and any other text as it is.
std::string oneForAll(const std::string& text) {
  const std::string first = text.substr(0, text.find(','));
  return text == fmt::format("{0},{0},{0}", first) ? first : text;
}

/// Returns true if two texts spell different values.
bool differ(const std::string& one, const std::string& other) {
  const auto number = parseNumber(oneForAll(one));
  return one != other && (!number || number != parseNumber(oneForAll(other)));
}

/// The controls for the parameters of `build`. Each control shows its parameter's value in `settings`, or the value of
/// the current field if `settings` does not contain the parameter.
struct BuildControls {
  const Controls& controls;
  const std::map<std::string, std::string>& settings;
  mutable bool areChanged = false;  ///< true if a value that was asked for is not that of the field

  std::string value(const char* name, const std::string& ofField) const {
    const auto found = settings.find(name);
    if (found == settings.end()) return ofField;
    areChanged = areChanged || differ(found->second, ofField);
    return found->second;
  }

  void field(const char* name, const std::string& ofField) const {
    controls.field(path(name), label(name).c_str(), value(name, ofField), command(name));
  }

  void slider(const char* name, double ofField, double low, double high, const char* format) const {
    const double current = parseNumber(value(name, number(ofField))).value_or(ofField);
    controls.slider(path(name), label(name).c_str(), current, low, high, command(name), format);
  }

  void choice(const char* name, const std::vector<std::string>& names, const std::string& ofField) const {
    controls.choice(path(name), label(name).c_str(), names, value(name, ofField), command(name));
  }

 private:
  static std::string path(const char* name) { return fmt::format("build/{}", name); }
  /// Returns the name of the parameter in plain words.
  static std::string label(std::string name) {
    std::ranges::replace(name, '-', ' ');
    return name;
  }
  static std::string command(const char* name) { return fmt::format("settings {}=", name); }
};

void drawContinuity(const BuildControls& build, const Field& field) {
  const std::string kind = build.value("continuity", settingText(buildSetting("continuity"), settingsOf(field.data())));
  build.choice("continuity", {"none", "weak", "exact", "both"}, kind);
  const auto weight = field.metadata().settings.continuityWeight;
  const double width = field.data().blend;
  if (kind == "weak" || kind == "both")
    build.field("continuity-weight", shortNumber(weight.value_or(WeakContinuity{}.weight)));
  if (kind == "exact" || kind == "both")
    build.slider("blend-width", width > 0 ? width : kDefaultBlend, 0.01, kMaxBlend, "%.3f");
}

/// Draws the progress of the construction. During the construction only the button that cancels it takes
/// input.
void drawProgress(Ui& ui, Explorer& explorer) {
  constexpr const char* kCancel = "cancel";
  const ImGuiStyle& style = ImGui::GetStyle();
  const float button = widthOf(kCancel) + 2 * style.FramePadding.x + style.ItemSpacing.x;
  ui.progress("build/progress", explorer.work->task, explorer.work->fraction, explorer.work->cancellable ? button : 0);
  if (!explorer.work->cancellable) return;
  ImGui::SameLine();
  ui.freeze(false);
  ui.enable(true);
  ui.help("Stop, and keep the field that there was before.");
  if (ui.button("build/cancel", kCancel)) explorer.cancelWanted = true;
  ui.freeze(true);
  ui.enable(true);
}

}  // namespace

void drawShown(const Controls& controls, Explorer& explorer) {
  const ViewState& view = explorer.view();
  const Field& field = explorer.session().current().field;
  if (view.slice) {
    drawPlane(controls, view, field);
  } else {
    drawPlaneAndCells(controls, view, field);
    drawSurface(controls, view, field.domain());
  }
  drawTriangles(controls, view);
  controls.describe("arrows ");
  if (const auto v = controls.ui.slider("view/arrows", "arrows", view.arrows, 0, 120, "%.0f"))
    controls.commands.push_back(fmt::format("arrows {:.0f}", *v));
  fieldFile(controls, "view/beside", "beside", view.beside, "beside ");
}

void drawCamera(const Controls& controls, Explorer& explorer) {
  const ViewState& view = explorer.view();
  view.slice ? drawZoom(controls, view) : drawOrbit(controls, view);
}

void drawQuestions(const Controls& controls) {
  const float gap = ImGui::GetStyle().ItemSpacing.x, width = (widthLeft() - gap) / 2;
  bool second = false;
  for (const Preset& preset : presets()) {
    if (second) ImGui::SameLine();
    const std::string path = fmt::format("questions/{}", preset.name), command = fmt::format("preset {}", preset.name);
    controls.button(path, preset.question, command.c_str(), true, preset.help, width);
    second = !second;
  }
}

/// Draws the settings of Algorithm 1, which have no effect on a construction within a tolerance.
void drawRefinement(const BuildControls& build, const BuildOptions& built) {
  build.slider("nearness", built.nearness, 0, 8, "%.1f");
  for (const char* name : {"max-degree", "max-depth"}) {
    const BuildSetting& setting = buildSetting(name);
    build.slider(name, setting.get(built)[0], setting.minimum, setting.maximum, "%.0f");
  }
  for (const char* name : {"strategy", "criterion", "estimator"}) {
    const BuildSetting& setting = buildSetting(name);
    build.choice(name, {setting.words.begin(), setting.words.end()}, settingText(setting, built));
  }
}

void drawBuildPanel(const Controls& controls, Explorer& explorer) {
  const CurrentField& current = explorer.session().current();
  const Field& field = current.field;
  const BuildOptions built = rebuildOptions(field);
  const BuildControls build{controls, explorer.settings()};
  build.field("mesh", current.madeFrom());
  const bool isTolerant = hasTolerance(field);
  if (isTolerant)
    build.field("tolerance", shortNumber(built.tolerance));
  else
    build.field("target-error", shortNumber(built.targetError.weighted()));
  build.field("grid", settingText(buildSetting("grid"), built));
  if (!isTolerant) drawRefinement(build, built);
  drawContinuity(build, field);
  const bool bounds = build.value("bounds", field.data().bounds.empty() ? "false" : "true") == "true";
  controls.checkbox("build/bounds", "bounds", bounds, "settings bounds=");
  const bool canBuild = !build.value("mesh", current.madeFrom()).empty();
  controls.button("build/rebuild", "rebuild", "apply", canBuild);
  ImGui::SameLine();
  controls.button("build/compare", "rebuild and compare", "apply keep=true", canBuild,
                  "Build the field anew, and show the one before it beside it.", widthLeft());
  // The progress is below the buttons, so that a second click on one of them does not cancel what the first has begun.
  if (explorer.work) return drawProgress(controls.ui, explorer);
  if (build.areChanged) controls.ui.text("changed: the field is built with other settings", true);
  if (const auto all = explorer.allSteps()) {
    const auto steps = double(field.metadata().steps.value_or(*all));
    controls.describe("apply max-steps=");
    if (const auto v = controls.ui.slider("build/steps", "steps", steps, 0, double(*all), "%.0f", When::released))
      controls.commands.push_back(fmt::format("apply max-steps={:.0f}", *v));
  }
}

}  // namespace hpsdf::app
