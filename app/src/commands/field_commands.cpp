#include "commands/field_commands.h"

#include <fmt/format.h>

#include <chrono>
#include <fstream>

#include "batch/batch.h"
#include "console/failed.h"
#include "console/interrupt.h"
#include "console/long_work.h"
#include "construction/building.h"
#include "construction/mesh_summary.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/field_file.h"
#include "hpsdf/safe_distance.h"
#include "language/point_query.h"
#include "session/field_argument.h"
#include "session/field_summary.h"
#include "session/field_surface.h"
#include "session/session.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

void saveCurrent(Session& session, const std::string& file) {
  save(session.current().field, file);
  session.setFileBytes(std::filesystem::file_size(file));
}

/// Where a command keeps the field that it makes; in a script the current field may be all that is wanted.
Parameter fieldOutputParameter() {
  return {.name = "output",
          .type = ParameterType::outputPath,
          .help = "The field's file, usually *.hpsdf.",
          .alias = 'o',
          .need = Need::onCommandLine};
}

void checkFieldOutput(const Arguments& arguments) {
  if (arguments.has("output")) checkWritable(arguments.text("output"));
}

void saveMade(Session& session, const Arguments& arguments) {
  if (arguments.has("output")) saveCurrent(session, arguments.text("output"));
}

/// What a command tells of the field that it made.
Json madeJson(const Session& session, const Arguments& arguments) {
  Json json = fieldJson(session.current());
  json["output"] = arguments.has("output") ? Json(arguments.text("output")) : Json();
  return json;
}

/// Another form of the current field takes its place.
void changeCurrent(Session& session, const Arguments& arguments, Field field) {
  const CurrentField& before = session.current();
  session.changeField({std::move(field), arguments.textOr("output", before.name), {}, before.surface});
  saveMade(session, arguments);
}

/// Where the construction keeps its state; empty: nowhere.
std::filesystem::path checkpointFile(const Arguments& arguments) {
  return arguments.flag("checkpoint") ? checkpointOf(arguments.text("output")) : std::filesystem::path();
}

void checkBuildArguments(const Arguments& arguments) {
  const bool many = arguments.has("batch");
  if (many && arguments.has("mesh")) throw Error("batch: its list names the meshes; leave MESH out");
  if (many && !arguments.has("output")) throw Error("batch: its fields go into a folder; give output");
  if (!many && !arguments.has("mesh"))
    throw Error("build: mesh is missing: give one, or a list of them as batch; 'hpsdf help build' explains");
  const bool keeps = arguments.flag("checkpoint");
  if (keeps && !arguments.has("output")) throw Error("checkpoint: it is kept beside the output; give output");
  requireOwner(arguments, "checkpoint-seconds", "checkpoint", keeps);
}

BuiltField buildAndKeep(const Console& console, const std::string& surface, const Arguments& arguments,
                        const std::filesystem::path& checkpoint) {
  try {
    return buildField(console, surface, arguments, checkpoint);
  } catch (const Cancelled&) {
    if (!checkpoint.empty() && std::filesystem::exists(checkpoint))
      throw CancelledPartway(
          fmt::format("{} keeps what was done; the same command goes on from it", checkpoint.string()));
    throw;
  }
}

/// The state of the construction is no longer needed, nor what a process left that was killed while it wrote the field.
void tidyUp(const std::filesystem::path& checkpoint, const std::filesystem::path& output) {
  std::error_code ignored;
  std::filesystem::remove(checkpoint, ignored);
  OutputFile::removeAbandoned(output);
}

