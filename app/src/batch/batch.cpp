#include "batch/batch.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <optional>
#include <ostream>
#include <streambuf>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "batch/batch_list.h"
#include "batch/mesh_record.h"
#include "console/console.h"
#include "console/error_text.h"
#include "console/interrupt.h"
#include "console/long_work.h"
#include "construction/build_arguments.h"
#include "construction/build_field.h"
#include "files/output_folder.h"
#include "files/text_file.h"
#include "hpsdf/app/failed.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/field_file.h"
#include "language/script.h"
#include "session/asked_errors.h"
#include "session/field_summary.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

/// The outcome of the work on one mesh of the batch. After every outcome except `failed`, the mesh's field file exists.
enum class Status : std::uint8_t {
  built,
  skipped,  ///< the field existed already
  failed,
};

std::string statusName(Status status) {
  constexpr std::array kNames = {kBuilt, kSkipped, kFailed};
  return kNames[std::size_t(status)];
}

/// The script that runs for every field of a batch.
struct FieldScript {
  std::string file;  ///< "" for none
  std::string text = {};
};

/// Discards what is written to it.
class Nowhere : public std::streambuf {
 protected:
  int_type overflow(int_type c) override { return traits_type::not_eof(c); }
  std::streamsize xsputn(const char* /*text*/, std::streamsize count) override { return count; }
};

/// Returns the text with `name` in place of every occurrence of `value`.
std::string replaced(std::string text, const std::string& value, std::string_view name) {
  for (std::size_t at = text.find(value); at != std::string::npos; at = text.find(value, at + name.size()))
    text.replace(at, value.size(), name);
  return text;
}

class Batch {
 public:
  Batch(Session& session, const Arguments& arguments, const std::vector<BatchMesh>& meshes, FieldScript script,
        const fs::path& folder)
      : console_(session.console()),
        registry_(session.registry()),
        arguments_(arguments),
        meshes_(meshes),
        script_(std::move(script)),
        folder_(folder),
        silent_(&nowhere_) {}

  /// Throws `Error` if the script has a mistake, which then concerns all meshes, or writes the same file for each of
  /// them. `list` is not empty.
  void checkScript(const std::vector<BatchMesh>& list) const {
    if (script_.file.empty()) return;
    const std::vector<std::string> files = writtenBy(scriptCalls(list.front()));
    if (list.size() == 1) return;
    for (const std::string& file : writtenBy(scriptCalls(list[1])))
      if (std::ranges::find(files, file) != files.end())
        throw Error(ErrorKind::general, script_.file,
                    file + " would be written for every mesh; begin its name with $name");
  }

  void run() {
    const auto start = std::chrono::steady_clock::now();
    try {
      workThrough();
    } catch (const Cancelled&) {
      throw CancelledPartway(fmt::format(
          "{} of {} meshes are finished and kept; the same command continues with the others", done_, meshes_.size()));
    }
    console_.err << fmt::format("{}: {} built, {} skipped, {} failed, {}\n", printable(folder_.string()),
                                count(Status::built), count(Status::skipped), count(Status::failed),
                                durationText(secondsSince(start)))
                 << std::flush;
    if (const std::size_t failed = count(Status::failed); failed > 0)
      throw Failed(fmt::format("{}: {} of {} meshes failed; the lines above say why", arguments_.text("batch"), failed,
                               meshes_.size()),
                   kExitPartlyFailed);
    if (missed_ > 0)
      throw Failed(
          fmt::format("{}: {} of {} fields miss the errors that were asked for; the lines above say by how much",
                      arguments_.text("batch"), missed_, meshes_.size()));
  }

 private:
  struct Made {
    Status status = Status::failed;
    std::optional<CurrentField> field = {};
    Json madeFrom = {};
    Json then = {};
    bool isRecorded = false;  ///< the record says already that all is built
    std::string error = {};
    bool errorNamesMesh = false;
    std::string missed = {};  ///< what the field misses of the errors that were asked for
  };

  fs::path baseOf(const BatchMesh& mesh) const { return folder_ / mesh.name; }
  fs::path outputOf(const BatchMesh& mesh) const { return folder_ / (mesh.name + ".hpsdf"); }
  fs::path recordOf(const BatchMesh& mesh) const { return folder_ / (mesh.name + ".json"); }
  std::size_t count(Status status) const { return counts_[std::size_t(status)]; }

