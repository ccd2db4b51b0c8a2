#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "commands/commands.h"
#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "construction/mesh_summary.h"
#include "construction/surface.h"
#include "hpsdf/app/failed.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/detail/sign_check.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/mesh_repair.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/render/mesh_picture.h"
#include "pictures/picture_arguments.h"
#include "session/backend.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::size_t kPositionsInText = 3, kPositionsInJson = 100;

struct KindNames {
  const char *text, *json;
};
constexpr std::array<KindNames, kDefectKinds> kKinds = {{{"boundary edges", "boundary_edges"},
                                                         {"non-manifold edges", "non_manifold_edges"},
                                                         {"inconsistent edges", "inconsistent_edges"},
                                                         {"pinched vertices", "pinched_vertices"},
                                                         {"self-intersections", "crossings"}}};

/// The results of one call of the command `mesh`.
struct MeshResults {
  std::string surface;
  TriangleMesh mesh;
  MeshReport report;
  MeshDefects defects = {};
  InsideTestChoice choice = {};
  std::optional<SignCheck> check = {};
  std::optional<RepairedMesh> repairedMesh = {};
  bool isDrawn = false;
};

MeshResults inspected(Session& session, const Arguments& arguments) {
  const Console& console = session.console();
  const std::string surface = arguments.text("mesh");
  auto [mesh, report] = importSurface(console, surface);
  MeshResults found{.surface = surface, .mesh = std::move(mesh), .report = report};
  const auto distance = distanceTo(console, found.mesh);
  found.defects = findDefects(found.mesh, withProgress(console, [&](const Progress& progress) {
                                return distance->crossings(kMaxCrossings, progress);
                              }));
  found.choice = distance->insideTestChoice();
  if (arguments.given("check-sign"))
    found.check = withProgress(console, [&](const Progress& progress) {
      return checkSign(found.mesh, *distance, static_cast<std::size_t>(arguments.number("check-sign")),
                       static_cast<std::uint64_t>(arguments.number("seed")), progress);
    });
  if (arguments.given("repair")) {
    found.repairedMesh = repaired({found.mesh, found.report});
    saveMesh(found.repairedMesh->imported.mesh, arguments.text("repair"));
  }
  return found;
}

std::size_t positionLimit(const Arguments& arguments, std::size_t otherwise) {
  return arguments.given("places") ? static_cast<std::size_t>(arguments.number("places")) : otherwise;
}

bool isPoint(const Defect& defect) { return defect.ends[0] == defect.ends[1]; }

/// Returns the first `limit` defects of one kind, or all of them if there are fewer.
std::span<const Defect> firstOf(const MeshDefects& defects, DefectKind kind, std::size_t limit) {
  const std::span<const Defect> all = defects.ofKind(kind);
  return all.first(std::min(limit, all.size()));
}

Json defectsJson(const MeshDefects& defects, std::size_t limit) {
  Json json = Json::object();
  for (std::size_t i = 0; i < kDefectKinds; ++i) {
    Json positions = Json::array();
    for (const Defect& defect : firstOf(defects, DefectKind(i), limit)) {
      Json position = {{"faces", defect.faces}};
      if (isPoint(defect))
        position["at"] = vectorJson(defect.ends[0]);
      else
        position["edge"] = {vectorJson(defect.ends[0]), vectorJson(defect.ends[1])};
      positions.push_back(std::move(position));
    }
    json[kKinds[i].json] = {{"count", defects.counts[i]}, {"places", std::move(positions)}};
  }
  json["crossings"]["all"] = defects.allCrossings;
  json["crossings"]["within_parts"] = defects.crossingsWithinComponents;
  return json;
}

Json verdictJson(const MeshReport& report, const MeshDefects& defects) {
  return {{"closed", report.closed()},
          {"orientable", defects.orientable},
          {"self_folding", defects.crossingsWithinComponents > 0},
          {"parts_overlap", defects.count(DefectKind::crossing) > defects.crossingsWithinComponents}};
}

Json checkJson(const SignCheck& check) {
  Json json{
      {"places", check.points}, {"nearer_than", check.tolerance}, {"near", check.tooNear}, {"wrong", check.wrong}};
  if (check.wrong > 0) json["worst"] = {{"at", vectorJson(check.worst)}, {"distance", check.worstDistance}};
  return json;
}

Json repairJson(const RepairedMesh& repairedMesh, const std::string& file) {
  return {{"output", file},
          {"turned_faces", repairedMesh.reversedFaces},
          {"turned_patches", repairedMesh.reversedPatches},
          {"left_edges", repairedMesh.imported.report.inconsistentEdges},
          {"mesh", meshJson(file, repairedMesh.imported.report)}};
}

std::string verdictText(const MeshReport& report, const MeshDefects& defects) {
  std::string text = report.closed() ? "closed, " : "not closed, ";
  text += defects.orientable ? "orientable, " : "one-sided: no orientation of the faces is consistent, ";
  if (defects.count(DefectKind::crossing) == 0) return text + "does not intersect itself";
  if (defects.crossingsWithinComponents == 0) return text + "parts intersect each other";
  text += "intersects itself";
  return defects.count(DefectKind::crossing) > defects.crossingsWithinComponents
             ? text + ", and parts intersect each other"
             : text;
}

