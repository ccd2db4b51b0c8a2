#include <fmt/format.h>

#include <filesystem>

#include "commands/commands.h"
#include "console/interrupt.h"
#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "hpsdf/detail/cubic_grid.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/output_file.h"
#include "session/field_argument.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

void checkExport(const Arguments& arguments) {
  const std::string file = arguments.text("output");
  if (lowerExtension(file) != ".cdf")
    throw Error(fmt::format("{}: unknown kind of output '{}'; expected .cdf, a cubic grid", file,
                            std::filesystem::path(file).extension().string()));
  if (arguments.given("resolution") && arguments.given("max-bytes"))
    throw Error("resolution excludes max-bytes: give one of them");
}

GridResolution exportResolution(const Box& domain, const Arguments& arguments) {
  if (!arguments.given("resolution"))
    return finestCubicGrid(domain, static_cast<std::uint64_t>(arguments.number("max-bytes")));
  const auto cells = arguments.numbers("resolution");
  if (cells.size() == 1) return cubicGridResolution(domain, static_cast<std::uint32_t>(cells[0]));
  GridResolution resolution;
  for (std::size_t axis = 0; axis < 3; ++axis) resolution[axis] = static_cast<std::uint32_t>(cells[axis]);
  return resolution;
}

struct Exported {
  CubicGrid grid;
  CubicGridError error;
};

/// Samples the field on a regular grid, measures how far the grid deviates from the field, and writes the grid to
/// `out`. The file gets its final name only when the caller commits `out`.
Exported exportGrid(const Session& session, const Arguments& arguments, OutputFile& out) {
  const Field& field = session.current().field;
  const GridResolution resolution = exportResolution(field.domain(), arguments);
  const int threads = arguments.whole("threads");
  return withProgress(session.console(), [&](const Progress& progress) {
    Exported made{sampleCubicGrid(field, resolution, threads, progress), {}};
    made.error = measureCubicGrid(made.grid, field, static_cast<std::size_t>(arguments.number("points")),
                                  static_cast<std::uint64_t>(arguments.number("seed")), threads, progress);
    writeCubicGrid(made.grid, out, progress);
    return made;
  });
}

Json differenceJson(const GridDifference& difference) {
  return {{"points", difference.points}, {"rms", difference.rms}, {"max", difference.max}};
}

Json exportJson(const Exported& made, const std::string& file) {
  return {{"output", file},
          {"file_bytes", std::filesystem::file_size(file)},
          {"resolution", made.grid.resolution},
          {"nodes", made.grid.nodes.size()},
          {"cell_size", vectorJson(made.grid.cellSize())},
          {"domain", {{"min", vectorJson(made.grid.domain.min())}, {"max", vectorJson(made.grid.domain.max())}}},
          {"difference", differenceJson(made.error.everywhere)},
          {"near", made.error.near},
          {"difference_near", differenceJson(made.error.nearSurface)}};
}

std::string differenceText(const GridDifference& difference, const std::string& where) {
  if (difference.points == 0) return fmt::format("no random point lies {}", where);
  return fmt::format("RMS {}, greatest {} at {} random points {}", shortNumber(difference.rms),
                     shortNumber(difference.max), grouped(difference.points), where);
}

std::string exportText(const Exported& made, const std::string& file) {
  const auto& [x, y, z] = made.grid.resolution;
  std::string text =
      fmt::format("{}: {} x {} x {} cubic cells, {} nodes, {}\n", file, x, y, z, grouped(made.grid.nodes.size()),
                  bytesText(static_cast<double>(std::filesystem::file_size(file))));
  text += summaryRow("beside the field", differenceText(made.error.everywhere, "in the domain"));
  text += summaryRow("near the surface",
                     differenceText(made.error.nearSurface, fmt::format("within {}", shortNumber(made.error.near))));
  return text;
}

void runExport(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  const InterruptGuard guard;  // on Ctrl-C, the file is written completely or not at all
  OutputFile out(file);
  useField(session, arguments);
  const Exported made = exportGrid(session, arguments, out);
  out.commit();
  std::ostream& result = session.console().out;
  if (session.wantsJson(arguments)) return printJson(result, exportJson(made, file));
  result << exportText(made, file);
}

const std::vector<Parameter> kExportParameters = {
    {"output", outputFile().as('o').required(), "File of the grid, *.cdf."},
    {"resolution", wholeNumbers("N|NX,NY,NZ", {1, 3}).within(1, 1e7),
     "Number of cells. One number counts the cells along the longest side of the domain, which are nearly cubes; three "
     "numbers count those along x, y and z. Use it instead of max-bytes."},
    {"max-bytes",
     wholeNumber().within(1, double(kMaxCubicGridBytes)).in("bytes").byDefault("64e6").under(setting_group::kAsked),
     "Largest size of the file, e.g. 64e6. The finest grid that fits is written; a cell takes 188 bytes."}};

}  // namespace

void addExportCommand(Registry& registry) {
  registry.add({
      .name = "export",
      .summary = "Write a field as a cubic grid for Bullet or PositionBasedDynamics.",
      .help = paragraphs(R"(
Writes FILE.cdf, the file format of Discregrid's cubic Lagrange grid: a regular grid over the field's domain whose cells
interpolate 32 distances at their corners and edges. Bullet loads it by btSdfCollisionShape or btMiniSDF (as float or
double), PositionBasedDynamics by CubicSDFCollisionDetection.

Use it for simulations that cannot load .hpsdf files. Lengths are those of the field, negative inside. The grid has no
distances outside the domain: build the field with a --margin as wide as the deepest contact that must be resolved.

A regular grid follows the field less closely than the field's own cells do. The command measures the additional error
at random points in the whole domain and near the surface, where |f| is at most one cell diagonal. Doubling the number
of cells along each axis makes the file eight times as long. It divides the error by sixteen where the field is smooth
and by two at creases of the distance; it does not reduce the jumps between cells of the field.

The file appears when it is complete. Bullet reads at most 2147 MB, about 224 cells along each axis.)"),
      .examples = {"hpsdf export bunny.hpsdf -o bunny.cdf", "hpsdf export bunny.hpsdf -o small.cdf --max-bytes 5e6",
                   "hpsdf export bunny.hpsdf -o box.cdf --resolution 40,40,30 --json"},
      .parameters = joined(
          {{fieldParameter()},
           kExportParameters,
           {pointsParameter("Number of random points at which the grid is compared with the field.", "100000", 1),
            seedParameter(), threadsParameter("The file is")}}),
      .action = runExport,
      .check = checkExport,
  });
}

}  // namespace hpsdf::app
