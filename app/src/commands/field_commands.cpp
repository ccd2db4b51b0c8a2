#include <fmt/format.h>

#include <chrono>
#include <filesystem>

#include "batch/batch.h"
#include "commands/commands.h"
#include "commands/made_field.h"
#include "console/interrupt.h"
#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "construction/build_field.h"
#include "construction/mesh_summary.h"
#include "construction/reference_surface.h"
#include "files/text_file.h"
#include "hpsdf/app/failed.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/field_file.h"
#include "hpsdf/safe_distance.h"
#include "session/field_argument.h"
#include "session/field_summary.h"
#include "session/field_surface.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Replaces the current field by `field`, a post-processed version of it. Saves `field` if an output is given. Reports
/// `field` as JSON that includes `figures`, or as the text that textOf(field) returns.
void changeCurrent(Session& session, const Arguments& arguments, Field field, const Json& figures, const auto& textOf) {
  const CurrentField& before = session.current();
  session.changeField({std::move(field), arguments.textOr("output", before.name), {}, before.surface});
  saveMade(session, arguments);
  std::ostream& out = session.console().out;
  if (!session.wantsJson(arguments)) {
    out << fmt::format("{}: {}\n", session.current().name, textOf(session.current().field));
    return;
  }
  Json json = madeJson(session, arguments);
  json.update(figures);
  printJson(out, json);
}

void checkBuildArguments(const Arguments& arguments) {
  checkBatch(arguments);
  if (!arguments.has("batch") && !arguments.has("mesh"))
    throw Error("build: mesh is missing: give one, or a list of them as batch; 'hpsdf help build' explains");
  if (arguments.has("batch") && arguments.has("out-of-core"))
    throw Error("out-of-core: belongs to one mesh; leave it out of a batch");
  checkCheckpoint(arguments);
}

void runBuild(Session& session, const Arguments& arguments) {
  if (arguments.has("batch")) return buildBatch(session, arguments);
  const std::string surface = arguments.text("mesh");
  buildAndReport(
      session, arguments, {.name = surface, .surface = surface}, [&](const std::filesystem::path& checkpoint) {
        BuildInput input = buildInput(session.console(), surface, arguments, arguments.textOr("out-of-core", ""));
        return buildField(session.console(), std::move(input), surface, arguments, checkpoint);
      });
}

void runLoad(Session& session, const Arguments& arguments) {
  loadField(session, arguments.text("field"));
  if (session.wantsJson(arguments)) return printJson(session.console().out, fieldJson(session.current()));
  session.console().out << fmt::format("{}: {}\n", arguments.text("field"), fieldLine(session.current().field));
}

void runSave(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  saveCurrent(session, arguments);
  const auto bytes = session.current().fileBytes;
  if (session.wantsJson(arguments)) return printJson(session.console().out, {{"output", file}, {"file_bytes", *bytes}});
  session.console().out << fmt::format("{}: {}\n", file, bytesText(double(*bytes)));
}

void runInfo(Session& session, const Arguments& arguments) {
  useField(session, arguments);
  if (session.wantsJson(arguments)) return printJson(session.console().out, fieldJson(session.current()));
  session.console().out << fieldText(session.current());
}

void runSmooth(Session& session, const Arguments& arguments) {
  checkFieldOutput(arguments);
  useField(session, arguments);
  if (session.current().field.metadata().settings.continuityWeight)
    throw Error(session.current().name +
                ": is weakly continuous already; smooth the original field, or build it again");
  const InterruptGuard guard;  // on Ctrl-C, the file is written completely or not at all
  const auto start = std::chrono::steady_clock::now();
  WeaklyContinuous made = withProgress(session.console(), [&](const Progress& progress) {
    return weaklyContinuous(session.current().field, {.weight = arguments.number("continuity-weight")},
                            arguments.whole("threads"), progress);
  });
  const double seconds = secondsSince(start);
  changeCurrent(
      session, arguments, std::move(made.field),
      {{"change", made.change}, {"iterations", made.iterations}, {"seconds", seconds}}, [&](const Field& field) {
        const FieldMetadata& metadata = field.metadata();
        return fmt::format(
            "changed by {} RMS in {} iterations, {:.1f} s{}", shortNumber(made.change), made.iterations, seconds,
            metadata.hasEstimate() ? "; weighted estimate " + shortNumber(metadata.rmsEstimate(field.domain())) : "");
      });
}

