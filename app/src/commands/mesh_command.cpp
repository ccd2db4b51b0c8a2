#include "commands/mesh_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "console/failed.h"
#include "console/long_work.h"
#include "construction/building.h"
#include "construction/mesh_summary.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/detail/sign_check.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/mesh_repair.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/render/mesh_picture.h"
#include "pictures/picture_arguments.h"
#include "session/backend.h"
#include "text/json.h"
#include "text/printable.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::size_t kPlacesInText = 3, kPlacesInJson = 100;

struct KindNames {
  const char *text, *json;
};
constexpr std::array<KindNames, kDefectKinds> kKinds = {{{"boundary edges", "boundary_edges"},
                                                         {"non-manifold edges", "non_manifold_edges"},
                                                         {"inconsistent edges", "inconsistent_edges"},
                                                         {"pinched vertices", "pinched_vertices"},
                                                         {"meets itself", "crossings"}}};

struct Inspected {
  ImportedMesh imported;
  MeshDefects defects = {};
  InsideTestChoice choice = {};
  std::optional<SignCheck> check = {};
};

Inspected inspected(Session& session, const Arguments& arguments) {
  Inspected found{.imported = importSurface(session.console(), arguments.text("mesh"))};
  const TriangleMesh& mesh = found.imported.mesh;
  const auto distance = distanceTo(session.console(), mesh);
  found.defects = findDefects(mesh, withProgress(session.console(), [&](const Progress& progress) {
                                return distance->crossings(kMostCrossings, progress);
                              }));
  found.choice = distance->insideTestChoice();
  if (arguments.given("check-sign"))
    found.check = withProgress(session.console(), [&](const Progress& progress) {
      return checkSign(mesh, *distance, static_cast<std::size_t>(arguments.number("check-sign")),
                       static_cast<std::uint64_t>(arguments.number("seed")), progress);
    });
  return found;
}

std::size_t placesWanted(const Arguments& arguments, std::size_t unsaid) {
  return arguments.given("places") ? static_cast<std::size_t>(arguments.number("places")) : unsaid;
}

bool isPlace(const Defect& defect) { return defect.ends[0] == defect.ends[1]; }

/// Those of a kind, the first ones.
std::span<const Defect> firstOf(const MeshDefects& defects, DefectKind kind, std::size_t limit) {
  const std::span<const Defect> all = defects.of(kind);
  return all.first(std::min(limit, all.size()));
}

Json defectsJson(const MeshDefects& defects, std::size_t limit) {
  Json json = Json::object();
  for (std::size_t i = 0; i < kDefectKinds; ++i) {
    Json places = Json::array();
    for (const Defect& defect : firstOf(defects, DefectKind(i), limit)) {
      Json place = {{"faces", defect.faces}};
      if (isPlace(defect))
        place["at"] = vectorJson(defect.ends[0]);
      else
        place["edge"] = {vectorJson(defect.ends[0]), vectorJson(defect.ends[1])};
      places.push_back(std::move(place));
    }
    json[kKinds[i].json] = {{"count", defects.counts[i]}, {"places", std::move(places)}};
  }
  json["crossings"]["all"] = defects.allCrossings;
  json["crossings"]["within_parts"] = defects.crossingsWithinParts;
  return json;
}

Json verdictJson(const MeshReport& report, const MeshDefects& defects) {
  return {{"closed", report.closed()},
          {"orientable", defects.orientable},
          {"self_folding", defects.crossingsWithinParts > 0},
          {"parts_overlap", defects.count(DefectKind::crossing) > defects.crossingsWithinParts}};
}

Json checkJson(const SignCheck& check) {
  Json json{{"places", check.places}, {"nearer_than", check.nearest}, {"near", check.tooNear}, {"wrong", check.wrong}};
  if (check.wrong > 0) json["worst"] = {{"at", vectorJson(check.worst)}, {"distance", check.depth}};
  return json;
}

