#include <fmt/format.h>

#include <cmath>

#include "explorer/explorer.h"
#include "explorer/explorer_commands.h"
#include "pictures/picture_arguments.h"
#include "pictures/up_axis.h"
#include "session/field_operands.h"

namespace hpsdf::app {
namespace {

/// Returns the point that the argument `target` gives. Returns std::nullopt for the word "center".
std::optional<Vector3> targetOf(const Arguments& arguments) {
  if (arguments.text("target") == "center") return std::nullopt;
  return pointOf(arguments, "target");
}

/// Returns the text of the parameter `name`. Returns "" if the text is the word "none".
std::string textOrNone(const Arguments& arguments, const char* name) {
  return arguments.text(name) == "none" ? "" : arguments.text(name);
}

void changeShow(ViewState& view, const Arguments& arguments, Session&) {
  if (arguments.given("kind")) view.slice = arguments.text("kind") == "slice";
  if (arguments.given("size")) {
    view.width = arguments.size("size")[0];
    view.height = arguments.size("size")[1];
  }
  if (arguments.given("scale")) view.scale = arguments.number("scale");
  if (arguments.given("samples")) view.samples = arguments.whole("samples");
  if (arguments.given("cpu") || arguments.given("gl")) view.backend = backend(arguments);
}

/// Sets the axis that points up, or leaves it to a guess for the current field and for later ones.
void changeUp(ViewState& view, const std::string& up, Session& session) {
  view.guessesUp = up == "auto";
  if (!view.guessesUp)
    view.camera.up = up == "z" ? render::UpAxis::z : render::UpAxis::y;
  else if (session.hasField())
    view.camera.up = guessedUp(session.current().field);
}

void changeCamera(ViewState& view, const Arguments& arguments, Session& session) {
  render::OrbitCamera& camera = view.camera;
  if (arguments.given("orbit")) {
    const auto n = arguments.numbers("orbit");
    camera.azimuthDegrees = n[0];
    camera.elevationDegrees = n[1];
    camera.distance = n[2];
  }
  if (arguments.given("view") && arguments.text("view") != "any") turnTo(camera, arguments.text("view"));
  if (arguments.given("target")) camera.target = targetOf(arguments);
  if (arguments.given("up")) changeUp(view, arguments.text("up"), session);
  if (arguments.given("projection"))
    camera.projection = arguments.text("projection") == "orthographic" ? render::Projection::orthographic
                                                                       : render::Projection::perspective;
}

void checkCamera(const Arguments& arguments) {
  if (!arguments.given("orbit")) return;
  if (arguments.given("view")) throw Error("view: excludes azimuth, elevation and distance; give one or the other");
  const auto n = arguments.numbers("orbit");
  if (!(std::abs(n[1]) <= 90)) throw Error("camera: expected an elevation from -90 to 90 degrees");
  if (!(n[2] > 0)) throw Error("camera: expected a distance above 0, in domain diagonals");
}

void changeSurface(ViewState& view, const Arguments& arguments, Session& session) {
  if (arguments.given("offset")) view.surfaceOffset = arguments.number("offset");
  if (arguments.given("shown")) view.surface = arguments.flag("shown");
  if (arguments.given("shadows")) view.shadows = arguments.flag("shadows");
  if (arguments.given("edges")) view.edges = arguments.flag("edges");
  if (arguments.given("cracks")) view.cracks = arguments.flag("cracks");
  if (arguments.given("defects")) {
    view.defects = textOrNone(arguments, "defects");
    if (!view.defects.empty()) session.defects(view.defects);  // reports an unreadable mesh now, not at the next frame
  }
  if (arguments.given("clip")) {
    const std::string axis = arguments.text("clip");
    const int across = axis[0] - 'x';
    if (axis == "none")
      view.clip.reset();
    else if (!view.clip || view.clip->axis != across)
      view.clip = render::ClipPlane{
          across, session.hasField() ? defaultOffset(shownBox(session.current().field), across) : 0.0};
  }
  if (arguments.given("clip-offset")) {
    if (!view.clip) throw Error("clip-offset: needs clip, the axis that it lies on");
    view.clip->offset = arguments.number("clip-offset");
  }
}

void changePlane(ViewState& view, const Arguments& arguments, Session& session) {
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
  if (arguments.given("target")) view.sliceTarget = targetOf(arguments);
  if (arguments.given("operands")) {
    view.operands = textOrNone(arguments, "operands");
    if (!view.operands.empty() && session.hasField())
      session.operands(view.operands);  // reports an unreadable file now
  }
}

void checkPlane(const Arguments& arguments) {
  if (arguments.given("operands") && arguments.text("operands") != "none") checkOperands(arguments.text("operands"));
  if (arguments.given("through") && (arguments.given("axis") || arguments.given("offset")))
    throw Error("through: excludes axis and offset; give one or the other");
}

void changeColor(ViewState& view, const Arguments& arguments, Session&) {
  const bool slice = arguments.given("of") ? arguments.text("of") == "slice" : view.slice;
  Coloring& colors = slice ? view.sliceColors : view.surfaceColors;
  const render::ColorBy by = colorNamed(arguments.text("by"));
  if (by == (slice ? render::ColorBy::normal : render::ColorBy::distance))
    throw Error(fmt::format("by: {} is not for a {}; give another colour", colorName(by), slice ? "slice" : "surface"));
  if (by != colors.by) {  // the old limits are for another quantity, and the old map may be for another kind
    colors.scale.limits.reset();
    colors.scale.map.clear();
  }
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
  if (arguments.given("per-cell")) colors.scale.perCell = arguments.flag("per-cell");
  if (arguments.given("map")) {
    colors.scale.map = arguments.text("map") == "auto" ? "" : arguments.text("map");
    checkMap(colors.scale.map, by);
  }
  if (arguments.given("scale")) colors.scale.logarithmic = arguments.text("scale") == "log";
  if (colors.scale.limits && !((*colors.scale.limits)[0] < (*colors.scale.limits)[1]))
    throw Error("range: expected LOW,HIGH with LOW below HIGH");
  if (colors.scale.limits && render::isQuantity(by) && colors.scale.logarithmic && !((*colors.scale.limits)[0] > 0))
    throw Error("range: a logarithmic scale needs limits above 0; give others, or scale=linear");
}

void changeCells(ViewState& view, const Arguments& arguments, Session&) {
  if (arguments.given("style")) view.cells.style = cellStyle(arguments.text("style"));
  const auto levels = [&](const char* name, int most) {
    return arguments.text(name) == "all" ? std::vector<int>() : levelList(arguments.text(name), name, most);
  };
  if (arguments.given("degrees")) view.cells.degrees = levels("degrees", kMaxDegree);
  if (arguments.given("depths")) view.cells.depths = levels("depths", kMaxDepth);
  if (arguments.given("at-surface")) view.cells.atSurface = arguments.flag("at-surface");
}

void changeTriangles(ViewState& view, const Arguments& arguments, Session& session) {
  if (arguments.given("shown")) view.triangles = arguments.flag("shown");
  if (arguments.given("tolerance")) view.trianglesTolerance = arguments.text("tolerance");
  if (arguments.given("simplify")) view.trianglesSimplified = arguments.flag("simplify");
  if (!view.triangles || !session.hasField()) return;
  // The contour is made here, where it can be cancelled, and not while a frame is drawn.
  session.contour(contourChoice(view, session.current().field));
}

void changeArrows(ViewState& view, const Arguments& arguments, Session&) { view.arrows = arguments.whole("apart"); }

void changeBeside(ViewState& view, const Arguments& arguments, Session& session) {
  view.beside = textOrNone(arguments, "field");
  if (!view.beside.empty()) session.other(view.beside);  // reports an unreadable file now, not at the next frame
}

Parameter targetParameter(const std::string& help) {
  return {"target", numbers("X,Y,Z", {3}).orWords({"center"}).in("world units").under(kCamera), help};
}

void addShowCommand(Registry& registry) {
  registry.addForScripts({
      .name = "show",
      .summary = "Choose what the explorer shows: the surface in space, or the flat picture of a plane.",
      .help =
          "The explorer is a picture of the current field with panels around it: 'shot' writes it, 'hpsdf view' opens "
          "it in a window. camera and surface lead the one, plane the other.",
      .examples = {"show slice size=1280x720", "show surface samples=2 gl=software"},
      .parameters = joined(
          {{{"kind", choice({"surface", "slice"}).positional(), "The surface, or a slice."},
            {"size", size(64, 8192).under(kPicture), "Of the whole frame, panels included; 1280x720 at first."},
            {"scale", number().within(kLeastScale, kGreatestScale).under(kPicture),
             "Pixels per point, the unit of text and panels, for screens with many pixels per inch; 1 at first."},
            {"samples", wholeNumber().within(1, 8).under(kPicture), "Samples a pixel along each axis; 1 at first."}},
           backendParameters()}),
      .action = changing(changeShow),
  });
}

void addSurfaceCommands(Registry& registry) {
  std::vector<std::string> directions = viewNames();
  directions.insert(directions.begin(), "any");
  registry.addForScripts({
      .name = "camera",
      .summary = "Move the explorer's camera.",
      .help =
          "It looks at the surface in space. What is not given stays as it is; 'copy-view' tells how it stands. With "
          "the mouse: drag to turn, drag with the right button to move the target, wheel to go nearer.",
      .examples = {"camera 120,10,0.9", "camera view=front target=0.2,0.6,-0.1"},
      .parameters =
          {{"orbit", numbers("AZIMUTH,ELEVATION,DISTANCE", {3}).positional(),
            "Azimuth and elevation in degrees, and the eye's distance from the target in diagonals of the "
            "domain; 30,20,1.1 at first."},
           {"view", choice(directions).under(kCamera),
            "A named direction from which the camera looks; any leaves it as it is."},
           targetParameter("The point in the picture's middle; center is the domain's."),
           {"up", choice({"auto", "y", "z"}).under(kCamera).advanced(),
            "The axis that points up; auto guesses it for this field and for each later one: z if the surface has "
            "twice as large a flat base below z as below y, otherwise y. The window begins with auto, scripts "
            "with y."},
           {"projection", choice({"perspective", "orthographic"}).under(kCamera).advanced(),
            "How rays run: from the eye, or parallel."}},
      .action = changing(changeCamera),
      .check = checkCamera,
  });
  registry.addForScripts({
      .name = "surface",
      .summary = "Choose which surface the explorer shows, and where it is cut open.",
      .help = "As 'render' has it, of the picture that 'show surface' chooses. What is not given stays as it is.",
      .examples = {"surface offset=0.05", "surface clip=z clip-offset=0.1"},
      .parameters =
          {{"shown", flag(""), "Draw the surface; without it, planes and cells can be looked at alone."},
           {"offset", number().in("world units"), "The distance whose surface is drawn; 0 at first."},
           {"shadows", flag("").under(kDrawn).advanced(),
            "Darken folds, and let the solid throw a soft shadow, once the view rests."},
           {"edges", flag("").under(kDrawn),
            "Draw lines where the surface bends by more than 30 degrees, and outlines."},
           {"cracks", flag("").under(kDrawn).advanced(), "Mark where the surface is torn at a face between two cells."},
           {"defects", text("MESH|own|none").under(kDrawn).advanced(),
            "Mark where this mesh has defects, as 'mesh --picture' does; own for the one that the field was "
            "made from."},
           {"clip", choice({"none", "x", "y", "z"}).under(kDrawn),
            "Cut across this axis; the half towards the camera is left out."},
           {"clip-offset", number().in("world units").under(kDrawn),
            "Where the cut crosses that axis; another axis than before starts at the middle of the surface's box."}},
      .action = changing(changeSurface),
  });
}

void addPlaneAndColorCommands(Registry& registry) {
  std::vector<std::string> maps = mapNames();
  maps.insert(maps.begin(), "auto");
  registry.addForScripts({
      .name = "plane",
      .summary = "Choose the plane of the explorer's slice, and what of it is seen.",
      .help = "As 'slice' has it, of the picture that 'show slice' chooses. What is not given stays as it is. With the "
              "mouse: drag to move, wheel to zoom.",
      .examples = {"plane axis=x offset=0.2", "plane through=0,0,0,1,1,0", "plane zoom=8 target=0.2,0.6,0"},
      .parameters =
          {{"axis", choice({"x", "y", "z"}), "The plane is perpendicular to this axis; z at first."},
           {"offset", numbers("NUMBER", {1}).orWords({"auto"}).in("world units"),
            "Where the plane crosses that axis; auto is the middle of the surface's box."},
           {"through", numbers("PX,PY,PZ,NX,NY,NZ", {6}).in("world units"),
            "A point of the plane and its normal instead."},
           {"in-space", flag(""), "Draw the plane in the surface's picture, too."},
           {"zoom", number().above(0), "How many times larger than with the whole section in the picture."},
           targetParameter("The point in the picture's middle, moved into the plane; center is the "
                           "section's middle."),
           {"operands", text("EXPRESSION|own|none").under(kDrawn).advanced(),
            "Draw the outlines of the operands of an expression such as union(a.obj, b.obj), each in a colour of its "
            "own. The word own stands for the expression from which the field was combined."}},
      .action = changing(changePlane),
      .check = checkPlane,
  });
  registry.addForScripts({
      .name = "color",
      .summary = "Choose what the explorer's colours mean.",
      .help = "As in 'slice' and 'render'; the surface and the slice have colours of their own. Another quantity than "
              "before gets an automatic range.",
      .examples = {"color degree", "color value-jump range=1e-6,1e-2 scale=log"},
      .parameters =
          {{"by", choice(colorNames()).positional().required(),
            "normal lights a surface, distance shows iso-lines in a slice; degree and depth show the cells. " +
                quantityHelp()},
           {"of", choice({"surface", "slice"}), "Of which picture; of the one that is shown when left out."},
           {"range", numbers("LOW,HIGH", {2}).orWords({"auto"}).under(kColours),
            "The jumps, slopes or errors at the ends of the colour scale; auto chooses them."},
           {"per-cell", flag("").under(kColours),
            "Colour each cell by the greatest value that the picture shows of it."},
           {"scale", choice({"log", "linear"}).under(kColours).advanced(),
            "How the colours of a jump, slope or error run between the ends of their scale; log at first."},
           {"map", choice(maps).under(kColours).advanced(),
            "The colour map; auto is the standard one of what the colours show."},
           {"other", file("FIELD"), "For difference: the field to compare with, or none."},
           {"mesh", text("MESH"), "For error: what the field was made from, where it does not know that; or none."}},
      .action = changing(changeColor),
  });
}

void addTrianglesCommand(Registry& registry) {
  registry.addForScripts({
      .name = "triangles",
      .summary = "Show the triangles that 'contour' would write.",
      .help = "The picture of the surface shows their edges, a slice the line in which its plane cuts them, with dots "
              "where "
              "the line bends if there is room. They are made for the offset of 'surface', anew by each command that "
              "changes "
              "the field, the offset or the tolerance, which can take seconds; where they cannot be made for another "
              "field, "
              "they are hidden. The statistics say how many there are and how far they are from the surface.",
      .examples = {"triangles shown=true", "triangles tolerance=0.5% simplify=true"},
      .parameters =
          {{"shown", flag(""), "Draw the triangles of the surface, as a file of triangles would have them."},
           {"tolerance", number().above(0).orShare().in("field units"),
            "How far the triangles may be from the surface: a length, or a percentage of the longest side of the "
            "domain; 0.1% at first."},
           {"simplify", flag(""),
            "Merge vertices as far as the tolerance allows. It takes five to seven times as long."}},
      .action = changing(changeTriangles),
  });
}

void addCellsAndArrowsCommands(Registry& registry) {
  registry.addForScripts({
      .name = "cells",
      .summary = "Choose which of the octree's cells stand in the explorer's surface picture.",
      .help = "As 'render' has it. What is not given stays as it is.",
      .examples = {"cells lines depths=0-3", "cells boxes degrees=4,5 ; surface shown=false"},
      .parameters = {{"style", choice({"none", "lines", "boxes"}).positional(),
                      "Lines along their edges, or boxes of 0.8 of their extent."},
                     {"degrees", text("LIST").under(kDrawn).advanced(),
                      "Only cells of these degrees: numbers, ranges and the word exact, as in 2,4-6,exact; or all."},
                     {"depths", text("LIST").under(kDrawn).advanced(), "Only cells of these depths; or all."},
                     {"at-surface", flag("").under(kDrawn), "Only cells that the surface crosses."}},
      .action = changing(changeCells),
  });
  registry.addForScripts({
      .name = "arrows",
      .summary = "Draw arrows along the gradient in the explorer's picture.",
      .help =
          "Where its length is 1, an arrow is 0.8 of their distance long, but for what the projection takes from it.",
      .examples = {"arrows 40", "arrows 0"},
      .parameters = {{"apart", wholeNumber().within(0, 1000).in("points").positional().required(),
                      "How far apart the arrows are; 0 for none. A point is a pixel at a scale of 1."}},
      .action = changing(changeArrows),
  });
  registry.addForScripts({
      .name = "beside",
      .summary = "Show another field beside the current one, in the same way.",
      .help = "Left is the current field, right the other one; camera, plane, colours and their scale are the same for "
              "both. 'color difference' shows how far they are apart.",
      .examples = {"beside coarse.hpsdf", "beside none"},
      .parameters =
          {{"field", text("FIELD").positional().required(),
            "The other field's file, or kept for the field before the last one that was rebuilt for comparison; none "
            "for the current one alone."}},
      .action = changing(changeBeside),
  });
}

}  // namespace

std::function<void(Session&, const Arguments&)> changing(void (*change)(ViewState&, const Arguments&, Session&)) {
  return [change](Session& session, const Arguments& arguments) {
    ViewState view = explorerOf(session).view();
    change(view, arguments, session);
    explorerOf(session).change(std::move(view));
  };
}

void addExplorerPictureCommands(Registry& registry) {
  addShowCommand(registry);
  addSurfaceCommands(registry);
  addPlaneAndColorCommands(registry);
  addCellsAndArrowsCommands(registry);
  addTrianglesCommand(registry);
}

}  // namespace hpsdf::app