void runBlend(Session& session, const Arguments& arguments) {
  checkFieldOutput(arguments);
  useField(session, arguments);
  const InterruptGuard guard;  // on Ctrl-C, the file is written completely or not at all
  const double width = arguments.number("width");
  changeCurrent(session, arguments, blended(session.current().field, width), Json::object(), [&](const Field& field) {
    return fmt::format("{}, blended within {} of an edge from faces", fieldLine(field), width);
  });
}

void runBounds(Session& session, const Arguments& arguments) {
  checkFieldOutput(arguments);
  const std::string surface = useFieldWithSurface(session, arguments);
  const CurrentField& from = session.current();
  const Console& console = session.console();
  const InterruptGuard guard;  // on Ctrl-C, the file is written completely or not at all
  const ReferenceSurface reference = referenceSurface(console, surface, from.field.metadata().source);
  refuseForeign(from, reference, surface);
  warnOfBounds(console, reference.report);
  const auto start = std::chrono::steady_clock::now();
  Field field = withProgress(console, [&](const Progress& progress) {
    return withBounds(from.field, *reference.distance, arguments.whole("threads"), progress);
  });
  const double seconds = secondsSince(start);
  changeCurrent(session, arguments, std::move(field), {{"seconds", seconds}}, [&](const Field& made) {
    const Json bounds = boundsJson(made);
    return fmt::format("nowhere wrong by more than {}, in the median cell by {}; {:.1f} s",
                       shortNumber(bounds["greatest"].get<double>()), shortNumber(bounds["median"].get<double>()),
                       seconds);
  });
}

const std::vector<Parameter> kBuildFiles = {
    {"mesh", text("MESH").positional(), "Mesh file, grid file, builtin:SHAPE or analytic:SHAPE."},
    {"output", outputFile().as('o').requiredOnCommandLine().under(kFiles),
     "File of the field, usually *.hpsdf. With batch it is the folder of the fields, which is created where it does "
     "not exist."},
    {"batch", file("LIST").under(kFiles),
     "Builds the fields of many meshes instead of MESH. LIST names one mesh file (relative to the current folder) or "
     "shape a line; empty lines and # comments are ignored, - is standard input."},
    {"part", text("K/N").under(kFiles),
     "Builds the K-th of N parts of the list alone, that is, every N-th mesh from the K-th on. Processes that build "
     "different parts may work at once, on several machines."},
    {"then", file("SCRIPT").under(kFiles),
     "Script that runs for every field of the list, with the field as its current one: it writes samples, a contour or "
     "pictures. Its variables are $mesh, $field (the field's file), $name (that file without its ending) and $threads. "
     "It runs again where a file that it writes is missing, or where the script has changed."},
    outOfCoreParameter(),
    compressParameter()};

