#include "explorer/explorer_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "construction/build_arguments.h"
#include "explorer/explorer.h"
#include "explorer/worst_places.h"
#include "files/text_file.h"
#include "hpsdf/detail/output_file.h"
#include "language/script.h"
#include "pictures/picture_arguments.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

void changePanel(ViewState& view, const Arguments& arguments, Session&) {
  const auto set = [&](Panel panel, bool open) { view.open[static_cast<std::size_t>(panel)] = open; };
  const auto forEach = [&](bool sections, const auto& act) {
    for (std::size_t i = 0; i < kPanels; ++i)
      if (const auto panel = static_cast<Panel>(i); isSection(panel) == sections) act(panel, kPanelNames[i]);
  };
  if (arguments.given("all")) {
    view.open.fill(arguments.flag("all"));
    set(Panel::keys, false);
  }
  forEach(true, [&](Panel section, const char* name) {
    if (!arguments.given(name)) return;
    set(section, arguments.flag(name));
    if (arguments.flag(name)) set(columnOf(section), true);
  });
  forEach(false, [&](Panel part, const char* name) {
    if (arguments.given(name)) set(part, arguments.flag(name));
  });
  if (arguments.given("left-scroll")) view.scroll[0] = arguments.number("left-scroll");
  if (arguments.given("right-scroll")) view.scroll[1] = arguments.number("right-scroll");
}

void changeWorst(ViewState& view, const Arguments& arguments, Session&) {
  if (arguments.given("by")) {
    view.worstBy = arguments.text("by") == "value" ? JumpKind::value : JumpKind::gradient;
    view.worstPage = 0;
  }
  if (arguments.given("on")) {
    view.worstOnSurface = arguments.text("on") == "surface";
    view.worstPage = 0;
  }
  if (arguments.given("page")) view.worstPage = arguments.whole("page") - 1;
  if (arguments.given("mark"))
    view.mark = arguments.text("mark") == "none" ? std::nullopt : std::optional(pointOf(arguments, "mark"));
}

/// The point to which the command `fly` moves the camera or the slice.
struct Destination {
  Vector3 point;
  double cellSize;  ///< edge length of a cell at the point, world units
  int sliceAxis;    ///< axis perpendicular to the slice that shows the point best
};

/// Returns the point of the largest jump on a cell interface. Rank 1 is the interface with the largest jump of all. The
/// slice through the point is perpendicular to the interface, so that it shows the cells on both sides.
Destination worstPoint(Session& session, std::size_t rank) {
  const auto& worst = explorerOf(session).worst(rank);
  if (rank > worst.size())
    throw Error(fmt::format("rank: the field has {} interfaces{}; give one of them", worst.size(),
                            explorerOf(session).view().worstOnSurface ? " at the surface" : ""));
  const Interface& face = session.jumps().interfaces[worst[rank - 1]];
  return {face.worst, cellSizeAt(session.current().field, std::max(face.depths[0], face.depths[1])),
          face.axis == 2 ? 1 : 2};
}

Destination destinationAt(Session& session, const Vector3& point) {
  const Field& field = session.current().field;
  if (!field.domain().contains(point)) throw Error("to: the point lies outside the field's domain; give one within it");
  return {point, cellSizeAt(field, field.cellAt(point).depth), explorerOf(session).view().axis};
}

/// Turns the camera so that it looks at the point from outside, along the gradient of the field.
void lookFromOutside(render::OrbitCamera& camera, const Vector3& gradient) {
  if (!(gradient.norm() > 0)) return;
  const Vector3 outward = gradient.normalized();
  const bool upY = camera.up == render::UpAxis::y;
  const double height = upY ? outward.y() : outward.z(), front = upY ? outward.z() : -outward.y();
  constexpr double kDegrees = 180 / std::numbers::pi;
  camera.elevationDegrees = std::asin(std::clamp(height, -1.0, 1.0)) * kDegrees;
  camera.azimuthDegrees = std::atan2(outward.x(), front) * kDegrees;
}

