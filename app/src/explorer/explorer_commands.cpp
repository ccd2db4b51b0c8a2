#include "explorer/explorer_commands.h"

// The verbs of the explorer: what it shows, and its picture as a file. Each sets what it is given and leaves the rest.

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "construction/building.h"
#include "explorer/explorer.h"
#include "files/text_file.h"
#include "hpsdf/detail/output_file.h"
#include "language/script.h"
#include "pictures/picture_arguments.h"
#include "pictures/picture_names.h"
#include "session/backend.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Nothing for the word that stands in its place.
std::optional<Vector3> pointOr(const Arguments& arguments, const char* name, std::string_view word) {
  if (arguments.text(name) == word) return std::nullopt;
  return pointOf(arguments, name);
}

/// Empty for the word none.
std::string textOrNone(const Arguments& arguments, const char* name) {
  return arguments.text(name) == "none" ? "" : arguments.text(name);
}

void runShow(Session& session, const Arguments& arguments) {
  ViewState view = explorerOf(session).view();
  if (arguments.given("kind")) view.slice = arguments.text("kind") == "slice";
  if (arguments.given("size")) {
    view.width = arguments.size("size")[0];
    view.height = arguments.size("size")[1];
  }
  if (arguments.given("samples")) view.samples = arguments.whole("samples");
  if (arguments.given("cpu") || arguments.given("gl")) view.backend = backend(arguments);
  explorerOf(session).change(std::move(view));
}

void runCamera(Session& session, const Arguments& arguments) {
  ViewState view = explorerOf(session).view();
  render::OrbitCamera& camera = view.camera;
  if (arguments.given("orbit")) {
    const auto n = arguments.numbers("orbit");
    camera.azimuthDegrees = n[0];
    camera.elevationDegrees = n[1];
    camera.distance = n[2];
  }
  if (arguments.given("view") && arguments.text("view") != "any") turnTo(camera, arguments.text("view"));
  if (arguments.given("target")) camera.target = pointOr(arguments, "target", "center");
  if (arguments.given("up")) camera.up = arguments.text("up") == "z" ? render::UpAxis::z : render::UpAxis::y;
  if (arguments.given("projection"))
    camera.projection = arguments.text("projection") == "orthographic" ? render::Projection::orthographic
                                                                       : render::Projection::perspective;
  explorerOf(session).change(std::move(view));
}

void checkCamera(const Arguments& arguments) {
  if (!arguments.given("orbit")) return;
  if (arguments.given("view")) throw Error("view: excludes azimuth, elevation and distance; give one or the other");
  const auto n = arguments.numbers("orbit");
  if (!(std::abs(n[1]) <= 90)) throw Error("camera: expected an elevation from -90 to 90 degrees");
  if (!(n[2] > 0)) throw Error("camera: expected a distance above 0, in domain diagonals");
}

void runSurface(Session& session, const Arguments& arguments) {
  ViewState view = explorerOf(session).view();
  if (arguments.given("offset")) view.surfaceOffset = arguments.number("offset");
  if (arguments.given("shown")) view.surface = arguments.flag("shown");
  if (arguments.given("cracks")) view.cracks = arguments.flag("cracks");
  if (arguments.given("defects")) {
    view.defects = textOrNone(arguments, "defects");
    if (!view.defects.empty()) session.defects(view.defects);  // an unreadable one shows now
  }
  if (arguments.given("clip")) {
    const std::string axis = arguments.text("clip");
    if (axis == "none")
      view.clip.reset();
    else
      view.clip = render::ClipPlane{axis[0] - 'x', view.clip ? view.clip->offset : 0};
  }
  if (arguments.given("clip-offset")) {
    if (!view.clip) throw Error("clip-offset: needs clip, the axis that it lies on");
    view.clip->offset = arguments.number("clip-offset");
  }
  explorerOf(session).change(std::move(view));
}