void addBuildCommand(Registry& registry) {
  registry.add({
      .name = "build",
      .summary = "Build a field from a mesh or a built-in shape.",
      .help = paragraphs(R"(
MESH is a file (OBJ, PLY, STL, OFF, 3DS, glTF), the mesh of a built-in shape (builtin:SHAPE,parameter=value,…) or a
shape whose distance is known in closed form (analytic:SHAPE,…); 'hpsdf shapes' lists the shapes. It may also be a grid of
distances: a level set of OpenVDB (.vdb), image data of VTK (.vti) or an array of NumPy (.npy, with --spacing). Distances
between its samples are interpolated tricubically, and a line tells the likely error of that; the field's own error, which
is measured against the interpolation, comes on top. Beyond the samples of a .vti or .npy, distances are too great: let the
domain end there.

Say how exact the field must be with --tolerance: 0.01 in the mesh's units, or 0.02% of its longest side. The error of the
distance then exceeds it nowhere within --within of the surface; farther away 1 % of the further distance is allowed in
addition. Among the fields within the tolerance, the construction seeks the one that takes the fewest bytes. Early on, a
line says how many bytes and seconds it will take.

Without a tolerance, the construction is that of the paper: it refines the worst cell, by a higher degree or by eight
children, until the weighted squared error over the domain falls below the target error τ. As in the paper, τ refers to
a mesh whose longest side is 2. A mesh with the longest side L is built for τ·(L/2)^5, so that the same τ gives the same
cells whether its units are metres or millimetres. One hundredth of τ gives about one tenth of the RMS error.

The finished field is measured against the exact distance at 8,000 to 100,000 random points: the RMS and the greatest
error near the surface and over the domain, points on the wrong side, and the share of the surface that cracks between
cells tear. The field keeps these figures, and 'hpsdf info' shows them. Where the tolerance is missed, or a measured error
exceeds --near-error, --far-error or --max-error, the field is written all the same, the last line says so, and the exit
status is 1.

The inside is what the mesh encloses. Where that is not certain, because the mesh has holes or intersects itself, a line
reports which inside test was chosen (see --sign). Ctrl-C stops the construction without writing a field; with
--checkpoint the same command continues it later. In a script, the field becomes the current one, and the output may be
left out.

With --batch, every mesh of a list becomes OUTPUT/name-hash.hpsdf, with a record of its figures beside it in
name-hash.json, and one line of JSON on standard output reports its result. A mesh that fails does not stop the others; the
exit status is 3 then. It is 1 if none fails and a field misses its tolerance or an error that was asked for, which its
line tells. Fields that exist already, made from the same contents with the same options, are skipped. With --part, several
processes share a list. docs/batch.md shows how, with Slurm, Snakemake, Dask and GNU parallel. 'hpsdf index' makes a page of
a finished folder.

Started by MPI's mpirun, as in 'mpirun -n 8 hpsdf build …', several processes build one field together, which is the same
to the byte: each holds a part of the cells. All of them need the mesh. --tolerance and --max-bytes are for one process.
docs/scale.md tells what it gains.)"),
      .examples = {"hpsdf build part.stl -o part.hpsdf --tolerance 0.02%", "hpsdf build bunny.obj -o bunny.hpsdf",
                   "hpsdf build bunny.obj -o paper.hpsdf --paper --target-error 1e-6 --grid 6",
                   "hpsdf build builtin:torus,major=0.7,minor=0.2 -o torus.hpsdf --target-error 1e-8",
                   "hpsdf build bunny.obj -o fine.hpsdf --target-error 1e-9 --checkpoint",
                   "hpsdf build --batch list.txt -o fields",
                   "hpsdf build --batch list.txt -o fields --part 3/20 --then products.hps"},
      .parameters = joined({kBuildFiles, checkpointParameters(), buildParameters()}),
      .action = runBuild,
      .check = checkBuildArguments,
  });
}

