// Writes fields as level sets of OpenVDB and NanoVDB.
#include <fmt/format.h>

#include "console/long_work.h"
#include "export/export_kinds.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/openvdb/level_set.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

ExportReport writeLevelSet(const Session& session, const Arguments& arguments, OutputFile& out,
                           vdb::LevelSetFigures (*write)(const Field&, const vdb::LevelSetOptions&, OutputFile&,
                                                         const Progress&)) {
  const Field& field = session.current().field;
  const vdb::LevelSetOptions options{.voxel = voxelOf(arguments, field.domain()),
                                     .halfWidth = arguments.number("band"),
                                     .threads = int(arguments.whole("threads"))};
  const vdb::LevelSetFigures figures =
      withProgress(session.console(), [&](const Progress& progress) { return write(field, options, out, progress); });
  return {.figures = {{"voxel", options.voxel},
                      {"band", options.halfWidth},
                      {"active_voxels", figures.activeVoxels},
                      {"leaf_nodes", figures.leafNodes},
                      {"memory_bytes", figures.memoryBytes}},
          .contents = fmt::format("{} active voxels of {}", grouped(figures.activeVoxels), shortNumber(options.voxel)),
          .rows = summaryRow("band", fmt::format("{} on each side of the surface",
                                                 shortNumber(options.voxel * options.halfWidth))) +
                  summaryRow("memory", fmt::format("{} in OpenVDB", bytesText(double(figures.memoryBytes))))};
}

}  // namespace

std::vector<ExportKind> levelSetKinds() {
  const std::vector<std::string> settings = {"voxel", "band"};
  return {{".vdb",
           "a level set for OpenVDB",
           settings,
           {},
           [](const Session& session, const Arguments& arguments, OutputFile& out) {
             return writeLevelSet(session, arguments, out, vdb::writeVdb);
           }},
          {".nvdb",
           "a level set for NanoVDB",
           settings,
           {},
           [](const Session& session, const Arguments& arguments, OutputFile& out) {
             return writeLevelSet(session, arguments, out, vdb::writeNanoVdb);
           }}};
}

}  // namespace hpsdf::app
