#include "explorer/explorer_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "construction/build_arguments.h"
#include "explorer/explorer.h"
#include "files/text_file.h"
#include "hpsdf/detail/output_file.h"
#include "language/append_parameters.h"
#include "language/script.h"
#include "pictures/picture_arguments.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

void changePanel(ViewState& view, const Arguments& arguments, Session&) {
  if (arguments.given("all")) view.open.fill(arguments.flag("all"));
  for (std::size_t panel = 0; panel < kPanels; ++panel)
    if (arguments.given(kPanelNames[panel])) view.open[panel] = arguments.flag(kPanelNames[panel]);
  if (arguments.given("left-scroll")) view.scroll[0] = arguments.number("left-scroll");
  if (arguments.given("right-scroll")) view.scroll[1] = arguments.number("right-scroll");
}

void changeWorst(ViewState& view, const Arguments& arguments, Session&) {
  if (arguments.given("by")) {
    view.worstBy = arguments.text("by") == "value" ? JumpKind::value : JumpKind::gradient;
    view.worstPage = 0;
  }
  if (arguments.given("page")) view.worstPage = arguments.whole("page") - 1;
}

/// A point to fly to.
struct Destination {
  Vector3 point;
  double cellSize;  ///< edge length of a cell at the point, world units
  int sliceAxis;    ///< axis across which a slice shows the point best
};

double cellSize(const Field& field, int depth) {
  return std::ldexp(field.domain().sizes()[0] / field.grid()[0], -depth);
}

/// The point of the largest jump of an interface. The slice is perpendicular to the interface, so that it shows both
/// cells.
Destination worstPoint(Session& session, std::size_t rank) {
  const auto& worst = explorerOf(session).worst(rank);
  if (rank > worst.size())
    throw Error(fmt::format("rank: the field has {} interfaces; give one of them", session.jumps().interfaces.size()));
  const Interface& face = session.jumps().interfaces[worst[rank - 1]];
  return {face.worst, cellSize(session.current().field, std::max(face.depths[0], face.depths[1])),
          face.axis == 2 ? 1 : 2};
}

Destination destinationAt(Session& session, const Vector3& point) {
  const Field& field = session.current().field;
  if (!field.domain().contains(point)) throw Error("to: the point lies outside the field's domain; give one within it");
  return {point, cellSize(field, field.cellAt(point).depth), explorerOf(session).view().axis};
}

/// Brings the camera or the slice so close that the cell takes about a sixth of the picture.
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
    // A point away from the surface may be hidden by it: a clip plane through the point removes what is in front.
    view.clip.reset();
    if (std::abs(field.value(to.point) - view.surfaceOffset) > to.cellSize) {
      const Vector3 forward = render::cameraOf(view.camera, field.domain(), 16, 16).forward;
      Eigen::Index axis = 0;
      forward.cwiseAbs().maxCoeff(&axis);
      view.clip = render::ClipPlane{int(axis), to.point[axis]};
    }
  }
  explorer.change(std::move(view));
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

void runRebuild(Session& session, const Arguments& arguments) {
  explorerOf(session).rebuild(arguments.given("max-steps") ? std::optional(arguments.whole("max-steps"))
                                                           : std::nullopt);
}

void runShot(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  requirePng(file);
  checkWritable(file);
  session.current();
  Explorer& explorer = explorerOf(session);
  const render::Image frame = explorer.frame();
  savePng(frame, file);
  render::Drawn picture = *explorer.picture();
  const UiRect canvas = layoutOf(explorer.view()).canvas;  // `pick` knows only the current field's half
  picture.image = frame;
  picture.corner = {int(canvas.x0), int(canvas.y0)};
  session.setPicture(std::move(picture));
  reportPicture(session, arguments, file, frame.width, frame.height, session.lastRenderer());
}

Command panelCommand() {
  Command command{.name = "panel",
                  .summary = "Open or close parts of the explorer's frame.",
                  .help = "What is not given stays as it is. The picture takes the room that closed parts leave.",
                  .examples = {"panel all=false", "panel build=false worst=true"},
                  .action = changing(changePanel)};
  command.parameters.push_back({.name = "all", .type = ParameterType::flag, .help = "Every part, before the others."});
  constexpr std::array kHelp = {"The buttons on top.",
                                "What is shown.",
                                "Settings of the construction.",
                                "What the colours mean.",
                                "Shares of the volume by degree and depth.",
                                "Figures of the whole field.",
                                "The worst interfaces between cells.",
                                "What the pointer is over."};
  for (std::size_t panel = 0; panel < kPanels; ++panel)
    command.parameters.push_back({.name = kPanelNames[panel], .type = ParameterType::flag, .help = kHelp[panel]});
  for (const char* side : {"left", "right"})
    command.parameters.push_back({.name = fmt::format("{}-scroll", side),
                                  .type = ParameterType::number,
                                  .help = fmt::format("How far the {} column is scrolled.", side),
                                  .unit = "pixels",
                                  .minimum = 0});
  return command;
}

