#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <optional>

#include "commands/commands.h"
#include "console/failed.h"
#include "console/interrupt.h"
#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/output/contour.h"
#include "session/field_argument.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr double kDefaultTolerance = 0.001;  ///< of the longest side of the domain

void checkContour(const Arguments& arguments) { checkMeshWritable(arguments.text("output")); }

double toleranceOf(const Arguments& arguments, const Field& field) {
  const double longest = field.domain().sizes().maxCoeff();
  if (!arguments.given("tolerance")) return kDefaultTolerance * longest;
  return arguments.number("tolerance") * (arguments.isShare("tolerance") ? longest : 1);
}

struct MadeContour {
  Contour contour;
  double tolerance;
  bool isBlended;  ///< the field was blended for the contour
};

MadeContour makeContour(const Session& session, const Arguments& arguments) {
  const Field& field = session.current().field;
  MadeContour made{.contour = {},
                   .tolerance = toleranceOf(arguments, field),
                   .isBlended = field.data().blend == 0 && !arguments.flag("keep-jumps")};
  const ContourOptions options{
      .offset = arguments.number("offset"),
      .tolerance = made.tolerance,
      .domainCut = arguments.text("cut") == "open" ? DomainCut::open : DomainCut::wall,
      .threads = arguments.whole("threads"),
  };
  made.contour = withProgress(session.console(), [&](const Progress& progress) {
    return made.isBlended ? contour(blended(field), options, progress) : contour(field, options, progress);
  });
  return made;
}

Json contourJson(const MadeContour& made, const std::string& file) {
  const TriangleMesh& mesh = made.contour.mesh;
  return {{"output", file},
          {"file_bytes", std::filesystem::file_size(file)},
          {"vertices", mesh.vertices.size()},
          {"triangles", mesh.triangles.size()},
          {"area", surfaceArea(mesh)},
          {"volume", signedVolume(mesh)},
          {"tolerance", made.tolerance},
          {"greatest_value", made.contour.greatestValue},
          {"blended", made.isBlended},
          {"missed", made.contour.unresolved},
          {"crossing", made.contour.flawed}};
}

std::string contourText(const MadeContour& made, const std::string& file) {
  const TriangleMesh& mesh = made.contour.mesh;
  std::string text =
      fmt::format("{}: {} vertices, {} triangles, {}\n", file, grouped(mesh.vertices.size()),
                  grouped(mesh.triangles.size()), bytesText(static_cast<double>(std::filesystem::file_size(file))));
  text +=
      summaryRow("from the surface", fmt::format("the field is {} there at most, for a tolerance of {}",
                                                 shortNumber(made.contour.greatestValue), shortNumber(made.tolerance)));
  if (made.isBlended) text += summaryRow("field", "blended first, so that the mesh has no steps between cells");
  return text;
}

/// Returns what the mesh misses, in one line, or "".
std::string missedBy(const MadeContour& made) {
  if (made.contour.flawed > 0)
    return fmt::format("{} polygons of the mesh cross others: try another tolerance", grouped(made.contour.flawed));
  if (made.contour.unresolved > 0)
    return fmt::format(
        "{} triangles are farther from the surface than the tolerance, where it bends within the smallest cells or is "
        "torn: allow a greater tolerance, or build the field more accurately",
        grouped(made.contour.unresolved));
  return "";
}

void runContour(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  const InterruptGuard guard;  // on Ctrl-C, the file is written completely or not at all
  useField(session, arguments);
  const MadeContour made = makeContour(session, arguments);
  if (made.contour.mesh.triangles.empty())
    throw Error(fmt::format("offset: the field is above {} everywhere in its domain, so that there is no surface",
                            arguments.number("offset")));
  saveMesh(made.contour.mesh, file);
  std::ostream& result = session.console().out;
  if (session.wantsJson(arguments))
    printJson(result, contourJson(made, file));
  else
    result << contourText(made, file);
  if (const std::string missed = missedBy(made); !missed.empty()) throw Failed(missed);
}

const std::vector<Parameter> kContourParameters = {
    {"output", outputFile().as('o').required(), "File of the mesh, *.ply or *.obj."},
    {"offset", number().byDefault("0").in("field units"),
     "Value of the field on the surface: above 0 for a surface around the solid, below 0 for one within."},
    {"tolerance", number().above(0).orShare().in("field units"),
     "Greatest distance between the mesh and the field's surface, e.g. 0.002 or 0.1%, a percentage of the longest side "
     "of the domain; 0.1% by default. Parts and gaps thinner than twice this may be lost."},
    {"cut", choice({"wall", "open"}).byDefault("wall"),
     "What happens where the domain cuts the solid: a wall closes the mesh, or the mesh stays open there."},
    {"keep-jumps", flag(),
     "Follow the steps by which a field jumps between its cells. By default, a field that jumps is blended first, as "
     "'hpsdf blend' does it."}};

}  // namespace

void addContourCommand(Registry& registry) {
  registry.add({
      .name = "contour",
      .summary = "Write the surface of a field as a triangle mesh.",
      .help = paragraphs(R"(
Writes the surface on which the field has the value offset. Vertices lie on the surface, sharp edges of the field stay sharp,
and triangles are as large as the tolerance allows.

The mesh is a closed manifold without crossings, for any field: each edge belongs to two triangles, the triangles at a vertex
form one fan, and triangles meet at common edges and vertices only. Where the domain cuts the solid, a wall closes the mesh
half a tolerance within the domain.

The mesh is measured in the middle of each triangle and of its edges. The exit status is 1 where the tolerance is missed; the
mesh is written all the same.)"),
      .examples = {"hpsdf contour bunny.hpsdf -o bunny.ply", "hpsdf contour bunny.hpsdf -o coarse.obj --tolerance 1%",
                   "hpsdf contour gear.hpsdf -o grown.ply --offset 0.05 --tolerance 0.01"},
      .parameters = joined({{fieldParameter()}, kContourParameters, {threadsParameter("The mesh is")}}),
      .action = runContour,
      .check = checkContour,
  });
}

}  // namespace hpsdf::app