std::string positionText(const Defect& defect, const Box& mesh) {
  const std::string from = vectorText(defect.ends[0], mesh);
  return isPoint(defect) ? from : from + " to " + vectorText(defect.ends[1], mesh);
}

/// Returns a table with one row for each kind of defect that occurs. A row shows the positions of the first
/// `limit` defects of its kind.
std::string defectsText(const MeshDefects& defects, const Box& mesh, std::size_t limit) {
  std::string text;
  for (std::size_t i = 0; i < kDefectKinds; ++i) {
    if (defects.counts[i] == 0) continue;
    std::string row = grouped(defects.counts[i]);
    if (DefectKind(i) == DefectKind::crossing)
      row =
          (defects.allCrossings ? "" : "at least ") + row + (defects.counts[i] == 1 ? " pair" : " pairs") + " of faces";
    std::string positions;
    for (const Defect& defect : firstOf(defects, DefectKind(i), limit))
      positions += (positions.empty() ? ", as at " : "; ") + positionText(defect, mesh);
    text += summaryRow(kKinds[i].text, row + positions);
  }
  return text;
}

std::string checkText(const SignCheck& check) {
  std::string text = summaryRow(
      "sign checked", fmt::format("at {} points, {} of them nearer than {} to the surface", grouped(check.points),
                                  grouped(check.tooNear), shortNumber(check.tolerance)));
  return text + summaryRow("wrong signs",
                           check.wrong == 0
                               ? "0"
                               : fmt::format("{}, the farthest from the surface at {}, {} away", grouped(check.wrong),
                                             vectorText(check.worst), shortNumber(check.worstDistance)));
}

std::string repairText(const RepairedMesh& repairedMesh, const std::string& file) {
  const MeshReport& report = repairedMesh.imported.report;
  std::string done;
  const auto add = [&](std::size_t count, const std::string& what) {
    if (count > 0) done += (done.empty() ? "" : "; ") + what;
  };
  const std::size_t removed = report.degenerateFaces + report.duplicateFaces;
  add(removed, fmt::format("removed {}", countOf(removed, "face", "faces")));
  add(report.flippedFaces, fmt::format("flipped {}", countOf(report.flippedFaces, "edge", "edges")));
  add(repairedMesh.reversedFaces,
      fmt::format("reversed {} against most of their component", countOf(repairedMesh.reversedFaces, "face", "faces")));
  add(repairedMesh.reversedPatches,
      fmt::format("reversed {} that faced inward", countOf(repairedMesh.reversedPatches, "patch", "patches")));
  add(report.reversed, "reversed the whole mesh");
  std::string text = summaryRow("repaired", done.empty() ? "nothing to do" : done);
  if (report.inconsistentEdges > 0)
    text +=
        summaryRow("left", countOf(report.inconsistentEdges, "edge", "edges") + " of surfaces that have one side only");
  return text + summaryRow("written", printable(file) + ": " + closednessText(report));
}

/// Draws the mesh and its defects into the file that the argument `picture` names.
void drawPicture(Session& session, const Arguments& arguments, const MeshResults& found) {
  const render::SurfacePicture look = cameraPicture(arguments);
  render::MeshPicture picture{look.camera, look.width, look.height, look.samples, !arguments.given("camera")};
  picture.camera.up = arguments.text("up") == "z" ? render::UpAxis::z : render::UpAxis::y;
  const auto make = [&](std::vector<TriangleMesh> meshes) {
    auto renderer = makeBodyRenderer(std::move(meshes), backend(arguments));
    session.setLastRenderer(renderer->description());
    return renderer;
  };
  savePng(drawMesh(make, found.mesh, found.defects, picture), arguments.text("picture"));
}

void checkMesh(const Arguments& arguments) {
  const bool draws = arguments.given("picture");
  requireOwner(arguments, "seed", "check-sign", arguments.given("check-sign"));
  requireOwner(arguments, "up", "picture", draws);
  for (const char* name : kCameraParameters) requireOwner(arguments, name, "picture", draws);
  if (!draws) return;
  const std::string file = arguments.text("picture");
  requirePng(file);
  cameraPicture(arguments);
  backend(arguments);
}

Json resultsJson(const MeshResults& results, const Arguments& arguments) {
  Json json = meshJson(results.surface, results.report);
  json["verdict"] = verdictJson(results.report, results.defects);
  json["defects"] = defectsJson(results.defects, positionLimit(arguments, kPositionsInJson));
  json["sign"] = {{"by", insideTestName(results.choice.insideTest)}, {"because", results.choice.reason}};
  if (results.choice.position) json["sign"]["at"] = vectorJson(*results.choice.position);
  if (results.check) json["sign_check"] = checkJson(*results.check);
  if (results.repairedMesh) json["repair"] = repairJson(*results.repairedMesh, arguments.text("repair"));
  if (results.isDrawn) json["picture"] = arguments.text("picture");
  return json;
}

