#include "compare/compare_command.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "compare/compare_report.h"
#include "compare/compared_views.h"
#include "compare/comparison.h"
#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "construction/mesh_summary.h"
#include "construction/surface.h"
#include "files/text_file.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/field_file.h"
#include "pictures/picture_arguments.h"
#include "session/backend.h"
#include "session/field_surface.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostFields = 8;

std::vector<CurrentField> loadFields(const std::vector<std::string>& files) {
  std::vector<CurrentField> fields;
  for (const std::string& file : files) fields.push_back({loadOrMap(file), file, fs::file_size(file)});
  return fields;
}

/// Throws `Error` unless the fields approximate the same distance: in the same units, with the same kind of surface.
void requireComparable(const std::vector<CurrentField>& fields) {
  const CurrentField& first = fields.front();
  const Source& source = first.field.metadata().source;
  const auto isOwnSurface = [](const Source& s) {
    return s.insideTest == InsideTest::shell || s.insideTest == InsideTest::outerHull;
  };
  for (const CurrentField& other : fields) {
    const Source& its = other.field.metadata().source;
    if (its.normalization.scale != source.normalization.scale ||
        its.normalization.center != source.normalization.center)
      throw Error(fmt::format("{} and {} are in different units; build both with --normalize, or both without",
                              first.name, other.name));
    if (its.insideTest != source.insideTest && (isOwnSurface(its) || isOwnSurface(source)))
      throw Error(
          fmt::format("{} and {} are of different surfaces of the mesh ({} and {}); build both with the same "
                      "--sign and --hull",
                      first.name, other.name, insideTestName(source.insideTest), insideTestName(its.insideTest)));
    if (its.thickness != source.thickness)
      throw Error(fmt::format("{} and {} are of walls of different thickness; build both with the same --thickness",
                              first.name, other.name));
  }
}

void requireSameMesh(const std::vector<CurrentField>& fields) {
  const Source& source = fields.front().field.metadata().source;
  for (const CurrentField& other : fields)
    if (const Source& its = other.field.metadata().source; !isMadeFrom(source, its))
      throw Error(
          fmt::format("{} was made from {}, but {} from another mesh, {}; compare fields of one mesh, or give "
                      "--mesh with --any-mesh",
                      fields.front().name, source.name.empty() ? "something unknown" : source.name, other.name,
                      its.name.empty() ? "something unknown" : its.name));
}

/// Tells if fields differ in their inside tests. Only open or flawed meshes have other signs then.
void noteInsideTests(const Console& console, const std::vector<CurrentField>& fields) {
  const InsideTest first = fields.front().field.metadata().source.insideTest;
  for (const CurrentField& other : fields)
    if (const InsideTest its = other.field.metadata().source.insideTest; its != first)
      note(console, fmt::format("{} was made with the inside test {}, {} with {}; signs are compared with those of {}",
                                fields.front().name, insideTestName(first), other.name, insideTestName(its),
                                fields.front().name));
}

/// Returns the surface from which the fields were made: a shape, or a file of the mesh's name in the current folder or
/// beside one of the fields.
std::string foundSurface(const std::vector<CurrentField>& fields) {
  const std::string& name = fields.front().field.metadata().source.name;
  if (isShape(name) || name.empty()) return surfaceOf(fields.front(), "--mesh");
  if (fs::is_regular_file(name)) return name;
  for (const CurrentField& current : fields)
    if (const fs::path beside = fs::path(current.name).parent_path() / name; fs::is_regular_file(beside))
      return beside.string();
  return surfaceOf(fields.front(), "--mesh");
}

/// The surface with which the fields are compared, and its name.
struct ComparedSurface {
  std::string name;
  ReferenceSurface reference;
};

/// Returns the surface that the arguments name, or the one from which the fields were made. Throws `Error` if the
/// fields were made from another one.
ComparedSurface comparedSurface(const Console& console, const std::vector<CurrentField>& fields,
                                const Arguments& arguments) {
  const std::string name = arguments.has("mesh") ? arguments.text("mesh") : foundSurface(fields);
  ReferenceSurface reference = referenceSurface(console, name, fields.front().field.metadata().source);
  if (!arguments.flag("any-mesh"))
    refuseForeign(fields.front(), reference, name, ", or --any-mesh to compare them anyway");
  return {name, std::move(reference)};
}

CompareOptions compareOptions(const Arguments& arguments) {
  return {.points = static_cast<std::size_t>(arguments.number("points")),
          .seed = static_cast<std::uint64_t>(arguments.number("seed")),
          .near = arguments.has("near") ? arguments.number("near") : 0,
          .band = arguments.has("band") ? arguments.number("band") : 0,
          .worst = static_cast<std::size_t>(arguments.whole("worst")),
          .threads = arguments.whole("threads"),
          .times = !arguments.flag("no-times")};
}

/// Returns the settings of the pictures. Without the argument `offset`, the plane goes through the middle of the
/// surface.
ViewSettings viewSettings(const Arguments& arguments, const Vector3& middle) {
  const int axis = arguments.text("axis")[0] - 'x';
  return {{axis, arguments.has("offset") ? arguments.number("offset") : middle[axis]},
          cameraPicture(arguments),
          backend(arguments)};
}

