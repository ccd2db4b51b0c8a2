// Writes fields as cubic grids of Discregrid.
#include <fmt/format.h>

#include "console/long_work.h"
#include "export/export_kinds.h"
#include "hpsdf/detail/cubic_grid.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

void checkCubicGrid(const Arguments& arguments) {
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

Json differenceJson(const GridDifference& difference) {
  return {{"points", difference.points}, {"rms", difference.rms}, {"max", difference.max}};
}

Json figuresOf(const Exported& made) {
  return {{"resolution", made.grid.resolution},
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

/// Samples the field on a regular grid, measures how far the grid deviates from the field, and writes the grid.
ExportReport writeCdf(const Session& session, const Arguments& arguments, OutputFile& out) {
  const Field& field = session.current().field;
  const GridResolution resolution = exportResolution(field.domain(), arguments);
  const int threads = arguments.whole("threads");
  const Exported made = withProgress(session.console(), [&](const Progress& progress) {
    Exported exported{sampleCubicGrid(field, resolution, threads, progress), {}};
    exported.error = measureCubicGrid(exported.grid, field, static_cast<std::size_t>(arguments.number("points")),
                                      static_cast<std::uint64_t>(arguments.number("seed")), threads, progress);
    writeCubicGrid(exported.grid, out, progress);
    return exported;
  });
  const auto& [x, y, z] = made.grid.resolution;
  return {
      .figures = figuresOf(made),
      .contents = fmt::format("{} x {} x {} cubic cells, {} nodes", x, y, z, grouped(made.grid.nodes.size())),
      .rows = summaryRow("beside the field", differenceText(made.error.everywhere, "in the domain")) +
              summaryRow("near the surface", differenceText(made.error.nearSurface,
                                                            fmt::format("within {}", shortNumber(made.error.near))))};
}

}  // namespace

ExportKind cubicGridKind() {
  return {".cdf", "a cubic grid", {"resolution", "max-bytes", "points", "seed"}, checkCubicGrid, writeCdf};
}

}  // namespace hpsdf::app