void runBuild(Session& session, const Arguments& arguments) {
  const Console& console = session.console();
  if (arguments.has("batch")) return buildBatch(console, arguments);
  const std::string surface = arguments.text("mesh");
  const std::filesystem::path checkpoint = checkpointFile(arguments);
  checkFieldOutput(arguments);
  const InterruptGuard guard;  // until the file is whole
  BuiltField built = buildAndKeep(console, surface, arguments, checkpoint);
  session.setField({std::move(built.field), arguments.textOr("output", surface), {}, surface});
  session.setExact(std::move(built.exact));
  saveMade(session, arguments);
  if (!checkpoint.empty()) tidyUp(checkpoint, arguments.text("output"));
  if (session.wantsJson(arguments)) {
    Json json = madeJson(session, arguments);
    json["build_seconds"] = built.seconds;
    if (built.mesh) json["mesh_report"] = meshJson(surface, *built.mesh);
    return printJson(console.out, json);
  }
  if (built.mesh) console.out << meshText(surface, *built.mesh);
  const Field& field = session.current().field;
  console.out << fmt::format("{}{} in {:.1f} s, estimated RMS error {}{}\n",
                             arguments.has("output") ? arguments.text("output") + ": " : "", fieldLine(field),
                             built.seconds, shortNumber(field.metadata().rmsEstimate(field.domain())), unitText(field));
}

void runLoad(Session& session, const Arguments& arguments) {
  loadField(session, arguments.text("field"));
  if (session.wantsJson(arguments)) return printJson(session.console().out, fieldJson(session.current()));
  session.console().out << fmt::format("{}: {}\n", arguments.text("field"), fieldLine(session.current().field));
}

void runSave(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  saveCurrent(session, file);
  const auto bytes = session.current().fileBytes;
  if (session.wantsJson(arguments)) return printJson(session.console().out, {{"output", file}, {"file_bytes", *bytes}});
  session.console().out << fmt::format("{}: {}\n", file, bytesText(double(*bytes)));
}

void runInfo(Session& session, const Arguments& arguments) {
  useField(session, arguments);
  if (session.wantsJson(arguments)) return printJson(session.console().out, fieldJson(session.current()));
  session.console().out << fieldText(session.current());
}

void runQuery(Session& session, const Arguments& arguments) {
  useField(session, arguments);
  std::ifstream file;
  const bool fromFile = arguments.has("points") && arguments.text("points") != "-";
  if (fromFile) file = openPoints(arguments.text("points"));
  std::istream& in = fromFile ? static_cast<std::istream&>(file) : session.console().in;
  const std::string name = fromFile ? arguments.text("points") : "stdin";
  const PointFormat format = session.wantsJson(arguments) ? PointFormat::json : PointFormat::csv;
  const Field& field = session.current().field;
  if (!arguments.has("output")) {
    std::ostream& out = session.console().out;
    queryPoints(field, in, name, format, [&out](std::string_view text) {
      out.write(text.data(), static_cast<std::streamsize>(text.size()));
      out.flush();
      if (!out) throw Error("cannot write to standard output: its reader has gone, or the disk is full");
    });
    return;
  }
  OutputFile out(arguments.text("output"));
  const std::size_t count = queryPoints(field, in, name, format, [&out](std::string_view text) { out.write(text); });
  out.commit();
  session.console().err << fmt::format("{}: {} points\n", arguments.text("output"), grouped(count));
}

void runSmooth(Session& session, const Arguments& arguments) {
  checkFieldOutput(arguments);
  useField(session, arguments);
  if (session.current().field.metadata().continuityWeight > 0)
    throw Error(session.current().name + ": is weakly continuous already: take it as it was before, or build it anew");
  const Console& console = session.console();
  const InterruptGuard guard;  // until the file is whole
  const auto start = std::chrono::steady_clock::now();
  WeaklyContinuous made = withProgress(console, [&](const Progress& progress) {
    return weaklyContinuous(session.current().field, {.weight = arguments.number("continuity-weight")},
                            arguments.whole("threads"), progress);
  });
  const double seconds = secondsSince(start);
  changeCurrent(session, arguments, std::move(made.field));
  if (session.wantsJson(arguments)) {
    Json json = madeJson(session, arguments);
    json["change"] = made.change;
    json["iterations"] = made.iterations;
    json["seconds"] = seconds;
    return printJson(console.out, json);
  }
  const Field& field = session.current().field;
  console.out << fmt::format("{}: changed by {} RMS in {} iterations, {:.1f} s; estimated RMS error {}{}\n",
                             session.current().name, shortNumber(made.change), made.iterations, seconds,
                             shortNumber(field.metadata().rmsEstimate(field.domain())), unitText(field));
}