void addContinuityCommands(Registry& registry) {
  registry.add({
      .name = "smooth",
      .summary = "Make a field weakly continuous: smaller jumps for a little error.",
      .help = paragraphs(R"(
Changes the polynomials of the cells so that Σ w ∫ jump² dA + λ‖f − f₀‖² becomes minimal. The sum runs over the faces
between cells; w is the edge of the smaller cell across the face, f₀ the original field, and λ the weight, which has no
unit. Cells, degrees and size stay. 'build --continuity weak' does the same during the construction; it rounds to float
once, this command a second time.

Use it where jumps between cells disturb more than a small error. The polynomials of cells have too few coefficients to
agree along whole faces, so that smaller jumps cost accuracy; 'hpsdf study continuity' shows how much. Bounds and
measured errors are removed, and so is the tolerance of a field that was built within one. A field can be smoothed
once.)"),
      .examples = {"hpsdf smooth bunny.hpsdf -o smooth.hpsdf",
                   "hpsdf smooth bunny.hpsdf -o smoother.hpsdf --continuity-weight 0.05"},
      .parameters = {fieldParameter(), fieldOutputParameter(), compressParameter(),
                     settingParameter("continuity-weight"), threadsParameter("The field is")},
      .action = runSmooth,
  });
  registry.add({
      .name = "blend",
      .summary = "Make a field and its gradient continuous.",
      .help = paragraphs(R"(
Blends neighbouring cells by smooth weights in a zone along their faces, so that neither value nor gradient jumps
anywhere in the domain. Outside of the zones the field stays the same to the bit. No coefficient changes: the file
stores the width of the zones, and queries and pictures blend. 'build --continuity exact' does the same.

Use it for collision response and shading, which need continuous gradients. Queries take up to twice as long. Bounds and
measured errors are removed, and so is the tolerance of a field that was built within one: 'build --tolerance
--continuity exact' keeps the tolerance with blending.)"),
      .examples = {"hpsdf blend bunny.hpsdf -o smooth.hpsdf", "hpsdf blend bunny.hpsdf -o gentle.hpsdf --width 0.1"},
      .parameters = {fieldParameter(),
                     fieldOutputParameter(),
                     compressParameter(),
                     {"width", settingKind("blend-width"), std::string(buildSetting("blend-width").help)}},
      .action = runBlend,
  });
}

void addBoundsCommand(Registry& registry) {
  registry.add({
      .name = "bounds",
      .summary = "Compute proven bounds of the error and the slope of each cell.",
      .help = paragraphs(R"(
Stores two numbers for each cell: |f − Φ| does not exceed the first anywhere in the cell, and ‖∇f‖ does not exceed the
second. Subtracting the first from |f| gives a distance within which there is certainly no surface, so that rays and
collisions miss nothing. 'build --bounds' does the same; existing bounds are computed again. Coefficients stay the same
to the bit.

It needs MESH, from which the field was made, and computes 48 exact distances a cell, between which the 1-Lipschitz
property of Φ bounds it. A mesh from which the field was not made is refused. Bounds hold where Φ is a signed distance:
not beside the holes of an open mesh, nor where a mesh intersects itself.

'smooth' and 'blend' change the field and remove bounds: compute them last. 'hpsdf verify --max-violations 0' tests them
at random points.)"),
      .examples = {"hpsdf bounds bunny.hpsdf bunny.obj -o certain.hpsdf", "hpsdf bounds torus.hpsdf -o certain.hpsdf"},
      .parameters = {fieldParameter(), surfaceParameter(), fieldOutputParameter(), compressParameter(),
                     threadsParameter("The field is")},
      .action = runBounds,
  });
}

void addReadingCommands(Registry& registry) {
  registry.add({
      .name = "info",
      .summary = "Show the size, the settings and the measured errors of a field.",
      .help =
          "Prints leaves, coefficients, memory, errors, settings, the mesh from which the field was made, and the "
          "shares of its volume by degree and depth. For a field with exact leaves it also prints how many they are, "
          "how many triangles the field stores for them, how many of these a leaf refers to, and the memory of each "
          "part of the field. The errors are those that 'build' measured of the finished field, at random points; "
          "'hpsdf verify' measures more of them. The weighted estimate √(ε/|Ω|) is what the construction compared "
          "with the target error τ: it weights errors far from the surface less, and tells nothing beyond τ.",
      .examples = {"hpsdf info bunny.hpsdf", "hpsdf info bunny.hpsdf --json"},
      .parameters = {fieldParameter()},
      .action = runInfo,
  });
  addQueryCommand(registry);
  registry.addForScripts({
      .name = "load",
      .summary = "Load a field, which becomes the current one.",
      .help = "The following commands of the script work on it.",
      .examples = {"load bunny.hpsdf"},
      .parameters = {{"field", file("FIELD").positional().required(), "File of the field."}},
      .action = runLoad,
  });
  registry.addForScripts({
      .name = "save",
      .summary = "Save the current field.",
      .help =
          "The file is written under a temporary name and renamed, so that an interrupted save leaves an older file "
          "intact.",
      .examples = {"save output=bunny.hpsdf"},
      .parameters = {{"output", outputFile().as('o').required(), "File of the field, usually *.hpsdf."},
                     compressParameter()},
      .action = runSave,
  });
}

}  // namespace

void addFieldCommands(Registry& registry) {
  addBuildCommand(registry);
  addContinuityCommands(registry);
  addBoundsCommand(registry);
  addReadingCommands(registry);
}

}  // namespace hpsdf::app
