#include "export/export_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "console/interrupt.h"
#include "construction/build_arguments.h"
#include "export/export_kinds.h"
#include "hpsdf/detail/cubic_grid.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/text.h"
#include "hpsdf/output/grids.h"
#include "session/field_argument.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

const std::vector<ExportKind>& exportKinds() {
  static const std::vector<ExportKind> kinds = [] {
    std::vector<ExportKind> all = {cubicGridKind()};
    for (const auto& some : {gridKinds(), levelSetKinds()}) all.insert(all.end(), some.begin(), some.end());
    return all;
  }();
  return kinds;
}

/// Returns the kind of the file that the arguments name. Throws `Error` if its extension is not known.
const ExportKind& kindOfOutput(const Arguments& arguments) {
  const std::string file = arguments.text("output");
  const auto kind = std::ranges::find(exportKinds(), lowerExtension(file), &ExportKind::extension);
  if (kind != exportKinds().end()) return *kind;
  std::string known;
  for (const ExportKind& other : exportKinds())
    known += fmt::format("{}{}, {}", known.empty() ? "" : "; ", other.extension, other.name);
  throw Error(fmt::format("{}: unknown kind of output '{}'; expected {}", file,
                          std::filesystem::path(file).extension().string(), known));
}

/// Returns the parameters that have an effect on some kinds of files only.
const std::vector<Parameter>& exportParameters() {
  static const std::vector<Parameter> parameters = {
      {"resolution", wholeNumbers("N|NX,NY,NZ", {1, 3}).within(1, 1e7).under("The grid"),
       "Number of cells of a .cdf, .vti or .npy. One number counts the cells along the longest side of the domain, "
       "which are nearly cubes; three numbers count those along x, y and z. Use it instead of max-bytes or voxel."},
      {"voxel", number().above(0).orShare().in("field units").under("The grid"),
       "Edge of the cubic cells of a .vti, .npy, .vdb or .nvdb, e.g. 0.01 or 0.4%, a percentage of the longest side of "
       "the domain; a 256th of this side by default. The grid's points lie at multiples of it."},
      {"gradients", flag().under("The grid"), "Write the field's gradients to a .vti or .npy too."},
      {"band", number().within(1, 1000).byDefault("3").in("voxels").under("The grid"),
       "Half the width of a level set (.vdb, .nvdb): voxels have distances up to so many voxels from the surface."},
      {"order", wholeNumber().within(1, kMaxLagrangeOrder).byDefault("1").under("The grid"),
       "Order of the cells of a .vtu. With 1 they have values at their corners. A greater one makes them Lagrange "
       "hexahedra of the leaves' degrees up to this order, which ParaView subdivides to draw them."},
      {"double", flag().under("The grid"), "Write the numbers of a .vti, .vtu or .npy as double instead of float."},
      {"max-bytes",
       wholeNumber().within(1, double(kMaxCubicGridBytes)).in("bytes").byDefault("64e6").under(setting_group::kAsked),
       "Largest size of a .cdf, e.g. 64e6. The finest grid that fits is written; a cell takes 188 bytes."},
      pointsParameter("Number of random points at which a .cdf is compared with the field.", "100000", 1),
      seedParameter()};
  return parameters;
}

/// Throws `Error` for a parameter that is given and has no effect on files of this kind.
void requireEffectOnKind(const Arguments& arguments, const ExportKind& kind) {
  for (const Parameter& parameter : exportParameters())
    if (arguments.given(parameter.name) && std::ranges::find(kind.settings, parameter.name) == kind.settings.end())
      throw Error(fmt::format("{} has no effect on a {} file: leave it out", parameter.name, kind.extension));
}

void checkExport(const Arguments& arguments) {
  const ExportKind& kind = kindOfOutput(arguments);
  requireEffectOnKind(arguments, kind);
  if (kind.check) kind.check(arguments);
}

void runExport(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  const InterruptGuard guard;  // on Ctrl-C, the file is written completely or not at all
  OutputFile out(file);
  useField(session, arguments);
  const ExportReport report = kindOfOutput(arguments).write(session, arguments, out);
  out.commit();
  const std::uintmax_t bytes = std::filesystem::file_size(file);
  std::ostream& result = session.console().out;
  if (!session.wantsJson(arguments)) {
    result << fmt::format("{}: {}, {}\n", file, report.contents, bytesText(double(bytes))) << report.rows;
    return;
  }
  Json json = {{"output", file}, {"file_bytes", bytes}};
  json.update(report.figures);
  printJson(result, json);
}

}  // namespace

void addExportCommand(Registry& registry) {
  registry.add({
      .name = "export",
      .summary = "Write a field as a grid for ParaView, NumPy, OpenVDB, Bullet and others.",
      .help = paragraphs(R"(
The extension of the file decides what is written. Lengths are those of the field, negative inside.

.vti holds the field's values on a regular grid in the format of VTK, for ParaView. .npy holds the same values as an
array for NumPy, with the shape (nz, ny, nx); it does not tell where the points lie, but this command does. With
--gradients a .vti has vectors too, and a .npy four numbers for each point.

.vtu holds the leaves of the field as cells for ParaView, with their degree (31 for exact leaves), depth, estimated RMS
error and greatest jump. Each leaf has the values of its own polynomial at its corners or, with --order, at more points.

.vdb is a level set for OpenVDB, which Blender and Houdini read too; .nvdb is the same for NanoVDB. They hold the
distances in a --band around the surface and take memory for that alone. The points lie at multiples of --voxel.

.cdf is the file format of Discregrid's cubic Lagrange grid: a regular grid over the field's domain whose cells
interpolate 32 distances at their corners and edges. Bullet loads it by btSdfCollisionShape or btMiniSDF (as float or
double), PositionBasedDynamics by CubicSDFCollisionDetection. The grid has no distances outside the domain: build the
field with a --margin as wide as the deepest contact that must be resolved. Bullet reads at most 2147 MB, about 224
cells along each axis.

A regular grid follows the field less closely than the field's own cells do. For a .cdf the command measures the
additional error at random points in the whole domain and near the surface, where |f| is at most one cell diagonal.
Doubling the number of cells along each axis makes a grid eight times and a level set four times as large. It divides
the error of a .cdf by sixteen where the field is smooth and by two at creases of the distance; it does not reduce the
jumps between cells of the field.

The file appears when it is complete.)"),
      .examples = {"hpsdf export bunny.hpsdf -o bunny.vti --gradients", "hpsdf export bunny.hpsdf -o leaves.vtu",
                   "hpsdf export bunny.hpsdf -o bunny.vdb --voxel 0.01", "hpsdf export bunny.hpsdf -o bunny.cdf",
                   "hpsdf export bunny.hpsdf -o small.cdf --max-bytes 5e6",
                   "hpsdf export bunny.hpsdf -o box.npy --resolution 40,40,30 --json"},
      .parameters = joined(
          {{fieldParameter()},
           {{"output", outputFile().as('o').required(), "File to write: *.vti, *.vtu, *.npy, *.vdb, *.nvdb or *.cdf."}},
           exportParameters(),
           {threadsParameter("The file is")}}),
      .action = runExport,
      .check = checkExport,
  });
}

}  // namespace hpsdf::app