Json repairJson(const RepairedMesh& mended, const std::string& file) {
  return {{"output", file},
          {"turned_faces", mended.turnedFaces},
          {"turned_patches", mended.turnedPatches},
          {"left_edges", mended.leftEdges},
          {"mesh", meshJson(file, mended.imported.report)}};
}

std::string verdictText(const MeshReport& report, const MeshDefects& defects) {
  std::string text = report.closed() ? "closed, " : "not closed, ";
  text += defects.orientable ? "orientable, " : "one-sided: no turning of faces makes them agree, ";
  if (defects.count(DefectKind::crossing) == 0) return text + "does not meet itself";
  if (defects.crossingsWithinParts == 0) return text + "parts pass through each other";
  text += "folds into itself";
  return defects.count(DefectKind::crossing) > defects.crossingsWithinParts
             ? text + ", and parts pass through each other"
             : text;
}

std::string placeText(const Defect& defect, const Box& mesh) {
  const std::string from = vectorText(defect.ends[0], mesh);
  return isPlace(defect) ? from : from + " to " + vectorText(defect.ends[1], mesh);
}

/// A row for each kind that there is, with its first places.
std::string defectsText(const MeshDefects& defects, const Box& mesh, std::size_t limit) {
  std::string text;
  for (std::size_t i = 0; i < kDefectKinds; ++i) {
    if (defects.counts[i] == 0) continue;
    std::string row = grouped(defects.counts[i]);
    if (DefectKind(i) == DefectKind::crossing)
      row =
          (defects.allCrossings ? "" : "at least ") + row + (defects.counts[i] == 1 ? " pair" : " pairs") + " of faces";
    std::string places;
    for (const Defect& defect : firstOf(defects, DefectKind(i), limit))
      places += (places.empty() ? ", as at " : "; ") + placeText(defect, mesh);
    text += summaryRow(kKinds[i].text, row + places);
  }
  return text;
}

std::string spacingText(const std::string& surface, const TriangleMesh& mesh) {
  const double spacing = coordinateSpacing(surface, mesh);
  if (spacing == 0) return "";
  return summaryRow("coordinates", fmt::format("kept {} apart by the reader", shortNumber(spacing)));
}

std::string checkText(const SignCheck& check) {
  std::string text = summaryRow(
      "sign checked", fmt::format("at {} places, {} of them nearer than {} to the surface", grouped(check.places),
                                  grouped(check.tooNear), shortNumber(check.nearest)));
  return text + summaryRow("wrong signs",
                           check.wrong == 0
                               ? "0"
                               : fmt::format("{}, the farthest from the surface at {}, {} away", grouped(check.wrong),
                                             vectorText(check.worst), shortNumber(check.depth)));
}

std::string repairText(const RepairedMesh& mended, const std::string& file) {
  const MeshReport& report = mended.imported.report;
  std::string done;
  const auto add = [&](std::size_t count, const std::string& what) {
    if (count > 0) done += (done.empty() ? "" : "; ") + what;
  };
  const std::size_t dropped = report.degenerateFaces + report.duplicateFaces;
  add(dropped, fmt::format("dropped {}", countOf(dropped, "face", "faces")));
  add(report.flippedFaces, fmt::format("flipped {}", countOf(report.flippedFaces, "edge", "edges")));
  add(mended.turnedFaces, fmt::format("turned {} as most of what hangs together with them looks",
                                      countOf(mended.turnedFaces, "face", "faces")));
  add(mended.turnedPatches,
      fmt::format("turned {} that looked inwards", countOf(mended.turnedPatches, "patch", "patches")));
  add(report.turned, "turned the whole mesh");
  std::string text = summaryRow("repaired", done.empty() ? "nothing to do" : done);
  if (mended.leftEdges > 0)
    text += summaryRow("left", countOf(mended.leftEdges, "edge", "edges") + " of surfaces that have one side only");
  return text + summaryRow("written", printable(file) + ": " + closednessText(report));
}