void runPlane(Session& session, const Arguments& arguments) {
  ViewState view = explorerOf(session).view();
  if (arguments.given("through")) {
    const auto n = arguments.numbers("through");
    view.plane = render::FreePlane{Vector3(n[0], n[1], n[2]), Vector3(n[3], n[4], n[5])};
  }
  if (arguments.given("axis")) {
    view.axis = arguments.text("axis")[0] - 'x';
    view.plane.reset();
  }
  if (arguments.given("offset")) {
    const bool automatic = arguments.text("offset") == "auto";
    view.planeOffset = automatic ? std::nullopt : std::optional(arguments.numbers("offset")[0]);
    view.plane.reset();
  }
  if (arguments.given("in-space")) view.planeInSpace = arguments.flag("in-space");
  if (arguments.given("zoom")) view.zoom = arguments.number("zoom");
  if (arguments.given("target")) view.sliceTarget = pointOr(arguments, "target", "center");
  explorerOf(session).change(std::move(view));
}

void checkPlane(const Arguments& arguments) {
  if (arguments.given("through") && (arguments.given("axis") || arguments.given("offset")))
    throw Error("through: excludes axis and offset; give one or the other");
}

void runColor(Session& session, const Arguments& arguments) {
  ViewState view = explorerOf(session).view();
  const bool slice = arguments.given("of") ? arguments.text("of") == "slice" : view.slice;
  Coloring& colors = slice ? view.sliceColors : view.surfaceColors;
  const render::ColorBy by = colorNamed(arguments.text("by"));
  if (by == (slice ? render::ColorBy::normal : render::ColorBy::distance))
    throw Error(fmt::format("by: {} is not for a {}; give another colour", colorName(by), slice ? "slice" : "surface"));
  if (by != colors.by) colors.scale.limits.reset();  // of another quantity
  colors.by = by;
  if (arguments.given("other")) colors.other = textOrNone(arguments, "other");
  if (arguments.given("mesh")) colors.mesh = textOrNone(arguments, "mesh");
  if (by == render::ColorBy::difference && colors.other.empty())
    throw Error("color difference: needs other, the file of the field to compare with");
  if (arguments.given("range")) {
    colors.scale.limits.reset();
    if (arguments.text("range") != "auto") {
      const auto n = arguments.numbers("range");
      colors.scale.limits = {n[0], n[1]};
    }
  }
  if (arguments.given("scale")) colors.scale.logarithmic = arguments.text("scale") == "log";
  if (colors.scale.limits && !((*colors.scale.limits)[0] < (*colors.scale.limits)[1]))
    throw Error("range: expected LOW,HIGH with LOW below HIGH");
  if (colors.scale.limits && render::isQuantity(by) && colors.scale.logarithmic && !((*colors.scale.limits)[0] > 0))
    throw Error("range: a logarithmic scale needs limits above 0; give others, or scale=linear");
  explorerOf(session).change(std::move(view));
}

void runPanel(Session& session, const Arguments& arguments) {
  ViewState view = explorerOf(session).view();
  if (arguments.given("all")) view.open.fill(arguments.flag("all"));
  for (std::size_t panel = 0; panel < kPanels; ++panel)
    if (arguments.given(kPanelNames[panel])) view.open[panel] = arguments.flag(kPanelNames[panel]);
  if (arguments.given("left-scroll")) view.scroll[0] = arguments.number("left-scroll");
  if (arguments.given("right-scroll")) view.scroll[1] = arguments.number("right-scroll");
  explorerOf(session).change(std::move(view));
}

void runCells(Session& session, const Arguments& arguments) {
  ViewState view = explorerOf(session).view();
  if (arguments.given("style")) view.cells.style = cellStyle(arguments.text("style"));
  const auto levels = [&](const char* name, int most) {
    return arguments.text(name) == "all" ? std::vector<int>() : levelList(arguments.text(name), name, most);
  };
  if (arguments.given("degrees")) view.cells.degrees = levels("degrees", kMaxDegree);
  if (arguments.given("depths")) view.cells.depths = levels("depths", kMaxDepth);
  explorerOf(session).change(std::move(view));
}

void runArrows(Session& session, const Arguments& arguments) {
  ViewState view = explorerOf(session).view();
  view.arrows = arguments.whole("apart");
  explorerOf(session).change(std::move(view));
}

void runBeside(Session& session, const Arguments& arguments) {
  ViewState view = explorerOf(session).view();
  view.beside = textOrNone(arguments, "field");
  if (!view.beside.empty()) session.other(view.beside);  // an unreadable one shows now
  explorerOf(session).change(std::move(view));
}

