// The panels of the explorer's left column.

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

void drawCamera(const Controls& controls, const render::OrbitCamera& c) {
  std::vector<std::string> directions = viewNames();
  directions.insert(directions.begin(), "any");
  controls.choice("view/direction", "direction", directions, viewName(c), "camera view=");
  const auto turn = [&](double azimuth, double elevation, double distance) {
    controls.commands.push_back(fmt::format("camera {},{},{}", number(azimuth), number(elevation), number(distance)));
  };
  Ui& ui = controls.ui;
  if (const auto v = ui.slider("view/azimuth", "azimuth", std::remainder(c.azimuthDegrees, 360), -180, 180, "%.1f°"))
    turn(*v, c.elevationDegrees, c.distance);
  if (const auto v = ui.slider("view/elevation", "elevation", c.elevationDegrees, -90, 90, "%.1f°"))
    turn(c.azimuthDegrees, *v, c.distance);
  if (const auto v = ui.slider("view/distance", "distance", c.distance, 0.05, 3, "%.3g"))
    turn(c.azimuthDegrees, c.elevationDegrees, *v);
  controls.choice("view/projection", "projection", {"perspective", "orthographic"},
                  c.projection == render::Projection::perspective ? "perspective" : "orthographic",
                  "camera projection=");
  controls.choice("view/up", "up", {"y", "z"}, c.up == render::UpAxis::y ? "y" : "z", "camera up=");
  controls.button("view/center", "back to the center", "camera target=center", c.target.has_value());
}