/// Draws the mesh with its defects.
void drawPicture(Session& session, const Arguments& arguments, const Inspected& found) {
  const render::SurfacePicture look = cameraPicture(arguments);
  render::MeshPicture picture{look.camera, look.width, look.height, look.samples, !arguments.given("camera")};
  picture.camera.up = arguments.text("up") == "z" ? render::UpAxis::z : render::UpAxis::y;
  const auto make = [&](std::vector<TriangleMesh> meshes) {
    auto renderer = makeBodyRenderer(std::move(meshes), backend(arguments));
    session.setLastRenderer(renderer->description());
    return renderer;
  };
  savePng(drawMesh(make, found.imported.mesh, found.defects, picture), arguments.text("picture"));
}

/// Draws it, if that is asked for. What it failed with, to be thrown once all the rest is told.
std::exception_ptr tryPicture(Session& session, const Arguments& arguments, const Inspected& found) {
  try {
    if (arguments.given("picture")) drawPicture(session, arguments, found);
  } catch (const std::exception&) {
    return std::current_exception();
  }
  return nullptr;
}

void checkMesh(const Arguments& arguments) {
  const bool draws = arguments.given("picture");
  requireOwner(arguments, "seed", "check-sign", arguments.given("check-sign"));
  requireOwner(arguments, "up", "picture", draws);
  for (const char* name : kLooks) requireOwner(arguments, name, "picture", draws);
  if (!draws) return;
  const std::string file = arguments.text("picture");
  if (lowerExtension(file) != ".png") throw Error(fmt::format("{}: pictures are written as .png", file));
  cameraPicture(arguments);
  backend(arguments);
}

void runMesh(Session& session, const Arguments& arguments) {
  const std::string surface = arguments.text("mesh");
  if (arguments.given("repair")) checkMeshWritable(arguments.text("repair"));
  if (arguments.given("picture")) checkWritable(arguments.text("picture"));
  const Inspected found = inspected(session, arguments);
  const MeshReport& report = found.imported.report;
  std::optional<RepairedMesh> mended;
  if (arguments.given("repair")) {
    mended = repaired(found.imported);
    saveMesh(mended->imported.mesh, arguments.text("repair"));
  }
  const std::exception_ptr undrawn = tryPicture(session, arguments, found);
  const bool drawn = arguments.given("picture") && !undrawn;
  if (session.wantsJson(arguments)) {
    Json json = meshJson(surface, report);
    json["coordinate_spacing"] = coordinateSpacing(surface, found.imported.mesh);
    json["verdict"] = verdictJson(report, found.defects);
    json["defects"] = defectsJson(found.defects, placesWanted(arguments, kPlacesInJson));
    json["sign"] = {{"by", insideTestName(found.choice.insideTest)}, {"because", found.choice.reason}};
    if (found.choice.place) json["sign"]["at"] = vectorJson(*found.choice.place);
    if (found.check) json["sign_check"] = checkJson(*found.check);
    if (mended) json["repair"] = repairJson(*mended, arguments.text("repair"));
    if (drawn) json["picture"] = arguments.text("picture");
    printJson(session.console().out, json);
  } else {
    session.console().out << meshText(printable(surface), report) << spacingText(surface, found.imported.mesh)
                          << defectsText(found.defects, report.box, placesWanted(arguments, kPlacesInText))
                          << summaryRow("verdict", verdictText(report, found.defects))
                          << summaryRow("sign", insideTestName(found.choice.insideTest) + ": " +
                                                    reasonText(found.choice, report.box))
                          << (found.check ? checkText(*found.check) : "")
                          << (mended ? repairText(*mended, arguments.text("repair")) : "")
                          << (drawn ? summaryRow("picture", printable(arguments.text("picture"))) : "");
  }
  if (undrawn) std::rethrow_exception(undrawn);
  if (found.check && found.check->wrong > 0)
    throw Failed(fmt::format("{}: {} of {} signs are wrong", surface, found.check->wrong, found.check->places));
}

