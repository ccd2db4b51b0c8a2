#include "commands/made_field.h"

#include <fmt/format.h>

#include <optional>
#include <system_error>
#include <utility>

#include "console/interrupt.h"
#include "construction/build_arguments.h"
#include "construction/mesh_summary.h"
#include "files/text_file.h"
#include "hpsdf/app/failed.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/field_file.h"
#include "ranks/process_group.h"
#include "session/asked_errors.h"
#include "session/field_summary.h"

namespace hpsdf::app {
namespace {

/// Returns the path of the checkpoint file, or an empty path if the arguments ask for no checkpoint.
std::filesystem::path checkpointFile(const Arguments& arguments) {
  return arguments.flag("checkpoint") ? checkpointOf(arguments.text("output")) : std::filesystem::path();
}

BuiltField buildKeepingState(const std::function<BuiltField(const std::filesystem::path&)>& build,
                             const std::filesystem::path& checkpoint) {
  try {
    return build(checkpoint);
  } catch (const Cancelled&) {
    if (!checkpoint.empty() && std::filesystem::exists(checkpoint))
      throw CancelledPartway(
          fmt::format("{} keeps the state; the same command continues from it", checkpoint.string()));
    throw;
  }
}

/// Removes the checkpoint of a finished construction. Also removes temporary files of processes that were
/// killed while they wrote the field.
void removeLeftovers(const std::filesystem::path& checkpoint, const std::filesystem::path& output) {
  std::error_code ignored;
  std::filesystem::remove(checkpoint, ignored);
  OutputFile::removeAbandoned(output);
}

/// The figures of a construction that `reportBuilt` reports besides those of the field.
struct BuildFigures {
  double seconds;
  std::optional<MeshReport> mesh;
  std::string missed;  ///< what the field misses of the errors that were asked for
};

/// Reports the current field, which was just built.
void reportBuilt(const Session& session, const Arguments& arguments, const std::string& surface,
                 const BuildFigures& figures) {
  std::ostream& out = session.console().out;
  if (session.wantsJson(arguments)) {
    Json json = madeJson(session, arguments);
    json["build_seconds"] = figures.seconds;
    json["missed"] = figures.missed.empty() ? Json() : Json(figures.missed);
    if (figures.mesh) json["mesh_report"] = meshJson(surface, *figures.mesh);
    return printJson(out, json);
  }
  if (figures.mesh) out << meshText(surface, *figures.mesh);
  const Field& field = session.current().field;
  out << fmt::format("{}{} in {:.1f} s\nmeasured: {}\n", arguments.has("output") ? arguments.text("output") + ": " : "",
                     fieldLine(field), figures.seconds, measuredText(field));
  if (const std::string exactness = exactnessText(field); !exactness.empty())
    out << fmt::format("distances: {}\n", exactness);
  if (hasTolerance(field) && !missesTolerance(field)) out << fmt::format("tolerance: {}\n", toleranceText(field));
}

}  // namespace

Parameter fieldOutputParameter() {
  return {
      "output", outputFile().as('o').requiredOnCommandLine(),
      "File of the resulting field, usually *.hpsdf. A script may leave it out; the result becomes the current field "
      "in any case."};
}

Parameter compressParameter() {
  return {
      "compress", flag().under(kFiles),
      "Compress the file without loss. It loads into the same field, to the bit, by the same commands, and takes as "
      "many "
      "bytes of memory. Use it to store or send fields: files take a third to four fifths of their bytes, quantized "
      "ones and those with exact leaves the least; one of less than 2 kB does not shrink. For each megabyte, saving "
      "takes up to half a second, and loading a few milliseconds."};
}

void checkFieldOutput(const Arguments& arguments) {
  requireOwner(arguments, "compress", "output", arguments.has("output"));
  if (arguments.has("output")) checkWritable(arguments.text("output"));
}

void checkCheckpoint(const Arguments& arguments) {
  const bool keeps = arguments.flag("checkpoint");
  if (keeps && !arguments.has("output")) throw Error("checkpoint: the file is kept beside the output; give output");
  requireOwner(arguments, "checkpoint-seconds", "checkpoint", keeps);
}

void saveCurrent(Session& session, const Arguments& arguments) {
  const std::string file = arguments.text("output");
  save(session.current().field, file, {.compress = arguments.flag("compress")});
  session.setFileBytes(std::filesystem::file_size(file));
}

void saveMade(Session& session, const Arguments& arguments) {
  if (arguments.has("output")) saveCurrent(session, arguments);
}

Json madeJson(const Session& session, const Arguments& arguments) {
  Json json = fieldJson(session.current());
  json["output"] = arguments.has("output") ? Json(arguments.text("output")) : Json();
  return json;
}

void buildAndReport(Session& session, const Arguments& arguments, const BuildSource& from,
                    const std::function<BuiltField(const std::filesystem::path& checkpoint)>& build) {
  const std::filesystem::path checkpoint = checkpointFile(arguments);
  const ProcessGroup* group = session.console().group;
  if (group == nullptr || group->isFirst()) checkFieldOutput(arguments);
  const InterruptGuard guard;  // on Ctrl-C, the file is written completely or not at all
  BuiltField built = buildKeepingState(build, checkpoint);
  session.setField({std::move(built.field), arguments.textOr("output", from.name), {}, from.surface});
  session.setExact(std::move(built.exact));
  saveMade(session, arguments);
  if (!checkpoint.empty()) removeLeftovers(checkpoint, arguments.text("output"));
  const std::string missed = missedErrors(arguments, session.current().field);
  reportBuilt(session, arguments, from.surface, {built.seconds, built.mesh, missed});
  if (!missed.empty()) throw Failed(missed);
}

}  // namespace hpsdf::app