void drawSurface(const Controls& controls, const ViewState& view, const Box& domain) {
  const double span = 0.15 * domain.diagonal().norm();
  controls.slider("view/offset", "offset", view.surfaceOffset, -span, span, "surface offset=");
  controls.checkbox("view/shadows", "shadows", view.shadows, "surface shadows=");
  controls.checkbox("view/edges", "edges", view.edges, "surface edges=");
  controls.checkbox("view/cracks", "mark cracks", view.cracks, "surface cracks=");
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

void drawPlane(const Controls& controls, const ViewState& view, const Field& field) {
  drawPlaneOffset(controls, view, field);
  controls.slider("view/zoom", "zoom", view.zoom, 1, 32, "plane zoom=", "%.3g");
  controls.button("view/whole", "whole section", "plane zoom=1 target=center", view.sliceTarget || view.zoom != 1);
  controls.field("view/operands", "operands", view.operands, "plane operands=", true);
}

/// Draws the controls that show or hide the surface, a plane and the cells of the octree in the picture of a surface.
void drawPlaneAndCells(const Controls& controls, const ViewState& view, const Field& field) {
  controls.checkbox("view/surface", "surface", view.surface, "surface shown=");
  ImGui::SameLine();
  controls.checkbox("view/plane", "plane", view.planeInSpace, "plane in-space=");
  if (view.planeInSpace) drawPlaneOffset(controls, view, field);
  controls.choice("view/cells", "cells", {"none", "lines", "boxes"}, cellStyleName(view.cells.style), "cells ");
  if (view.cells.style == render::CellStyle::none) return;
  controls.field("view/degrees", "of degrees", levelText(view.cells.degrees), "cells degrees=");
  controls.field("view/depths", "of depths", levelText(view.cells.depths), "cells depths=");
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
  const auto pin = [&](const std::string& range) {
    controls.commands.push_back(fmt::format("color {} range={}", colorName(colors.by), range));
  };
  const auto limits = [&](const std::string& low, const std::string& high) { pin(scriptWord(low + "," + high)); };
  if (const auto pinned = controls.ui.checkbox("view/pinned", "pinned range", colors.scale.limits.has_value())) {
    if (!*pinned)
      pin("auto");
    else if (automatic)
      limits(fmt::format("{}", (*automatic)[0]), fmt::format("{}", (*automatic)[1]));
  }
  if (!colors.scale.limits) return;
  const auto [low, high] = *colors.scale.limits;
  if (const auto text = controls.ui.field("view/low", "from", shortNumber(low))) limits(*text, fmt::format("{}", high));
  if (const auto text = controls.ui.field("view/high", "to", shortNumber(high))) limits(fmt::format("{}", low), *text);
}

void drawColors(const Controls& controls, const ViewState& view, const std::optional<render::Drawn>& picture) {
  const Coloring& colors = view.colors();
  const render::ColorBy without = view.slice ? render::ColorBy::normal : render::ColorBy::distance;
  controls.choice("view/color", "color", colorNames(without), std::string(colorName(colors.by)), "color ");
  const std::string command = fmt::format("color {} ", colorName(colors.by));
  if (colors.by == render::ColorBy::difference)
    controls.field("view/other", "other field", colors.other, command + "other=", true);
  if (colors.by == render::ColorBy::error)
    controls.field("view/mesh", "made from", colors.mesh, command + "mesh=", true);
  if (!render::isQuantity(colors.by)) return;
  controls.choice("view/scale", "scale", {"log", "linear"}, colors.scale.logarithmic ? "log" : "linear",
                  command + "scale=");
  drawColorRange(controls, colors, picture ? picture->scale.limits : std::nullopt);
}

/// The controls for the parameters of `build`. Each control shows its parameter's value in `settings`, or the value of
/// the current field if `settings` does not contain the parameter.
struct BuildControls {
  const Controls& controls;
  const std::map<std::string, std::string>& settings;

  std::string value(const char* name, const std::string& ofField) const {
    const auto found = settings.find(name);
    return found == settings.end() ? ofField : found->second;
  }

  void field(const char* name, const std::string& ofField) const {
    controls.field(path(name), name, value(name, ofField), command(name));
  }

  void slider(const char* name, double ofField, double low, double high, const char* format) const {
    const double current = parseNumber(value(name, number(ofField))).value_or(ofField);
    controls.slider(path(name), name, current, low, high, command(name), format);
  }

  void choice(const char* name, const std::vector<std::string>& names, const std::string& ofField) const {
    controls.choice(path(name), name, names, value(name, ofField), command(name));
  }

 private:
  static std::string path(const char* name) { return fmt::format("build/{}", name); }
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
  ui.progress("build/progress", explorer.work->task, explorer.work->fraction);
  if (!explorer.work->cancellable) return;
  ui.freeze(false);
  ui.enable(true);
  if (ui.button("build/cancel", "cancel")) explorer.cancelWanted = true;
  ui.freeze(true);
  ui.enable(true);
}

}  // namespace

void drawViewPanel(const Controls& controls, Explorer& explorer) {
  const ViewState& view = explorer.view();
  const Field& field = explorer.session().current().field;
  if (view.slice) {
    drawPlane(controls, view, field);
  } else {
    drawCamera(controls, view.camera);
    drawSurface(controls, view, field.domain());
    drawPlaneAndCells(controls, view, field);
  }
  drawTriangles(controls, view);
  if (const auto v = controls.ui.slider("view/arrows", "arrows", view.arrows, 0, 120, "%.0f"))
    controls.commands.push_back(fmt::format("arrows {:.0f}", *v));
  drawColors(controls, view, explorer.picture());
  controls.field("view/beside", "beside", view.beside, "beside ", true);
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
  if (explorer.work) return drawProgress(controls.ui, explorer);
  if (const auto all = explorer.allSteps()) {
    const auto steps = double(field.metadata().steps.value_or(*all));
    if (const auto v = controls.ui.slider("build/steps", "steps", steps, 0, double(*all), "%.0f", When::released))
      controls.commands.push_back(fmt::format("rebuild max-steps={:.0f}", *v));
  }
  controls.button("build/rebuild", "rebuild", "rebuild", !build.value("mesh", current.madeFrom()).empty());
}

}  // namespace hpsdf::app