std::string resultsText(const MeshResults& results, const Arguments& arguments) {
  const MeshReport& report = results.report;
  std::string text = meshText(printable(results.surface), report);
  text += defectsText(results.defects, report.box, positionLimit(arguments, kPositionsInText));
  text += summaryRow("verdict", verdictText(report, results.defects));
  text += summaryRow("sign", insideTestName(results.choice.insideTest) + ": " + reasonText(results.choice, report.box));
  if (results.check) text += checkText(*results.check);
  if (results.repairedMesh) text += repairText(*results.repairedMesh, arguments.text("repair"));
  if (results.isDrawn) text += summaryRow("picture", printable(arguments.text("picture")));
  return text;
}

void runMesh(Session& session, const Arguments& arguments) {
  if (arguments.given("repair")) checkMeshWritable(arguments.text("repair"));
  if (arguments.given("picture")) checkWritable(arguments.text("picture"));
  MeshResults results = inspected(session, arguments);
  std::exception_ptr pictureError;  // rethrown after all other results are printed
  try {
    if (arguments.given("picture")) drawPicture(session, arguments, results);
    results.isDrawn = arguments.given("picture");
  } catch (const std::exception&) {
    pictureError = std::current_exception();
  }
  if (session.wantsJson(arguments))
    printJson(session.console().out, resultsJson(results, arguments));
  else
    session.console().out << resultsText(results, arguments);
  if (pictureError) std::rethrow_exception(pictureError);
  if (const auto& check = results.check; check && check->wrong > 0)
    throw Failed(fmt::format("{}: {} of {} signs are wrong", results.surface, check->wrong, check->points));
}

const std::vector<Parameter> kMeshParameters = {
    {"mesh", text("MESH").positional().required(), "Mesh file or builtin:SHAPE."},
    {"repair", outputFile("FILE.obj|FILE.ply"), "Writes the repaired mesh, with all digits of its coordinates."},
    {"picture", outputFile("FILE.png"), "Draws the mesh with its defects."},
    {"places", wholeNumber().within(0, 1e6),
     "Greatest number of positions to list for each kind of defect. When left out, 3, or 100 with json."},
    {"check-sign", wholeNumber("POINTS").within(1, 1e9),
     "Compares signs at this number of random points. Each takes about 15 ns a face."}};

/// Returns the camera parameters of `render`, with the defaults that fit a mesh.
std::vector<Parameter> meshLookParameters(const Registry& registry) {
  std::vector<Parameter> parameters = cameraParameters(registry);
  parameters.push_back(*findParameter(registry.command("render"), "up"));
  Parameter& camera = parameterNamed("camera", parameters);
  camera.help =
      "Azimuth and elevation in degrees, and the distance of the eye from the middle of the mesh in diagonals of a "
      "cube around it. When left out, 30 and 20 degrees, at the distance that just shows the whole mesh.";
  camera.defaultText.clear();
  parameterNamed("target", parameters).help =
      "Point in the middle of the picture, around which the camera turns; the middle of the mesh when left out. A "
      "small distance in camera shows a defect from nearby.";
  return parameters;
}

}  // namespace

void addMeshCommand(Registry& registry) {
  registry.add({
      .name = "mesh",
      .summary = "Find the defects of a mesh and how its inside is decided; repair and draw it.",
      .help = paragraphs(R"(
Prints counts after welding equal positions, parts, volume, area, box, and the triangles that were removed or reversed
on import. Then it lists defects with their positions: edges that are open, shared by more than two faces, or run along
in the same direction by both of their faces, so that one face is reversed; vertices at which surfaces touch; and faces
that intersect others, decided without rounding. The last line names the inside test that 'hpsdf build' would choose
(--sign auto), with the reason.

--repair writes the cleaned mesh with consistent orientations: each face is oriented like most faces of its component,
and closed parts outward, except cavities. It closes no holes and removes no intersections; --sign winding works with
both.

--picture draws the mesh: clay from outside, blue from inside, pale red where faces intersect others. Defects have
colours of their own; small ones are ringed, hidden ones dashed.

--check-sign compares the sign with the winding number, summed over all faces, at random points: half of them in and
around the mesh's box, half close to its faces. The exit status is 1 where the sign is wrong farther from the surface
than a millionth of the mesh's longest side.)"),
      .examples = {"hpsdf mesh bunny.obj", "hpsdf mesh builtin:gear --json",
                   "hpsdf mesh chair.obj --picture defects.png --view corner",
                   "hpsdf mesh chair.obj --repair repaired.obj", "hpsdf mesh bunny.obj --check-sign 100000"},
      .parameters = joined({kMeshParameters, {seedParameter()}, meshLookParameters(registry)}),
      .action = runMesh,
      .check = checkMesh,
  });
}

}  // namespace hpsdf::app