/// As of `render`, but for what camera and target mean.
std::vector<Parameter> meshLookParameters(const Registry& registry) {
  std::vector<Parameter> parameters = lookParameters(registry);
  parameters.push_back(*findParameter(registry.command("render"), "up"));
  Parameter& camera = *std::ranges::find(parameters, "camera", &Parameter::name);
  camera.help =
      "Azimuth and elevation in degrees, and the eye's distance from the mesh's middle in diagonals of a cube around "
      "it. When left out, 30 and 20 degrees, as near as shows the whole mesh.";
  camera.defaultText.clear();
  std::ranges::find(parameters, "target", &Parameter::name)->help =
      "The point in the picture's middle, which the camera circles; the mesh's middle when left out. With a small "
      "distance in camera, a close look at a defect.";
  return parameters;
}

}  // namespace

Command meshCommand(const Registry& registry) {
  Command command{
      .name = "mesh",
      .summary = "Tell what is wrong with a mesh, where, and how its inside is told; mend and draw it.",
      .help =
          "Counts after welding equal positions, parts, volume, area, box, and what was dropped or turned on import. "
          "Then what a solid's surface would not have, with places: edges that are open, shared by more than two faces "
          "or run the same way by both of theirs, so that one looks the wrong way; vertices in which surfaces touch; "
          "and where faces meet others that are no neighbours, or neighbours beyond what they share, decided without "
          "rounding. And the sign that 'hpsdf build' would take by itself (--sign auto), with the reason.\n"
          "\n"
          "--repair writes the mesh as it was cleaned, its faces turned so that inside and outside are told "
          "consistently: the way of most of what hangs together with them, and closed parts outwards, but for "
          "cavities. It closes no holes and cuts no folds, which --sign winding can do with.\n"
          "\n"
          "--picture draws it: clay from outside, blue from behind, pale red where faces meet others, defects in "
          "colours of their own, small ones in rings, hidden ones dashed.\n"
          "\n"
          "--check-sign compares the sign with the winding number summed over all faces, at random places: half "
          "of them in and around the mesh's box, half close to its faces. Exit status 1 where one is wrong that is "
          "farther from the surface than a millionth of the mesh's longest side.",
      .examples = {"hpsdf mesh bunny.obj", "hpsdf mesh builtin:gear --json",
                   "hpsdf mesh chair.obj --picture defects.png --view corner",
                   "hpsdf mesh chair.obj --repair mended.obj", "hpsdf mesh bunny.obj --check-sign 100000"},
      .parameters = {{.name = "mesh",
                      .type = ParameterType::text,
                      .help = "Mesh file or builtin:SHAPE.",
                      .valueName = "MESH",
                      .positional = true,
                      .need = Need::always},
                     {.name = "repair",
                      .type = ParameterType::outputPath,
                      .help = "Write the mended mesh there, with all digits of its coordinates.",
                      .valueName = "FILE.obj|FILE.ply"},
                     {.name = "picture",
                      .type = ParameterType::outputPath,
                      .help = "Draw the mesh with its defects.",
                      .valueName = "FILE.png"},
                     {.name = "places",
                      .type = ParameterType::wholeNumber,
                      .help = "So many places at most of each kind of defect; when left out, 3, or 100 with json.",
                      .minimum = 0,
                      .maximum = 1e6},
                     {.name = "check-sign",
                      .type = ParameterType::wholeNumber,
                      .help = "Compare signs at so many random places: some 15 ns for each and each face.",
                      .valueName = "PLACES",
                      .minimum = 1,
                      .maximum = 1e9},
                     seedParameter()},
      .action = runMesh,
      .check = checkMesh};
  std::ranges::move(meshLookParameters(registry), std::back_inserter(command.parameters));
  return command;
}

}  // namespace hpsdf::app