void runWorst(Session& session, const Arguments& arguments) {
  ViewState view = explorerOf(session).view();
  if (arguments.given("by")) {
    view.worstBy = arguments.text("by") == "value" ? JumpKind::value : JumpKind::gradient;
    view.worstPage = 0;
  }
  if (arguments.given("page")) view.worstPage = arguments.whole("page") - 1;
  explorerOf(session).change(std::move(view));
}

/// Where to look closely, and the size of a cell there.
struct Place {
  Vector3 point;
  double cellSize;
  int sliceAxis;  ///< across which a slice shows it best
};

double cellSize(const Field& field, int depth) {
  return std::ldexp(field.domain().sizes()[0] / field.grid()[0], -depth);
}

/// Where the interface jumps most; a slice shows its face from the edge.
Place placeOfWorst(Session& session, std::size_t rank) {
  const auto& worst = explorerOf(session).worst(rank);
  if (rank > worst.size())
    throw Error(fmt::format("rank: the field has {} interfaces; give one of them", session.jumps().interfaces.size()));
  const Interface& face = session.jumps().interfaces[worst[rank - 1]];
  return {face.worst, cellSize(session.current().field, std::max(face.depths[0], face.depths[1])),
          face.axis == 2 ? 1 : 2};
}

Place placeOf(Session& session, const Vector3& point) {
  const Field& field = session.current().field;
  if (!field.domain().contains(point)) throw Error("to: the point lies outside the field's domain; give one within it");
  return {point, cellSize(field, field.cellAt(point).depth), explorerOf(session).view().axis};
}

