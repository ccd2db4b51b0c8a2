#include "commands/export_command.h"

// export: the field in a format that other programs load.

#include <fmt/format.h>

#include <filesystem>

#include "console/interrupt.h"
#include "console/long_work.h"
#include "construction/building.h"
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

/// All but the last step: the file is whole, and has its name once it is committed.
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
  const InterruptGuard guard;  // until the file is whole
  OutputFile out(file);
  useField(session, arguments);
  const Exported made = exportGrid(session, arguments, out);
  out.commit();
  std::ostream& result = session.console().out;
  if (session.wantsJson(arguments)) return printJson(result, exportJson(made, file));
  result << exportText(made, file);
}

}  // namespace

void addExportCommand(Registry& registry) {
  registry.add(
      {.name = "export",
       .summary = "Write a field as a cubic grid that Bullet and PositionBasedDynamics load.",
       .help =
           "FILE.cdf is the file of Discregrid's cubic Lagrange grid: a regular grid over the field's domain, a cell "
           "interpolated from 32 distances at its corners and edges. Bullet loads it by btSdfCollisionShape or "
           "btMiniSDF (as float or as double), PositionBasedDynamics by CubicSDFCollisionDetection. Lengths are the "
           "field's, negative inside; outside the domain there is no distance: build with a --margin as wide as what "
           "is to be pushed out.\n"
           "\n"
           "A regular grid follows the field less closely than its own cells do. How much that adds to the field's own "
           "error is measured at random points and told: everywhere, and near the surface, that is where |f| is at "
           "most a cell's diagonal. Where the field is smooth, twice as many cells an axis are wrong by a sixteenth, "
           "in a file eight times as long; at creases, which distances have, by a half, and where the field's cells do "
           "not match by as much as before.\n"
           "\n"
           "The file appears whole or not at all. Bullet reads 2147 MB at most, some 224 cells an axis.",
       .examples = {"hpsdf export bunny.hpsdf -o bunny.cdf", "hpsdf export bunny.hpsdf -o small.cdf --max-bytes 5e6",
                    "hpsdf export bunny.hpsdf -o box.cdf --resolution 40,40,30 --json"},
       .parameters = {fieldParameter(),
                      {.name = "output",
                       .type = ParameterType::outputPath,
                       .help = "The grid's file, *.cdf.",
                       .alias = 'o',
                       .need = Need::always},
                      {.name = "resolution",
                       .type = ParameterType::numbers,
                       .help = "Cells along the domain's longest side, with cells that are as good as cubes, or along "
                               "x, y and z. Instead of max-bytes.",
                       .valueName = "N|NX,NY,NZ",
                       .minimum = 1,
                       .maximum = 1e7,
                       .whole = true,
                       .counts = {1, 3}},
                      {.name = "max-bytes",
                       .type = ParameterType::wholeNumber,
                       .help = "The finest grid whose file has at most so many bytes, e.g. 64e6; 188 a cell.",
                       .defaultText = "64e6",
                       .unit = "bytes",
                       .minimum = 1,
                       .maximum = double(kMostCubicGridBytes)},
                      pointsParameter("Random points at which the grid is compared with the field.", "100000", 1),
                      seedParameter(),
                      threadsParameter("The file is")},
       .action = runExport,
       .check = checkExport});
}

}  // namespace hpsdf::app