  /// Returns the console of the script's commands, whose reports nobody reads.
  Console silently() {
    Console silent{.in = console_.in, .out = silent_, .err = console_.err};
    silent.meshReader = console_.meshReader;
    silent.meshes = console_.meshes;
    silent.listener = console_.listener;
    silent.writesProgress = false;
    return silent;
  }

  /// Builds the fields of the meshes in the order of the list. A mesh at which an earlier process died comes last, so
  /// that a mesh which ends every process does not keep the others from being built.
  void workThrough() {
    std::vector<const BatchMesh*> last;
    for (const BatchMesh& mesh : meshes_) {
      if (statusOf(readRecord(recordOf(mesh))) == kBegun)
        last.push_back(&mesh);
      else
        workOn(mesh);
    }
    for (const BatchMesh* mesh : last) workOn(*mesh);
  }

  void workOn(const BatchMesh& mesh) {
    if (InterruptGuard::interrupted() || (console_.listener != nullptr && console_.listener->wantsCancel()))
      throw Cancelled();
    console_.work = fmt::format("{} of {}, {}: ", done_ + 1, meshes_.size(), printable(mesh.surface));
    const auto start = std::chrono::steady_clock::now();
    Made made = make(mesh);
    ++done_;
    ++counts_[std::size_t(made.status)];
    if (made.field) made.missed = missedErrors(arguments_, made.field->field);
    missed_ += made.missed.empty() ? 0 : 1;
    finish(mesh, made, secondsSince(start));
  }

  Made make(const BatchMesh& mesh) {
    Made made;
    try {
      makeFiles(mesh, made);
    } catch (const Cancelled&) {
      forgetBegun(mesh, made);
      throw;
    } catch (const std::exception& error) {
      const auto* known = dynamic_cast<const Error*>(&error);
      made.status = Status::failed;
      made.field.reset();
      made.then = nullptr;
      made.error = printable(errorText(error));
      made.errorNamesMesh = known != nullptr && known->subject() == mesh.surface;
    }
    return made;
  }

  /// Undoes that the record says "begun" when the work is cancelled: no process has died. A field that is finished is
  /// kept.
  void forgetBegun(const BatchMesh& mesh, const Made& made) const {
    if (statusOf(readRecord(recordOf(mesh))) != kBegun) return;
    std::error_code ignored;
    if (made.field)
      writeRecord(mesh, lineOf(mesh, made, 0), made);
    else
      fs::remove(recordOf(mesh), ignored);
  }

  /// Makes what is not there yet of the mesh's files: its field, and what the script writes. If it throws, `made` says
  /// how far it came.
  void makeFiles(const BatchMesh& mesh, Made& made) {
    const Json record = readRecord(recordOf(mesh));
    if (statusOf(record) == kBegun) removeAbandoned(mesh);
    if (record.is_object()) made.madeFrom = record.value(kMadeFrom, Json());
    // The contents are taken before the mesh is read: if the file changes in between, the next run finds other
    // contents.
    const std::string content = contentOf(console_, mesh.surface);
    made.field = finished(mesh, record, content);
    made.status = made.field ? Status::skipped : Status::built;
    if (!made.field) made.field = built(mesh, made.madeFrom);
    std::error_code ignored;
    fs::remove(checkpointOf(outputOf(mesh)), ignored);  // an old checkpoint would stop a build with other options
    made.madeFrom = madeFrom(mesh.surface, content, arguments_, outputOf(mesh));
    made.isRecorded = made.status == Status::skipped && statusOf(record) == kBuilt;
    if (script_.file.empty()) return;
    const std::vector<Call> calls = scriptCalls(mesh);
    const Json then = thenJson(mesh, calls);
    if (made.isRecorded && record.value(kThen, Json()) == then && allExist(writtenBy(calls))) return;
    made.isRecorded = false;
    made.status = Status::built;
    writeBegun(recordOf(mesh), mesh.surface, outputOf(mesh), made.madeFrom);
    runFor(mesh, *made.field, calls);
    made.then = then;
  }

  /// Returns the mesh's existing field if it is up to date, that is, if its record says that it was made of the present
  /// mesh by the present options and program. Returns std::nullopt otherwise.
  std::optional<CurrentField> finished(const BatchMesh& mesh, const Json& record, const std::string& content) const {
    const fs::path output = outputOf(mesh);
    if (content.empty() || record.is_null() || !fs::exists(output)) return std::nullopt;
    if (record.value(kMadeFrom, Json()) != madeFrom(mesh.surface, content, arguments_, output)) return std::nullopt;
    try {
      return CurrentField{load(output), output.string(), fs::file_size(output)};
    } catch (const Error& error) {
      note(console_, std::string(error.what()) + "; building it again");
      return std::nullopt;
    }
  }