/// So near that the cell takes about a sixth of the picture.
void runFly(Session& session, const Arguments& arguments) {
  Explorer& explorer = explorerOf(session);
  const Field& field = session.current().field;
  const Place place = arguments.has("to") ? placeOf(session, pointOf(arguments, "to"))
                                          : placeOfWorst(session, static_cast<std::size_t>(arguments.whole("rank")));
  ViewState view = explorer.view();
  if (view.slice) {
    view.plane.reset();
    view.axis = place.sliceAxis;
    view.planeOffset = place.point[view.axis];
    view.zoom = std::max(1.0, field.domain().sizes().maxCoeff() / (6 * place.cellSize));
    view.sliceTarget = place.point;
  } else {
    view.camera.target = place.point;
    view.camera.distance = 10 * place.cellSize / field.domain().diagonal().norm();
    // what lies in front of it is cut away, unless it is the surface that one looks at
    view.clip.reset();
    if (std::abs(field.value(place.point) - view.surfaceOffset) > place.cellSize) {
      const Vector3 forward = render::cameraOf(view.camera, field.domain(), 16, 16).forward;
      Eigen::Index axis = 0;
      forward.cwiseAbs().maxCoeff(&axis);
      view.clip = render::ClipPlane{int(axis), place.point[axis]};
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
  if (!arguments.has("output")) {
    session.console().out << script;
    return;
  }
  writeTextFile(arguments.text("output"), script);
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
  if (lowerExtension(file) != ".png") throw Error(fmt::format("{}: pictures are written as .png", file));
  checkWritable(file);
  session.current();
  Explorer& explorer = explorerOf(session);
  const render::Image frame = explorer.frame();
  savePng(frame, file);
  render::Drawn picture = *explorer.picture();
  const UiRect canvas = layoutOf(explorer.view()).canvas;  // of a field beside it, nothing can be picked
  picture.image = frame;
  picture.corner = {int(canvas.x0), int(canvas.y0)};
  session.setPicture(std::move(picture));
  if (session.wantsJson(arguments))
    return printJson(
        session.console().out,
        {{"output", file}, {"width", frame.width}, {"height", frame.height}, {"renderer", session.lastRenderer()}});
  session.console().out << fmt::format("{}: {}x{}, {}\n", file, frame.width, frame.height, session.lastRenderer());
}

Command showCommand() {
  Command command{.name = "show",
                  .summary = "Choose what the explorer shows: the surface in space, or the flat picture of a plane.",
                  .help =
                      "The explorer is a picture of the current field with panels around it: 'shot' writes it, "
                      "'hpsdf view' opens it in a window. camera and surface lead the one, plane the other.",
                  .examples = {"show slice size=1280x720", "show surface samples=2 gl=software"},
                  .parameters = {{.name = "kind",
                                  .type = ParameterType::choice,
                                  .help = "The surface, or a slice.",
                                  .choices = {"surface", "slice"},
                                  .positional = true},
                                 {.name = "size",
                                  .type = ParameterType::size,
                                  .help = "Of the whole frame, panels included; 1280x720 at first.",
                                  .unit = "pixels",
                                  .minimum = 64,
                                  .maximum = 8192,
                                  .whole = true,
                                  .counts = {2}},
                                 {.name = "samples",
                                  .type = ParameterType::wholeNumber,
                                  .help = "Samples a pixel along each axis; 1 at first.",
                                  .minimum = 1,
                                  .maximum = 8}},
                  .action = runShow,
                  .scriptOnly = true};
  for (Parameter& parameter : backendParameters()) command.parameters.push_back(std::move(parameter));
  return command;
}

Parameter targetParameter(const std::string& help) {
  return {.name = "target",
          .type = ParameterType::numbers,
          .help = help,
          .valueName = "X,Y,Z",
          .unit = "world units",
          .choices = {"center"},
          .counts = {3}};
}

Command cameraCommand() {
  std::vector<std::string> directions = viewNames();
  directions.insert(directions.begin(), "any");
  return {.name = "camera",
          .summary = "Move the explorer's camera.",
          .help =
              "It looks at the surface in space. What is not given stays as it is; 'copy-view' tells how it stands. "
              "With the mouse: drag to turn, drag with the right button to move the target, wheel to go nearer.",
          .examples = {"camera 120,10,0.9", "camera view=front target=0.2,0.6,-0.1"},
          .parameters =
              {{.name = "orbit",
                .type = ParameterType::numbers,
                .help = "Azimuth and elevation in degrees, and the eye's distance from the target in "
                        "diagonals of the domain; 30,20,1.1 at first.",
                .valueName = "AZIMUTH,ELEVATION,DISTANCE",
                .counts = {3},
                .positional = true},
               {.name = "view",
                .type = ParameterType::choice,
                .help = "A named direction instead; any leaves it.",
                .choices = directions},
               targetParameter("The point in the picture's middle; center is the domain's."),
               {.name = "up", .type = ParameterType::choice, .help = "The axis that points up.", .choices = {"y", "z"}},
               {.name = "projection",
                .type = ParameterType::choice,
                .help = "How rays run: from the eye, or parallel.",
                .choices = {"perspective", "orthographic"}}},
          .action = runCamera,
          .check = checkCamera,
          .scriptOnly = true};
}

Command surfaceCommand() {
  return {.name = "surface",
          .summary = "Choose which surface the explorer shows, and where it is cut open.",
          .help = "As 'render' has it, of the picture that 'show surface' chooses. What is not given stays as it is.",
          .examples = {"surface offset=0.05", "surface clip=z clip-offset=0.1"},
          .parameters = {{.name = "shown",
                          .type = ParameterType::flag,
                          .help = "Whether it is drawn: without it, planes and cells can be looked at alone."},
                         {.name = "offset",
                          .type = ParameterType::number,
                          .help = "The distance whose surface is drawn; 0 at first.",
                          .unit = "world units"},
                         {.name = "cracks",
                          .type = ParameterType::flag,
                          .help = "Mark where the surface is torn at a face between two cells."},
                         {.name = "defects",
                          .type = ParameterType::text,
                          .help = "Mark where this mesh has defects, as 'mesh --picture' does; own for the one that "
                                  "the field was made from.",
                          .valueName = "MESH|own|none"},
                         {.name = "clip",
                          .type = ParameterType::choice,
                          .help = "Cut across this axis; the half towards the camera is left out.",
                          .choices = {"none", "x", "y", "z"}},
                         {.name = "clip-offset",
                          .type = ParameterType::number,
                          .help = "Where the cut crosses that axis.",
                          .unit = "world units"}},
          .action = runSurface,
          .scriptOnly = true};
}

Command planeCommand() {
  return {.name = "plane",
          .summary = "Choose the plane of the explorer's slice, and what of it is seen.",
          .help =
              "As 'slice' has it, of the picture that 'show slice' chooses. What is not given stays as it is. With the "
              "mouse: drag to move, wheel to zoom.",
          .examples = {"plane axis=x offset=0.2", "plane through=0,0,0,1,1,0", "plane zoom=8 target=0.2,0.6,0"},
          .parameters = {{.name = "axis",
                          .type = ParameterType::choice,
                          .help = "The plane is perpendicular to this axis; z at first.",
                          .choices = {"x", "y", "z"}},
                         {.name = "offset",
                          .type = ParameterType::numbers,
                          .help = "Where the plane crosses that axis; auto is 0, or the domain's middle where 0 lies "
                                  "outside.",
                          .valueName = "NUMBER",
                          .unit = "world units",
                          .choices = {"auto"},
                          .counts = {1}},
                         {.name = "through",
                          .type = ParameterType::numbers,
                          .help = "A point of the plane and its normal instead.",
                          .valueName = "PX,PY,PZ,NX,NY,NZ",
                          .unit = "world units",
                          .counts = {6}},
                         {.name = "in-space",
                          .type = ParameterType::flag,
                          .help = "Whether the plane stands in the surface's picture too."},
                         {.name = "zoom",
                          .type = ParameterType::number,
                          .help = "How many times larger than with the whole section in the picture.",
                          .minimum = 0,
                          .minimumExcluded = true},
                         targetParameter("The point in the picture's middle, moved into the plane; center is the "
                                         "section's middle.")},
          .action = runPlane,
          .check = checkPlane,
          .scriptOnly = true};
}

Command colorCommand() {
  return {.name = "color",
          .summary = "Choose what the explorer's colours mean.",
          .help =
              "As in 'slice' and 'render'; the surface and the slice have colours of their own. Another quantity than "
              "before gets an automatic range.",
          .examples = {"color degree", "color value-jump range=1e-6,1e-2 scale=log"},
          .parameters = {{.name = "by",
                          .type = ParameterType::choice,
                          .help = "As in 'slice' and 'render'. normal is for surfaces, distance for slices.",
                          .choices = colorNames(),
                          .positional = true,
                          .need = Need::always},
                         {.name = "of",
                          .type = ParameterType::choice,
                          .help = "Of which picture; of the one that is shown when left out.",
                          .choices = {"surface", "slice"}},
                         {.name = "range",
                          .type = ParameterType::numbers,
                          .help = "What the ends of the scale of a jump, slope or error stand for; auto chooses.",
                          .valueName = "LOW,HIGH",
                          .choices = {"auto"},
                          .counts = {2}},
                         {.name = "scale",
                          .type = ParameterType::choice,
                          .help = "How such colours run between them; log at first.",
                          .choices = {"log", "linear"}},
                         {.name = "other",
                          .type = ParameterType::path,
                          .help = "For difference: the field to compare with, or none.",
                          .valueName = "FIELD"},
                         {.name = "mesh",
                          .type = ParameterType::text,
                          .help = "For error: what the field was made from, where it does not know that; or none.",
                          .valueName = "MESH"}},
          .action = runColor,
          .scriptOnly = true};
}

Command panelCommand() {
  Command command{.name = "panel",
                  .summary = "Open or close parts of the explorer's frame.",
                  .help = "What is not given stays as it is. The picture takes the room that closed parts leave.",
                  .examples = {"panel all=false", "panel build=false worst=true"},
                  .action = runPanel,
                  .scriptOnly = true};
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
                  .action = runSettings,
                  .scriptOnly = true};
  for (Parameter& parameter : buildParameters()) command.parameters.push_back(std::move(parameter));
  return command;
}

}  // namespace