/// Moves the camera or the slice to the destination, so close that the cell at this point takes about a sixth
/// of the picture, and marks the point. The camera looks at it from outside, so that the surface does not hide a point
/// that lies on it. A clip plane of an earlier view is removed, because it might cut the point off.
void runFly(Session& session, const Arguments& arguments) {
  Explorer& explorer = explorerOf(session);
  const Field& field = session.current().field;
  const Destination to = arguments.has("to") ? destinationAt(session, pointOf(arguments, "to"))
                                             : worstPoint(session, static_cast<std::size_t>(arguments.whole("rank")));
  ViewState view = explorer.view();
  if (view.slice) {
    view.plane.reset();
    view.axis = to.sliceAxis;
    view.planeOffset = to.point[view.axis];
    view.zoom = std::max(1.0, field.domain().sizes().maxCoeff() / (6 * to.cellSize));
    view.sliceTarget = to.point;
  } else {
    view.camera.target = to.point;
    view.camera.distance = 10 * to.cellSize / field.domain().diagonal().norm();
    view.clip.reset();
    lookFromOutside(view.camera, field.valueAndGradient(to.point).gradient);
  }
  view.mark = to.point;
  explorer.change(std::move(view));
}

constexpr Preset kPresets[] = {
    {"whole", "The whole surface", "Show the whole surface under plain light, and take back cuts, marks and cells."},
    {"inside", "What is inside?", "Cut the surface in the middle, and colour the cells within by their degree."},
    {"worst", "Where is it worst?",
     "Take a close look at the place at the surface where two cells disagree most, and list the next ones."},
    {"torn", "Where is it torn?", "Mark the cracks of the surface, and list the places where cells disagree most."},
    {"degrees", "Which degrees?", "Show a slice through the middle whose colours are the degrees of the polynomials."},
    {"mesh", "How far off is it?",
     "Colour the surface by its distance to the mesh or shape from which the field was made."}};

/// Returns the line of script that shows a preset.
std::string presetLine(Session& session, const std::string& name) {
  const std::string plain =
      "show surface ; surface offset=0 shown=true clip=none cracks=false edges=false defects=none ; plane "
      "in-space=false ; "
      "cells none ; triangles shown=false ; arrows 0 ; worst mark=none ; ";
  const std::string whole = plain + "camera 30,20,1.1 target=center ; ";
  const std::string levels = "panel legend=true histograms=true worst=false statistics=false";
  const std::string list =
      "worst by=value on=surface page=1 ; panel legend=true worst=true histograms=false statistics=false";
  const bool isUpY = explorerOf(session).view().camera.up == render::UpAxis::y;
  if (name == "inside") return whole + fmt::format("surface clip={} ; color degree ; {}", isUpY ? "z" : "y", levels);
  if (name == "worst") return plain + fmt::format("color value-jump ; {} ; fly 1", list);
  if (name == "torn") return whole + "surface cracks=true ; color normal ; " + list;
  if (name == "degrees") return "show slice ; plane axis=z offset=auto zoom=1 target=center ; color degree ; " + levels;
  if (name == "mesh") {
    session.exact("");  // reports a missing mesh now, not at the next frame
    return whole + "color error ; panel legend=true statistics=true histograms=false worst=false";
  }
  return whole + "color normal ; " + levels;
}

void runPreset(Session& session, const Arguments& arguments) {
  session.current();  // throws `Error` if there is no field
  explorerOf(session).changeBy(presetLine(session, arguments.text("name")));
}

void checkFly(const Arguments& arguments) {
  if (arguments.has("rank") == arguments.has("to"))
    throw Error("fly: expected either the rank of an interface or to=X,Y,Z");
}

void runUndo(Session& session, const Arguments&) {
  if (!explorerOf(session).undo()) throw Error("there is nothing to undo");
}

void runRedo(Session& session, const Arguments&) {
  if (!explorerOf(session).redo())
    throw Error("there is nothing to redo: nothing was undone, or something was done since");
}

void runCopyView(Session& session, const Arguments& arguments) {
  const std::string script = scriptOf(explorerOf(session).view());
  explorerOf(session).setClipboard(script);
  if (arguments.has("output"))
    writeTextFile(arguments.text("output"), script);
  else
    session.console().out << script;
}

void runSettings(Session& session, const Arguments& arguments) {
  for (const Parameter& parameter : session.registry().command("settings").parameters)
    if (arguments.given(parameter.name) && parameter.name != "json")
      explorerOf(session).setSetting(parameter.name, arguments.text(parameter.name));
}

void runApply(Session& session, const Arguments& arguments) {
  explorerOf(session).rebuild(arguments.given("max-steps") ? std::optional(arguments.whole("max-steps")) : std::nullopt,
                              arguments.flag("keep"));
}

void runOpen(Session& session, const Arguments& arguments) { explorerOf(session).openFile(arguments.text("file")); }