  /// Removes the half-written files that a killed process left for this mesh.
  void removeAbandoned(const BatchMesh& mesh) const {
    const fs::path output = outputOf(mesh);
    std::vector<std::string> files = {output, recordOf(mesh), checkpointOf(output)};
    if (!script_.file.empty()) std::ranges::copy(writtenBy(scriptCalls(mesh)), std::back_inserter(files));
    for (const std::string& file : files) OutputFile::removeAbandoned(file);
  }

  CurrentField built(const BatchMesh& mesh, const Json& madeFromBefore) const {
    const fs::path output = outputOf(mesh);
    writeBegun(recordOf(mesh), mesh.surface, output, madeFromBefore);  // first, because `checkWritable` writes a file
    checkWritable(output);
    const fs::path checkpoint = arguments_.flag("checkpoint") ? checkpointOf(output) : fs::path();
    Field field = buildField(console_, mesh.surface, arguments_, checkpoint).field;
    save(field, output, {.compress = arguments_.flag("compress")});
    return {std::move(field), output.string(), fs::file_size(output)};
  }

  /// Returns the commands of the script for one mesh. Throws `Error` if they write the field or its record.
  std::vector<Call> scriptCalls(const BatchMesh& mesh) const {
    const std::string output = outputOf(mesh).string();
    const std::string surface = mesh.surface.starts_with('-') ? "./" + mesh.surface : mesh.surface;  // is no option
    std::vector<Call> calls = parseScript(registry_, script_.file, script_.text,
                                          {{"mesh", surface},
                                           {"field", output},
                                           {"name", baseOf(mesh).string()},
                                           {"threads", std::to_string(arguments_.whole("threads"))}});
    for (const Call& call : calls)
      for (const std::string& file : outputFiles(*call.command, call.arguments))
        for (const fs::path& own : {fs::path(output), recordOf(mesh), checkpointOf(output)})
          if (fs::path(file).lexically_normal() == own.lexically_normal())
            throw Error(ErrorKind::general, call.where, file + " belongs to the batch; give another name");
    return calls;
  }

  static std::vector<std::string> writtenBy(const std::vector<Call>& calls) {
    std::vector<std::string> files;
    for (const Call& call : calls)
      std::ranges::copy(outputFiles(*call.command, call.arguments), std::back_inserter(files));
    return files;
  }

  /// Returns what a record keeps of the script: its commands with all values. The names of the mesh's own files are
  /// replaced, so that it does not matter how the folder is called.
  Json thenJson(const BatchMesh& mesh, const std::vector<Call>& calls) const {
    Json list = Json::array();
    for (const Call& call : calls) {
      Json values = Json::object();
      for (const Parameter& parameter : call.command->parameters)
        if (parameter.name != "threads" && call.arguments.given(parameter.name))
          for (const std::string& value : call.arguments.texts(parameter.name))
            values[parameter.name].push_back(replaced(value, baseOf(mesh).string(), "$name"));
      list.push_back({{call.command->name, values}});
    }
    return Json::parse(jsonText(list));  // as a record of it is read: bytes that are not UTF-8 are replaced
  }

  static bool allExist(const std::vector<std::string>& files) {
    return std::ranges::all_of(files, [](const std::string& file) { return fs::exists(file); });
  }

  /// Runs the script for a field, in a session of its own: what a script does for one mesh must not change what it does
  /// for the next.
  void runFor(const BatchMesh& mesh, const CurrentField& field, const std::vector<Call>& calls) {
    Session session(registry_, silently());
    session.setField({field.field, field.name, field.fileBytes, mesh.surface});
    runScript(session, calls);
  }

  /// Reports what became of a mesh on the console and in its record, unless that says so already.
  void finish(const BatchMesh& mesh, const Made& made, double seconds) const {
    const Json line = lineOf(mesh, made, seconds);
    try {
      if (!made.isRecorded) writeRecord(mesh, line, made);
    } catch (const Error& error) {
      warn(console_, error.what());
    }
    const std::string position = fmt::format("{} of {}", done_, meshes_.size()), name = printable(mesh.surface);
    if (made.status == Status::failed) {
      console_.err << fmt::format("hpsdf: error: {}: {}{}\n", position, made.errorNamesMesh ? "" : name + ": ",
                                  made.error);
    } else {
      console_.err << fmt::format("{}: {}: {}, {} in {:.1f} s\n", position, name, statusName(made.status),
                                  fieldLine(made.field->field), seconds);
      if (!made.missed.empty())
        console_.err << fmt::format("hpsdf: warning: {}: {}: {}\n", position, name, made.missed);
    }
    console_.err << std::flush;
    // Each line of the output is written in one call, so that the lines of several processes do not mix.
    console_.out << jsonLine(line) << std::flush;
    const std::string output = outputOf(mesh).string();
    requireWritten(console_.out, std::span(&output, made.status == Status::failed ? 0 : 1));
  }

