// Writes fields as grids of VTK and NumPy.
#include <fmt/format.h>

#include <cmath>

#include "console/long_work.h"
#include "export/export_kinds.h"
#include "hpsdf/detail/cubic_grid.h"
#include "hpsdf/output/grids.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr double kVoxelsAlongDomain = 256;  ///< default number of voxels along the longest side of the domain

NumberType numberTypeOf(const Arguments& arguments) {
  return arguments.flag("double") ? NumberType::float64 : NumberType::float32;
}

void checkGrid(const Arguments& arguments) {
  if (arguments.given("resolution") && arguments.given("voxel"))
    throw Error("resolution excludes voxel: give one of them");
}

GridLayout layoutOf(const Arguments& arguments, const Box& domain) {
  if (!arguments.given("resolution")) return gridOfVoxels(domain, voxelOf(arguments, domain));
  const auto cells = arguments.numbers("resolution");
  if (cells.size() == 1) return gridOfCells(domain, cubicGridResolution(domain, std::uint32_t(cells[0])));
  return gridOfCells(domain, {std::uint32_t(cells[0]), std::uint32_t(cells[1]), std::uint32_t(cells[2])});
}

/// Samples the field on a regular grid and writes this by the function `write`.
ExportReport writeGrid(const Session& session, const Arguments& arguments, OutputFile& out,
                       void (*write)(const RegularGrid&, NumberType, OutputFile&, const Progress&)) {
  const Field& field = session.current().field;
  const GridLayout layout = layoutOf(arguments, field.domain());
  const bool withGradients = arguments.flag("gradients");
  withProgress(session.console(), [&](const Progress& progress) {
    const RegularGrid grid = sampleGrid(field, layout, withGradients, arguments.whole("threads"), progress);
    write(grid, numberTypeOf(arguments), out, progress);
    return true;
  });
  const auto& [x, y, z] = layout.points;
  return {
      .figures = {{"points", layout.points},
                  {"origin", vectorJson(layout.origin)},
                  {"spacing", vectorJson(layout.spacing)},
                  {"gradients", withGradients}},
      .contents = fmt::format("{} x {} x {} points", x, y, z),
      .rows = summaryRow("first point", vectorText(layout.origin)) + summaryRow("spacing", vectorText(layout.spacing))};
}

ExportReport writeLeaves(const Session& session, const Arguments& arguments, OutputFile& out) {
  const Field& field = session.current().field;
  const LeafCellOptions options{.order = int(arguments.whole("order")),
                                .type = numberTypeOf(arguments),
                                .threads = int(arguments.whole("threads"))};
  withProgress(session.console(), [&](const Progress& progress) {
    writeVtu(field, options, out, progress);
    return true;
  });
  const std::size_t leaves = statistics(field).leaves;
  return {.figures = {{"cells", leaves}, {"order", options.order}},
          .contents = fmt::format(
              "{} leaves as {}", grouped(leaves),
              options.order == 1 ? "voxels" : fmt::format("Lagrange hexahedra up to order {}", options.order)),
          .rows = ""};
}

}  // namespace

double voxelOf(const Arguments& arguments, const Box& domain) {
  const double longest = domain.sizes().maxCoeff();
  if (!arguments.given("voxel")) return longest / kVoxelsAlongDomain;
  return arguments.number("voxel") * (arguments.isShare("voxel") ? longest : 1);
}

std::vector<ExportKind> gridKinds() {
  const std::vector<std::string> settings = {"resolution", "voxel", "gradients", "double"};
  return {{".vti", "values on a regular grid for VTK and ParaView", settings, checkGrid,
           [](const Session& session, const Arguments& arguments, OutputFile& out) {
             return writeGrid(session, arguments, out, writeVti);
           }},
          {".vtu", "the leaves for VTK and ParaView", {"order", "double"}, {}, writeLeaves},
          {".npy", "values on a regular grid for NumPy", settings, checkGrid,
           [](const Session& session, const Arguments& arguments, OutputFile& out) {
             return writeGrid(session, arguments, out, writeNpy);
           }}};
}

}  // namespace hpsdf::app