Command worstCommand() {
  return {.name = "worst",
          .summary = "Choose what the explorer's list of worst interfaces is sorted by, and its page.",
          .help = "An interface is where two cells meet; it is measured by its greatest jump, as in 'jumps'.",
          .examples = {"worst by=gradient page=2"},
          .parameters = {{.name = "by",
                          .type = ParameterType::choice,
                          .help = "Greatest jump of the value, or of the gradient.",
                          .choices = {"value", "gradient"}},
                         {.name = "page",
                          .type = ParameterType::wholeNumber,
                          .help = "Of eight interfaces each.",
                          .minimum = 1,
                          .maximum = 1000}},
          .action = changing(changeWorst)};
}

Command flyCommand() {
  return {.name = "fly",
          .summary = "Take a close look at one of the worst interfaces between cells, or at a point.",
          .help =
              "A slice goes through it; a camera looks at it, and what lies before it is cut away. 'verify' "
              "writes such lines for the worst points that it finds.",
          .examples = {"fly 1", "fly to=0.2,0.6,-0.1"},
          .parameters = {{.name = "rank",
                          .type = ParameterType::wholeNumber,
                          .help = "Its place in the list, 1 for the worst.",
                          .minimum = 1,
                          .maximum = 8000,
                          .positional = true},
                         {.name = "to",
                          .type = ParameterType::numbers,
                          .help = "A point within the domain instead.",
                          .valueName = "X,Y,Z",
                          .unit = "world units",
                          .counts = {3}}},
          .action = runFly,
          .check = checkFly};
}

Command undoCommand() {
  return {
      .name = "undo",
      .summary = "Take back the last change of what the explorer shows.",
      .help =
          "Changes by show (but for the frame's size and renderer), camera, surface, plane, cells, arrows, color, "
          "panel, worst and fly; what the mouse does in one go is one change. The field itself is not changed back.",
      .examples = {"undo"},
      .action = runUndo};
}

Command redoCommand() {
  return {.name = "redo",
          .summary = "Do again what 'undo' took back.",
          .help = "Until something else is changed.",
          .examples = {"redo"},
          .action = runRedo};
}

Command copyViewCommand() {
  return {
      .name = "copy-view",
      .summary = "Write the lines of script that lead the explorer to what it shows.",
      .help = "To the file, or else to the standard output; in the window to its clipboard too.",
      .examples = {"copy-view", "copy-view output=view.hps"},
      .parameters = {{.name = "output", .type = ParameterType::outputPath, .help = "The script's file.", .alias = 'o'}},
      .action = runCopyView};
}

Command settingsCommand() {
  Command command{.name = "settings",
                  .summary = "Set how 'rebuild' builds; what is not set is as it was.",
                  .help = "The options are those of 'build'. Nothing is built yet; 'load' and 'build' forget them.",
                  .examples = {"settings mesh=bunny.obj target-error=1e-5", "settings nearness=0 ; rebuild"},
                  .parameters = {{.name = "mesh",
                                  .type = ParameterType::text,
                                  .help = "Mesh file, builtin:SHAPE or analytic:SHAPE; at first what the current field "
                                          "was made from.",
                                  .valueName = "MESH"}},
                  .action = runSettings};
  append(command.parameters, buildParameters());
  return command;
}

Command rebuildCommand() {
  return {.name = "rebuild",
          .summary = "Build the field anew, as 'settings' says.",
          .help = "What 'settings' does not say is as it was for the current field.",
          .examples = {"rebuild", "rebuild max-steps=100"},
          .parameters = {{.name = "max-steps",
                          .type = ParameterType::wholeNumber,
                          .help = "End after so many steps of the refinement: an earlier state of the field.",
                          .minimum = 0,
                          .maximum = std::numeric_limits<int>::max()}},
          .action = runRebuild};
}

Command shotCommand() {
  return {
      .name = "shot",
      .summary = "Write the explorer's frame: the picture and the panels around it.",
      .help =
          "Pending work is finished first. 'pick' and 'expect pick(…)' then speak of its pixels. 'panel "
          "all=false' leaves the picture alone.",
      .examples = {"shot output=frame.png"},
      .parameters =
          {{.name = "output", .type = ParameterType::outputPath, .help = "*.png.", .alias = 'o', .need = Need::always}},
      .action = runShot};
}

}  // namespace

void addExplorerCommands(Registry& registry) {
  std::vector<Command> commands = explorerPictureCommands();
  std::ranges::move(std::vector{panelCommand(), worstCommand(), flyCommand(), undoCommand(), redoCommand(),
                                copyViewCommand(), settingsCommand(), rebuildCommand(), shotCommand()},
                    std::back_inserter(commands));
  for (Command& command : commands) {
    command.scriptOnly = true;
    registry.add(std::move(command));
  }
}

}  // namespace hpsdf::app