render::Image drawShot(Session& session, const Arguments& arguments) {
  session.current();  // throws `Error` if there is no field
  Explorer& explorer = explorerOf(session);
  const bool panels = arguments.flag("panels");
  const render::Image frame = panels ? explorer.frame() : explorer.canvasImage();
  render::Drawn picture = *explorer.picture();
  const UiRect canvas = layoutOf(explorer.view()).canvas;  // `pick` works only in the current field's picture
  picture.image = frame;
  picture.corner = panels ? std::array{int(canvas.x0), int(canvas.y0)} : std::array{0, 0};
  session.setPicture(std::move(picture));
  return frame;
}

void runShot(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  requirePng(file);
  checkWritable(file);
  const render::Image frame = drawShot(session, arguments);
  savePng(frame, file);
  reportPicture(session, arguments, file, frame.width, frame.height, session.lastRenderer());
}

/// Returns the parameters of the command `panel`: which panels are open, and how far the columns are
/// scrolled.
std::vector<Parameter> panelParameters() {
  constexpr std::array kHelp = {"The buttons on top.",
                                "The left column.",
                                "The right column.",
                                "What the pointer is over.",
                                "The list of keys and mouse actions, over the picture.",
                                "Buttons that answer common questions.",
                                "What is drawn, and where it is cut.",
                                "What the colours show.",
                                "Where the camera stands.",
                                "Settings of the construction.",
                                "What the colours mean.",
                                "Shares of the volume by degree and depth.",
                                "The worst interfaces between cells.",
                                "Figures of the whole field."};
  static_assert(kHelp.size() == kPanels);
  std::vector<Parameter> parameters = {{"all", flag(""), "Everything but the list of keys, before the others."}};
  for (std::size_t panel = 0; panel < kPanels; ++panel)
    parameters.push_back({kPanelNames[panel], flag(""), kHelp[panel]});
  for (const std::string side : {"left", "right"})
    parameters.push_back(
        {side + "-scroll", number().atLeast(0).in("points"), fmt::format("How far the {} column is scrolled.", side)});
  return parameters;
}

void addPresetCommand(Registry& registry) {
  std::vector<std::string> names;
  std::string help;
  for (const Preset& preset : kPresets) {
    names.emplace_back(preset.name);
    help += fmt::format("{}{}: {}", help.empty() ? "" : "\n\n", preset.name, preset.help);
  }
  registry.addForScripts({
      .name = "preset",
      .summary = "Show a view that answers a common question.",
      .help = help + "\n\nIt sets the view, the colours and the sections of the panels; 'undo' takes all of it back.",
      .examples = {"preset worst", "preset inside ; shot output=inside.png"},
      .parameters = {{"name", choice(names).positional().required(), "The view."}},
      .action = runPreset,
  });
}

void addFrameCommands(Registry& registry) {
  registry.addForScripts({
      .name = "panel",
      .summary = "Open or close parts of the explorer's frame, unfold or fold the sections of its columns.",
      .help =
          "What is not given stays as it is. The picture takes the room that closed parts leave. The sections of the "
          "left column are questions, shown, colors, camera and build, those of the right one legend, histograms, "
          "worst and statistics; a section that is unfolded opens its column.",
      .examples = {"panel all=false", "panel build=false worst=true"},
      .parameters = panelParameters(),
      .action = changing(changePanel),
  });
  registry.addForScripts({
      .name = "worst",
      .summary = "Choose what the explorer's list of worst interfaces is sorted by, and its page.",
      .help =
          "An interface is where two cells meet; it is measured by its greatest jump, as in 'jumps'. The list calls "
          "it torn where f has different signs in the two cells: there the surface has a gap.",
      .examples = {"worst on=surface", "worst by=gradient page=2"},
      .parameters = {{"by", choice({"value", "gradient"}), "Greatest jump of the value, or of the gradient."},
                     {"on", choice({"all", "surface"}), "All interfaces, or those at the surface."},
                     {"page", wholeNumber().within(1, 1000), "Of eight interfaces each."},
                     {"mark", numbers("X,Y,Z", {3}).orWords({"none"}).in("world units"),
                      "The point that the picture marks, with a scale bar; 'fly' sets it. In a slice the outline of "
                      "the exact surface is drawn too, where the exact distance is known."}},
      .action = changing(changeWorst),
  });
  registry.addForScripts({
      .name = "fly",
      .summary = "Take a close look at one of the worst interfaces between cells, or at a point.",
      .help = "A slice goes through it; a camera looks at it from outside. The picture marks it, and a cut of the "
              "surface is "
              "taken back. 'verify' writes such lines for the worst points that it finds.",
      .examples = {"fly 1", "fly to=0.2,0.6,-0.1"},
      .parameters = {{"rank", wholeNumber().within(1, 8000).positional(), "Its place in the list, 1 for the worst."},
                     {"to", numbers("X,Y,Z", {3}).in("world units"), "A point within the domain instead."}},
      .action = runFly,
      .check = checkFly,
  });
}

