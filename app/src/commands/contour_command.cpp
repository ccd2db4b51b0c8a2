#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <set>
#include <span>
#include <string_view>

#include "commands/commands.h"
#include "commands/contour_colors.h"
#include "console/interrupt.h"
#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "hpsdf/app/failed.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/output/contour.h"
#include "session/field_argument.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::string_view kOffsetMark = "{offset}";  ///< stands for the offset in the name of a file

/// Returns the file for a surface with this offset.
std::string fileOf(const std::string& output, double offset) {
  std::string file = output;
  if (const std::size_t mark = file.find(kOffsetMark); mark != std::string::npos)
    file.replace(mark, kOffsetMark.size(), fmt::format("{}", offset));
  return file;
}

void checkContour(const Arguments& arguments) {
  if (arguments.given("tolerance") && arguments.given("resolution"))
    throw Error("resolution excludes tolerance: give one of them");
  const std::string output = arguments.text("output");
  const std::vector<double> offsets = arguments.numbers("offset");
  if (offsets.size() > 1 && output.find(kOffsetMark) == std::string::npos)
    throw Error(fmt::format("output: {} surfaces need a file each; write {} in the name, such as surface-{}.ply",
                            offsets.size(), kOffsetMark, kOffsetMark));
  std::set<std::string> files;
  for (const double offset : offsets) {
    const std::string file = fileOf(output, offset);
    checkMeshWritable(file);
    checkVertexColors(arguments, file);
    if (!files.insert(file).second)
      throw Error(fmt::format("offset: {} is given twice; the surfaces would have the same file", offset));
  }
}

double toleranceOf(const Arguments& arguments, const Field& field) {
  const double longest = field.domain().sizes().maxCoeff();
  double tolerance = kDefaultContourTolerance * longest;
  if (arguments.given("resolution")) tolerance = longest / arguments.number("resolution");
  if (arguments.given("tolerance"))
    tolerance = arguments.number("tolerance") * (arguments.isShare("tolerance") ? longest : 1);
  const double least = leastSinglePrecisionTolerance(field);
  if (isSinglePrecisionMesh(arguments.text("output")) && tolerance < least)
    throw Error(
        fmt::format("tolerance: {} is too small for the single-precision numbers of this format; allow at "
                    "least {}, or write .ply or .obj",
                    shortNumber(tolerance), shortNumber(least)));
  return tolerance;
}

/// A surface that was written.
struct WrittenContour {
  std::string file;
  double offset;
  double tolerance;
  bool isBlended;  ///< the field was blended for the contour
  Contour contour;
  std::optional<render::PointColors> colors;
};

Json contourJson(const Arguments& arguments, const WrittenContour& written) {
  const Contour& made = written.contour;
  return {{"output", written.file},
          {"file_bytes", std::filesystem::file_size(written.file)},
          {"offset", written.offset},
          {"vertices", made.mesh.vertices.size()},
          {"triangles", made.mesh.triangles.size()},
          {"area", surfaceArea(made.mesh)},
          {"volume", signedVolume(made.mesh)},
          {"tolerance", written.tolerance},
          {"greatest_value", made.greatestValue},
          {"greatest_gap", made.greatestGap},
          {"blended", written.isBlended},
          {"missed", made.unresolved},
          {"cells_with_lost_parts", made.lostParts},
          {"cells_with_multiple_sheets", made.multipleSheets},
          {"divided_polygons", made.fans},
          {"crossing", made.flawed},
          {"color", vertexColorJson(arguments, written.colors)}};
}

std::string contourText(const Arguments& arguments, const WrittenContour& written) {
  const Contour& made = written.contour;
  std::string text = fmt::format("{}: {} vertices, {} triangles, {}\n", written.file,
                                 grouped(made.mesh.vertices.size()), grouped(made.mesh.triangles.size()),
                                 bytesText(static_cast<double>(std::filesystem::file_size(written.file))));
  text += summaryRow(
      "from the surface",
      fmt::format("{} at most, and the surface at most {} from the mesh, for a tolerance of {}",
                  shortNumber(made.greatestValue), shortNumber(made.greatestGap), shortNumber(written.tolerance)));
  if (written.isBlended) text += summaryRow("field", "blended first, so that the mesh has no steps between cells");
  if (written.colors) text += summaryRow("colours", vertexColorText(arguments, *written.colors));
  if (made.lostParts > 0)
    text += summaryRow("lost", fmt::format("thin parts or gaps of the field, in {} cells", grouped(made.lostParts)));
  if (made.multipleSheets > 0)
    text += summaryRow("kept apart", fmt::format("several sheets of the surface, in {} of the smallest cells",
                                                 grouped(made.multipleSheets)));
  return text;
}

/// Returns what the mesh misses, in one line, or "".
std::string missedBy(const Contour& made) {
  if (made.flawed > 0)
    return fmt::format("{} polygons of the mesh cross others: try another tolerance", grouped(made.flawed));
  if (made.unresolved > 0)
    return fmt::format(
        "the mesh is farther from the surface than the tolerance in {}, where it bends within the smallest cells "
        "or is torn: allow a greater tolerance, or build the field more accurately",
        countOf(made.unresolved, "place", "places"));
  return "";
}