void addViewCommands(Registry& registry) {
  registry.add(showCommand());
  registry.add(cameraCommand());
  registry.add(surfaceCommand());
  registry.add(planeCommand());
  registry.add(colorCommand());
  registry.add({.name = "cells",
                .summary = "Choose which of the octree's cells stand in the explorer's surface picture.",
                .help = "As 'render' has it. What is not given stays as it is.",
                .examples = {"cells lines depths=0-3", "cells boxes degrees=4,5 ; surface shown=false"},
                .parameters = {{.name = "style",
                                .type = ParameterType::choice,
                                .help = "Lines along their edges, or boxes of 0.8 of their extent.",
                                .choices = {"none", "lines", "boxes"},
                                .positional = true},
                               {.name = "degrees",
                                .type = ParameterType::text,
                                .help = "Only cells of these degrees: numbers and ranges, as in 2,4-6; or all.",
                                .valueName = "LIST"},
                               {.name = "depths",
                                .type = ParameterType::text,
                                .help = "Only cells of these depths; or all.",
                                .valueName = "LIST"}},
                .action = runCells,
                .scriptOnly = true});
  registry.add({.name = "arrows",
                .summary = "Draw arrows along the gradient in the explorer's picture.",
                .help = "Where its length is 1, an arrow is 0.8 of their distance long, but for what the projection "
                        "takes from it.",
                .examples = {"arrows 40", "arrows 0"},
                .parameters = {{.name = "apart",
                                .type = ParameterType::wholeNumber,
                                .help = "How far apart; 0 for none.",
                                .unit = "pixels",
                                .minimum = 0,
                                .maximum = 1000,
                                .positional = true,
                                .need = Need::always}},
                .action = runArrows,
                .scriptOnly = true});
  registry.add({.name = "beside",
                .summary = "Show another field beside the current one, in the same way.",
                .help =
                    "Left is the current field, right the other one; camera, plane, colours and their scale are the "
                    "same for both. 'color difference' shows how far they are apart.",
                .examples = {"beside coarse.hpsdf", "beside none"},
                .parameters = {{.name = "field",
                                .type = ParameterType::text,
                                .help = "The other field's file; none for the current one alone.",
                                .valueName = "FIELD",
                                .positional = true,
                                .need = Need::always}},
                .action = runBeside,
                .scriptOnly = true});
  registry.add(panelCommand());
  registry.add({.name = "worst",
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
                .action = runWorst,
                .scriptOnly = true});
  registry.add({.name = "fly",
                .summary = "Take a close look at one of the worst interfaces between cells, or at a point.",
                .help = "A slice goes through it; a camera looks at it, and what lies before it is cut away. 'verify' "
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
                .check = checkFly,
                .scriptOnly = true});
  registry.add({.name = "undo",
                .summary = "Take back the last change of what the explorer shows.",
                .help = "Changes by show (but for the frame's size and renderer), camera, surface, plane, cells, "
                        "arrows, color, "
                        "panel, worst and fly; what the mouse does in "
                        "one go is one change. The field itself is not changed back.",
                .examples = {"undo"},
                .action = runUndo,
                .scriptOnly = true});
  registry.add({.name = "redo",
                .summary = "Do again what 'undo' took back.",
                .help = "Until something else is changed.",
                .examples = {"redo"},
                .action = runRedo,
                .scriptOnly = true});
  registry.add({.name = "copy-view",
                .summary = "Write the lines of script that lead the explorer to what it shows.",
                .help = "To the file, or else to the standard output; in the window to its clipboard too.",
                .examples = {"copy-view", "copy-view output=view.hps"},
                .parameters =
                    {{.name = "output", .type = ParameterType::outputPath, .help = "The script's file.", .alias = 'o'}},
                .action = runCopyView,
                .scriptOnly = true});
  registry.add(settingsCommand());
  registry.add({.name = "rebuild",
                .summary = "Build the field anew, as 'settings' says.",
                .help = "What 'settings' does not say is as it was for the current field.",
                .examples = {"rebuild", "rebuild max-steps=100"},
                .parameters = {{.name = "max-steps",
                                .type = ParameterType::wholeNumber,
                                .help = "End after so many steps of the refinement: an earlier state of the field.",
                                .minimum = 0,
                                .maximum = std::numeric_limits<int>::max()}},
                .action = runRebuild,
                .scriptOnly = true});
  registry.add({.name = "shot",
                .summary = "Write the explorer's frame: the picture and the panels around it.",
                .help = "Pending work is finished first. 'pick' and 'expect pick(…)' then speak of its pixels. 'panel "
                        "all=false' leaves the picture alone.",
                .examples = {"shot output=frame.png"},
                .parameters = {{.name = "output",
                                .type = ParameterType::outputPath,
                                .help = "*.png.",
                                .alias = 'o',
                                .need = Need::always}},
                .action = runShot,
                .scriptOnly = true});
}

}  // namespace hpsdf::app