Command smoothCommand() {
  return {.name = "smooth",
          .summary = "Let a field jump less from cell to cell, for a little error: weak continuity.",
          .help =
              "Changes the cells' polynomials so that Σ w ∫ jump² dA + λ‖f − f₀‖² becomes least: the sum goes over the "
              "faces between cells, w is the smaller cell's edge across the face, f₀ the field as it was, λ the "
              "weight, which has no unit. Cells, degrees and bytes stay as they are. What 'build --continuity weak' "
              "does, for a field that is there; that rounds to float once, this a second time.\n"
              "\n"
              "The polynomials of cells have too few coefficients to meet along whole faces, so that this trades error "
              "for jump; 'hpsdf study continuity' shows how. Bounds are not kept. A field can be smoothed once. In a "
              "script, the smoothed field becomes the current one, "
              "and the output may be left out.",
          .examples = {"hpsdf smooth bunny.hpsdf -o smooth.hpsdf",
                       "hpsdf smooth bunny.hpsdf -o smoother.hpsdf --continuity-weight 0.05"},
          .parameters = {fieldParameter(), fieldOutputParameter(), continuityWeightParameter(),
                         threadsParameter("The field is")},
          .action = runSmooth};
}

void runBlend(Session& session, const Arguments& arguments) {
  checkFieldOutput(arguments);
  useField(session, arguments);
  const InterruptGuard guard;  // until the file is whole
  changeCurrent(session, arguments, blended(session.current().field, arguments.number("width")));
  if (session.wantsJson(arguments)) return printJson(session.console().out, madeJson(session, arguments));
  session.console().out << fmt::format("{}: {}, blended within {} of an edge from faces\n", session.current().name,
                                       fieldLine(session.current().field), arguments.number("width"));
}

void runBounds(Session& session, const Arguments& arguments) {
  checkFieldOutput(arguments);
  useField(session, arguments);
  const CurrentField& from = session.current();
  const Console& console = session.console();
  const InterruptGuard guard;  // until the file is whole
  const std::string surface = surfaceFor(session.current(), arguments);
  const ReferenceSurface reference = referenceSurface(console, surface, from.field.metadata().source);
  refuseForeign(from, reference, surface);
  warnOfBounds(console, reference.report);
  const auto start = std::chrono::steady_clock::now();
  Field field = withProgress(console, [&](const Progress& progress) {
    return withBounds(from.field, *reference.distance, arguments.whole("threads"), progress);
  });
  const double seconds = secondsSince(start);
  changeCurrent(session, arguments, std::move(field));
  Json json = madeJson(session, arguments);
  json["seconds"] = seconds;
  if (session.wantsJson(arguments)) return printJson(console.out, json);
  console.out << fmt::format("{}: nowhere wrong by more than {}, in the median cell by {}; {:.1f} s\n",
                             session.current().name, shortNumber(json["bounds"]["greatest"].get<double>()),
                             shortNumber(json["bounds"]["median"].get<double>()), seconds);
}