VertexData vertexDataOf(const Arguments& arguments, const WrittenContour& written) {
  VertexData data;
  if (!arguments.flag("no-normals")) data.normals = written.contour.normals;
  if (written.colors) data.colors = written.colors->colors;
  return data;
}

/// Makes the surfaces of all offsets, and then writes them, so that an error leaves no files behind.
std::vector<WrittenContour> writeContours(Session& session, const Arguments& arguments) {
  const Field& current = session.current().field;
  const int threads = arguments.whole("threads");
  const double tolerance = toleranceOf(arguments, current);
  const render::ReferenceData colorData = vertexColorData(session, arguments);
  std::vector<WrittenContour> all;
  for (const double offset : arguments.numbers("offset")) {
    const std::string file = fileOf(arguments.text("output"), offset);
    const Field* followed = &current;
    if (!arguments.flag("keep-jumps")) followed = withThreads(threads, [&] { return &session.fieldOfContour(offset); });
    const ContourOptions options{.offset = offset,
                                 .tolerance = tolerance,
                                 .domainCut = arguments.text("cut") == "open" ? DomainCut::open : DomainCut::wall,
                                 .singlePrecision = isSinglePrecisionMesh(file),
                                 .simplify = arguments.flag("simplify"),
                                 .threads = threads};
    Contour made = withProgress(session.console(),
                                [&](const Progress& progress) { return contour(*followed, options, progress); });
    if (made.mesh.triangles.empty())
      throw Error(
          fmt::format("offset: the field has no value of {} in its domain, so that there is no surface", offset));
    auto colors = vertexColors(arguments, *followed, made.mesh, colorData);
    all.push_back({file, offset, tolerance, followed != &current, std::move(made), std::move(colors)});
  }
  for (const WrittenContour& made : all) saveMesh(made.contour.mesh, made.file, vertexDataOf(arguments, made));
  return all;
}

void runContour(Session& session, const Arguments& arguments) {
  const InterruptGuard guard;  // on Ctrl-C, a file is written completely or not at all
  useField(session, arguments);
  const std::vector<WrittenContour> all = writeContours(session, arguments);
  std::ostream& result = session.console().out;
  if (session.wantsJson(arguments)) {
    Json surfaces = Json::array();
    for (const WrittenContour& written : all) surfaces.push_back(contourJson(arguments, written));
    printJson(result, all.size() == 1 ? surfaces[0] : Json{{"surfaces", surfaces}});
  } else {
    for (const WrittenContour& written : all) result << contourText(arguments, written);
  }
  for (const WrittenContour& written : all)
    if (const std::string missed = missedBy(written.contour); !missed.empty()) throw Failed(missed);
}

const std::vector<Parameter> kContourParameters = {
    {"output", outputFile().as('o').required(),
     "File of the mesh: *.stl, *.ply, *.obj or *.glb. STL and GLB hold single-precision numbers."},
    {"offset", number().repeatable().byDefault("0").in("field units"),
     "Value of the field on the surface: above 0 for a surface around the solid, below 0 for one within. If it is "
     "given several times, each surface gets a file, and {offset} in the name of the file stands for the value."},
    {"tolerance", number().above(0).orShare().in("field units"),
     "Greatest distance between the mesh and the field's surface, e.g. 0.002 or 0.1%, a percentage of the longest side "
     "of the domain; 0.1% by default. Parts and gaps thinner than twice this may be lost."},
    {"resolution", wholeNumber("N").atLeast(8),
     "The tolerance as the N-th part of the longest side of the domain, e.g. 500 instead of 0.2%."},
    {"simplify", flag(),
     "Merge vertices as far as the tolerance allows. The mesh usually has a half to a fifteenth of the triangles, "
     "fewest "
     "where the surface is flat, and takes five to seven times as long."},
    {"no-normals", flag(), "Leave the normals of vertices out of the file. They are the field's gradients."},
    {"cut", choice({"wall", "open"}).byDefault("wall"),
     "Closes the mesh by a wall where the domain cuts the solid, or leaves it open there, half a tolerance within the "
     "domain."},
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

The mesh is measured at points of each triangle, and the other way round from points of the surface in each cell; more of them
where the distance is not far below the tolerance. The exit status is 1 where the tolerance is missed; the mesh is written all the same.)"),
      .examples = {"hpsdf contour bunny.hpsdf -o bunny.ply",
                   "hpsdf contour bunny.hpsdf -o coarse.obj --tolerance 1% --simplify",
                   "hpsdf contour bunny.hpsdf -o degrees.glb --color degree",
                   "hpsdf contour bunny.hpsdf -o bunny{offset}.stl --offset 0 --offset 0.02"},
      .parameters = joined(
          {{fieldParameter()}, kContourParameters, vertexColorParameters(registry), {threadsParameter("The mesh is")}}),
      .action = runContour,
      .check = checkContour,
  });
}

}  // namespace hpsdf::app