  /// Writes the record of a mesh: the values of `line`, and of what its field was made.
  void writeRecord(const BatchMesh& mesh, Json line, const Made& made) const {
    if (made.field) line["status"] = kBuilt;  // whichever process built it
    line[kMadeFrom] = made.madeFrom;
    line[kThen] = made.then;
    writeTextFile(recordOf(mesh), jsonText(line));
  }

  Json lineOf(const BatchMesh& mesh, const Made& made, double seconds) const {
    Json field = made.field ? fieldJson(*made.field) : Json();
    const auto value = [&](const char* name) { return made.field ? field.at(name) : Json(); };
    Json line = {{"file", mesh.surface},
                 {"output", outputOf(mesh).string()},
                 {"status", statusName(made.status)},
                 {"seconds", std::round(1e3 * seconds) / 1e3},
                 {"leaves", value("leaves")},
                 {"bytes", value("bytes")},
                 {"file_bytes", value("file_bytes")},
                 {"rms_estimate", value("rms_estimate")},
                 {"measured", value("measured")},
                 {"missed", made.missed.empty() ? Json() : Json(made.missed)},
                 {"sign", made.field ? field.at("mesh").at("sign") : Json()},
                 {"error", made.status == Status::failed ? Json(made.error) : Json()}};
    if (field.contains("exact_leaves")) line["exact_leaves"] = field["exact_leaves"];
    return line;
  }

  Console console_;
  const Registry& registry_;
  const Arguments& arguments_;
  const std::vector<BatchMesh>& meshes_;
  FieldScript script_;
  fs::path folder_;
  Nowhere nowhere_;
  std::ostream silent_;  // discards what is written to it
  std::size_t done_ = 0;
  std::array<std::size_t, 3> counts_{};  // number of meshes for each `Status`
  std::size_t missed_ = 0;               // number of fields that miss the errors that were asked for
};

}  // namespace

std::vector<BatchMesh> readBatchList(const Console& console, const std::string& list) {
  const bool isStandardInput = list == "-";
  const std::string text = isStandardInput ? readText(console.in, "standard input") : readTextFile(list);
  try {
    std::vector<BatchMesh> meshes = parseBatchList(text);
    if (meshes.empty()) throw Error("names no mesh; write one mesh a line");
    return meshes;
  } catch (const Error& error) {
    throw Error(fmt::format("{}: {}", isStandardInput ? "standard input" : list, error.what()));
  }
}

void checkBatch(const Arguments& arguments) {
  const bool many = arguments.has("batch");
  if (many && arguments.has("mesh")) throw Error("batch: the list names the meshes; leave MESH out");
  if (many && !arguments.has("output")) throw Error("batch: the fields are written to a folder; give output");
  requireOwner(arguments, "part", "batch", many);
  requireOwner(arguments, "then", "batch", many);
  if (arguments.has("part")) checkPart(arguments.text("part"));
}

void buildBatch(Session& session, const Arguments& arguments) {
  if (session.console().group != nullptr)
    throw Error("batch: several processes build one field together: start a list without mpirun, or share it by part");
  requireConsistent(arguments);
  const std::vector<BatchMesh> list = readBatchList(session.console(), arguments.text("batch"));
  const std::vector<BatchMesh> meshes = arguments.has("part") ? partOf(list, arguments.text("part")) : list;
  FieldScript script{.file = arguments.textOr("then", "")};
  if (!script.file.empty()) script.text = readTextFile(script.file);
  const InterruptGuard guard;  // on Ctrl-C, each file is written completely or not at all
  OutputFolder folder(arguments.text("output"));
  Batch batch(session, arguments, meshes, std::move(script), folder.path());
  batch.checkScript(list);
  checkWritable(folder.path() / ".writable");  // a name that nobody uses; no file of that name appears
  folder.keep();
  batch.run();
}

}  // namespace hpsdf::app