Command boundsCommand() {
  return {
      .name = "bounds",
      .summary = "Find what is certain of a field: how wrong it may be in each cell, and how steep.",
      .help =
          "Keeps two numbers for each cell: |f − Φ| is at most the one anywhere in it, not only where it was "
          "measured, and ‖∇f‖ at most the other. By them rays and collisions miss nothing: |f| less the first is "
          "a distance within which there is certainly no surface. What 'build --bounds' does, for a field that is "
          "there; bounds that it has are found anew. Coefficients stay as they are, to the bit.\n"
          "\n"
          "It takes MESH, what the field was made from, and 24 exact distances a cell; Φ is 1-Lipschitz, so that "
          "these bound it between them. MESH may be left out where the field was made from a built-in shape; a "
          "mesh that the field was not made from is refused. Bounds hold where Φ is a signed distance: not beside "
          "the holes of an open mesh, nor where one cuts itself.\n"
          "\n"
          "'smooth' and 'blend' change the field and leave bounds out: find them last. 'hpsdf verify' holds them "
          "against random points (--max-violations 0).",
      .examples = {"hpsdf bounds bunny.hpsdf bunny.obj -o certain.hpsdf", "hpsdf bounds torus.hpsdf -o certain.hpsdf"},
      .parameters = {fieldParameter(),
                     {.name = "mesh",
                      .type = ParameterType::text,
                      .help = "What the field was made from: mesh file, builtin:SHAPE or analytic:SHAPE.",
                      .valueName = "MESH",
                      .positional = true},
                     fieldOutputParameter(),
                     threadsParameter("The field is")},
      .action = runBounds};
}

Command buildCommand() {
  Command command{
      .name = "build",
      .summary = "Build a field from a mesh or a built-in shape.",
      .help =
          "MESH is a file (OBJ, PLY, STL, OFF, 3DS, glTF), builtin:SHAPE,parameter=value,… for the mesh of a built-in "
          "shape, or analytic:SHAPE,… for its distance in closed form; 'hpsdf shapes' lists the shapes.\n"
          "\n"
          "The construction refines the worst cell, by a higher degree or by eight children, until the weighted "
          "squared "
          "error over the domain falls below the target error τ. τ is meant for a mesh whose longest side L is 2, as "
          "in "
          "the paper; internally it is τ·(L/2)^5, so that the same τ gives the same cells whether the mesh is in "
          "metres "
          "or in millimetres. A hundredth of τ is about a tenth of the RMS error.\n"
          "\n"
          "Inside is what the mesh surrounds; where that is not plain, because it has holes or meets itself, a line "
          "says "
          "how it is decided (--sign). Ctrl-C stops and writes "
          "no field; with --checkpoint the same command goes on later from where it was. In a script, the field "
          "becomes the current one, and the output may be left out.\n"
          "\n"
          "With --batch every mesh of a list becomes OUTPUT/name-hash.hpsdf, and a line of JSON on standard output "
          "says what came of it. One that fails does not stop the others: the exit status is 3 at the end. Those that "
          "are there already, made from the same contents with the same options, are skipped. Any number of processes "
          "may work on one list and one folder: each mesh is built by one of them. docs/batch.md shows how, also with "
          "GNU parallel and Slurm.",
      .examples = {"hpsdf build bunny.obj -o bunny.hpsdf",
                   "hpsdf build bunny.obj -o paper.hpsdf --paper --target-error 1e-6 --grid 6",
                   "hpsdf build builtin:torus,major=0.7,minor=0.2 -o torus.hpsdf --target-error 1e-8",
                   "hpsdf build bunny.obj -o fine.hpsdf --target-error 1e-9 --checkpoint",
                   "hpsdf build --batch list.txt -o fields"},
      .parameters = {{.name = "mesh",
                      .type = ParameterType::text,
                      .help = "Mesh file, builtin:SHAPE or analytic:SHAPE.",
                      .valueName = "MESH",
                      .positional = true},
                     {.name = "output",
                      .type = ParameterType::outputPath,
                      .help = "The field's file, usually *.hpsdf; with batch, the folder of the fields, made where it "
                              "is not there.",
                      .alias = 'o',
                      .need = Need::onCommandLine},
                     {.name = "batch",
                      .type = ParameterType::path,
                      .help = "In place of MESH: a list of many, one a line, files (from the current folder) and "
                              "shapes; empty lines and # comments are passed over. - reads standard input.",
                      .valueName = "LIST"}},
      .action = runBuild,
      .check = checkBuildArguments};
  for (auto& parameters : {checkpointParameters(), buildParameters()})
    for (const Parameter& parameter : parameters) command.parameters.push_back(parameter);
  return command;
}

}  // namespace