void addHistoryCommands(Registry& registry) {
  registry.addForScripts({
      .name = "undo",
      .summary = "Take back the last change of what the explorer shows.",
      .help =
          "Changes by show (but for the frame's size, scale, samples and renderer), camera, surface, plane, cells, "
          "arrows, triangles, color, panel, worst, fly and preset; what the mouse does in one go is one change. The "
          "field itself "
          "is not changed back.",
      .examples = {"undo"},
      .action = runUndo,
  });
  registry.addForScripts({
      .name = "redo",
      .summary = "Do again what 'undo' took back.",
      .help = "Until something else is changed.",
      .examples = {"redo"},
      .action = runRedo,
  });
  registry.addForScripts({
      .name = "copy-view",
      .summary = "Write the lines of script that lead the explorer to what it shows.",
      .help = "To the file, or else to the standard output; in the window to its clipboard too.",
      .examples = {"copy-view", "copy-view output=view.hps"},
      .parameters = {{"output", outputFile().as('o'), "The script's file."}},
      .action = runCopyView,
  });
}

void addFieldAndShotCommands(Registry& registry) {
  registry.addForScripts({
      .name = "open",
      .summary = "Open a field or a mesh in the explorer, and look at the whole of it.",
      .help =
          "A field's file is loaded as by 'load'; from a mesh, a grid or a shape a field is built as by 'build' with "
          "the default settings. Places, cuts, marks and other fields of the view before it are taken back, which "
          "'undo' does not change. It is what a file dropped onto the window does.",
      .examples = {"open bunny.obj", "open builtin:torus"},
      .parameters = {{"file", text("FIELD|MESH").positional().required(),
                      "A field's file, a mesh, builtin:SHAPE or analytic:SHAPE."}},
      .action = runOpen,
  });
  registry.addForScripts({
      .name = "settings",
      .summary = "Set how 'apply' builds the field anew; what is not set is as it was.",
      .help = "The options are those of 'build'. Nothing is built yet; 'load' and 'build' forget them.",
      .examples = {"settings mesh=bunny.obj target-error=1e-5", "settings nearness=0 ; apply"},
      .parameters = joined(
          {{{"mesh", text("MESH"),
             "Mesh file, grid file, builtin:SHAPE or analytic:SHAPE; at first what the current field was made from."}},
           buildParameters()}),
      .action = runSettings,
  });
  registry.addForScripts({
      .name = "apply",
      .summary = "Build the field anew, with the settings that were changed.",
      .help = "What 'settings' has not changed is as it was for the current field.",
      .examples = {"apply", "apply max-steps=100", "settings target-error=1e-3 ; apply keep=true"},
      .parameters = {{"max-steps", settingKind("max-steps").under(setting_group::kAsked).advanced(),
                      "End after so many steps of the refinement: an earlier state of the field."},
                     {"keep", flag(),
                      "Keep the field before it under the name 'kept' and show it beside the new one, for 'beside' and "
                      "for the colour difference."}},
      .action = runApply,
  });
  registry.addForScripts({
      .name = "shot",
      .summary = "Write the explorer's frame: the picture and the panels around it.",
      .help = "Pending work is finished first. 'pick' and 'expect pick(…)' then speak of its pixels.",
      .examples = {"shot output=frame.png", "shot output=view.png panels=false"},
      .parameters = {{"output", outputFile().as('o').required(), "*.png."},
                     {"panels", flag("true"),
                      "With the panels; false writes only the picture, as large as it is between them: of both fields "
                      "if two are shown, with their names and marks."}},
      .action = runShot,
      .draw = drawShot,
      .view = [](Session& session, const Arguments&) { return scriptOf(explorerOf(session).view()); },
      .drawsOnCpuBy = "'show cpu=true'",
  });
}

}  // namespace

std::span<const Preset> presets() { return kPresets; }

void addExplorerCommands(Registry& registry) {
  addExplorerPictureCommands(registry);
  addPresetCommand(registry);
  addFrameCommands(registry);
  addHistoryCommands(registry);
  addFieldAndShotCommands(registry);
}

}  // namespace hpsdf::app