void checkCompare(const Arguments& arguments) {
  const std::size_t count = arguments.texts("field").size();
  if (count < 2) throw Error("compare: needs two fields or more; 'hpsdf verify' measures one");
  if (count > kMostFields) throw Error(fmt::format("compare: takes {} fields at most, not {}", kMostFields, count));
  if (arguments.flag("any-mesh") && !arguments.has("mesh"))
    throw Error("any-mesh: needs mesh, the surface to compare the fields with");
  if (arguments.has("output") && lowerExtension(arguments.text("output")) != ".html")
    throw Error(fmt::format("{}: the page is written as .html", arguments.text("output")));
  viewSettings(arguments, Vector3::Zero());
}

void runCompare(Session& session, const Arguments& arguments) {
  const bool writesPage = arguments.has("output");
  if (writesPage) checkWritable(arguments.text("output"));
  const std::vector<CurrentField> fields = loadFields(arguments.texts("field"));
  requireComparable(fields);
  if (!arguments.flag("any-mesh")) requireSameMesh(fields);
  const Console& console = session.console();
  const Box domain = commonDomain(fields);
  noteInsideTests(console, fields);
  const ComparedSurface surface = comparedSurface(console, fields, arguments);
  const DistanceFunction& exact = *surface.reference.distance;
  const Box shown = exact.source().box.intersection(domain);
  const ViewSettings settings = viewSettings(arguments, shown.isEmpty() ? domain.center() : shown.center());
  if (writesPage) checkViews(domain, settings);
  FieldComparison comparison = compareFields(console, fields, surface.reference, compareOptions(arguments));
  comparison.surface = printable(surface.name);
  Json json = comparisonJson(comparison);
  if (writesPage) {
    const ComparedViews views = withProgress(
        console, [&](const Progress& progress) { return drawViews(fields, exact, domain, settings, progress); });
    writeTextFile(arguments.text("output"), comparisonHtml(comparison, views));
    json["page"] = arguments.text("output");
  }
  if (session.wantsJson(arguments)) return printJson(console.out, json);
  console.out << comparisonText(comparison);
  if (writesPage) console.out << arguments.text("output") << "\n";
}

std::vector<Parameter> comparedPoints() {
  return {pointsParameter("Number of random points, uniform and near ones counted alike.", "1000000", 2),
          seedParameter(),
          {"near", number().above(0).in("world units"),
           "Greatest distance of a near point from a random point of the surface. When left out, one hundredth of the "
           "mesh's longest side."},
          {"band", number().above(0).in("world units").advanced(),
           "Restricts the uniform points to those within this distance of the surface. When left out, the narrowest "
           "band of the fields that were built with one."}};
}

/// Returns the parameters of the pictures: those of `render` for the camera, and the axis and offset of `slice`.
std::vector<Parameter> pictureParameters(const Registry& registry) {
  std::vector<Parameter> parameters;
  for (const char* name : {"axis", "offset"}) parameters.push_back(*findParameter(registry.command("slice"), name));
  for (Parameter& parameter : cameraParameters(registry)) parameters.push_back(std::move(parameter));
  parameterNamed("offset", parameters).help =
      "Coordinate at which the plane crosses that axis. When left out, the middle of the surface.";
  parameterNamed("size", parameters).byDefault("640x640");
  parameterNamed("size", parameters).help = "Size of each picture.";
  parameterNamed("samples", parameters).byDefault("2");
  return parameters;
}

}  // namespace

void addCompareCommand(Registry& registry) {
  registry.add({
      .name = "compare",
      .summary = "Compare two or more fields of one surface in a table and a page.",
      .help = paragraphs(R"(
Measures the fields at the same random points against the exact distance of the mesh, half of the points uniform in the
domain and half near the surface, as 'hpsdf verify' does. The table tells for each field its bytes, its leaves, its errors
near the surface and over the domain, the points with the wrong sign, the torn share of the surface and the time of a query.
Below it stand the worst places of each field, with the errors of the others there.

Use it to choose among settings of a construction. With -o it also writes one page that can be mailed and needs no network:
the table, curves of the error over the distance from the surface, and pictures of all fields from the same plane and the
same camera in the same colours, with a slider between two of them.

Points lie where all fields are defined. Fields of different meshes are refused, and so is a mesh from which they were not
made. Times differ from run to run; everything else is the same for the same seed. With --no-times the page has the same
bytes each time on the same renderer.)"),
      .examples = {"hpsdf compare coarse.hpsdf fine.hpsdf --mesh bunny.obj",
                   "hpsdf compare hp.hpsdf hpx.hpsdf auto.hpsdf --mesh part.stl -o strategies.html --axis y",
                   "hpsdf compare a.hpsdf b.hpsdf --mesh bunny.obj --no-times --json"},
      .parameters = joined(
          {{{"field", file("FIELD").positional().repeatable().required(), "Two to eight files of fields."},
            {"mesh", text("MESH"),
             "The surface from which the fields were made. When left out, the shape or the mesh file that the fields "
             "name, if it is in the current folder or beside a field."},
            {"output", outputFile("PAGE").as('o'), "Writes the page, *.html."},
            {"worst", wholeNumber().within(0, 1000).byDefault("5"), "Number of worst places of each field."},
            {"no-times", flag(), "Measures no times, so that the same fields give the same page."},
            {"any-mesh", flag(),
             "Accepts fields that were made from other meshes than --mesh, for instance from simplified ones."}},
           under("Sampled points", comparedPoints()),
           pictureParameters(registry),
           {threadsParameter("The figures are")}}),
      .action = runCompare,
      .check = checkCompare,
  });
}

}  // namespace hpsdf::app