void addFieldCommands(Registry& registry) {
  registry.add(buildCommand());
  registry.add(smoothCommand());
  registry.add(
      {.name = "blend",
       .summary = "Make a field continuous, with its gradient.",
       .help = "Along their faces neighbouring cells are blended by smooth weights, so that neither value nor "
               "gradient jumps anywhere in the domain; away from faces the field stays as it is, to the bit. "
               "No coefficient changes: the file says how wide the zones are, and queries and pictures do "
               "the rest. Bounds are not kept. 'build --continuity exact' does the same at once.\n"
               "\n"
               "In a script, the blended field becomes the current one, and the output may be left out.",
       .examples = {"hpsdf blend bunny.hpsdf -o smooth.hpsdf", "hpsdf blend bunny.hpsdf -o gentle.hpsdf --width 0.1"},
       .parameters = {fieldParameter(), fieldOutputParameter(), blendWidthParameter("width")},
       .action = runBlend});
  registry.add(boundsCommand());
  registry.add({.name = "info",
                .summary = "Tell what a field holds and how exact it is.",
                .help = "Leaves, coefficients, memory, errors, settings, the mesh it came from, and how its volume is "
                        "divided among degrees and depths. The estimated RMS error is √(ε/|Ω|) in mesh units, ε the "
                        "construction's own weighted estimate.",
                .examples = {"hpsdf info bunny.hpsdf", "hpsdf info bunny.hpsdf --json"},
                .parameters = {fieldParameter()},
                .action = runInfo});
  registry.add({.name = "query",
                .summary = "Distances and gradients at points.",
                .help = "Reads points, one a line, x,y,z or x y z, from a file or from standard input; empty lines, # "
                        "comments and a header line are passed over. Writes CSV with the header "
                        "x,y,z,distance,gx,gy,gz, numbers in full precision; with --json an array of objects.\n"
                        "\n"
                        "Negative distances are inside. Points outside the domain get a continuous extension.",
                .examples = {"echo 0.1 0.2 0.3 | hpsdf query bunny.hpsdf",
                             "hpsdf query bunny.hpsdf points.csv -o distances.csv"},
                .parameters = {fieldParameter(),
                               {.name = "points",
                                .type = ParameterType::path,
                                .help = "File of points; standard input when left out or -.",
                                .valueName = "POINTS",
                                .positional = true},
                               {.name = "output",
                                .type = ParameterType::outputPath,
                                .help = "File to write; standard output when left out.",
                                .alias = 'o'}},
                .action = runQuery});
  registry.add({.name = "load",
                .summary = "Load a field: it becomes the current one.",
                .help = "The commands that follow work on it.",
                .examples = {"load bunny.hpsdf"},
                .parameters = {{.name = "field",
                                .type = ParameterType::path,
                                .help = "A field's file.",
                                .valueName = "FIELD",
                                .positional = true,
                                .need = Need::always}},
                .action = runLoad,
                .scriptOnly = true});
  registry.add(
      {.name = "save",
       .summary = "Save the current field.",
       .help = "Written under a temporary name and renamed: an interrupted save leaves an older file as it was.",
       .examples = {"save output=bunny.hpsdf"},
       .parameters = {{.name = "output",
                       .type = ParameterType::outputPath,
                       .help = "The field's file, usually *.hpsdf.",
                       .alias = 'o',
                       .need = Need::always}},
       .action = runSave,
       .scriptOnly = true});
}

}  // namespace hpsdf::app
