#include "batch/batch.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

#include "batch/batch_list.h"
#include "batch/file_locks.h"
#include "console/console.h"
#include "console/error_text.h"
#include "console/failed.h"
#include "console/interrupt.h"
#include "console/long_work.h"
#include "console/version.h"
#include "construction/building.h"
#include "files/output_folder.h"
#include "files/text_file.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/field_file.h"
#include "language/script.h"
#include "session/field_summary.h"
#include "text/json.h"
#include "text/printable.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOwnFolder = ".batch";            // in that of the fields: the claims, and what each was made of
constexpr auto kTick = std::chrono::milliseconds(100);  // between two looks at whether another process is done

/// What became of a mesh. The first three: its field is there.
enum class Status : std::uint8_t {
  built,
  skipped,    ///< it was there already
  elsewhere,  ///< another process was at work on it, and is done
  failed,
};

std::string statusName(Status status) {
  constexpr std::array kNames = {"built", "skipped", "elsewhere", "failed"};
  return kNames[std::size_t(status)];
}

/// Of a file's bytes, "" for one that cannot be read; of a glTF file, whose bytes may name others, of its mesh.
std::string contentOf(const Console& console, const std::string& surface) {
  if (isShape(surface)) return "shape";
  std::error_code missing;
  if (!fs::is_regular_file(surface, missing)) return {};
  const std::string extension = lowerExtension(surface);
  if (extension == ".gltf" || extension == ".glb")
    return fmt::format("mesh {:016x}", fingerprint(importSurface(console, surface).mesh));
  std::ifstream file(surface, std::ios::binary);
  std::vector<char> piece(std::size_t{1} << 20);
  std::uint64_t hash = 0;
  while (file) {
    file.read(piece.data(), std::streamsize(piece.size()));
    hash = XXH3_64bits_withSeed(piece.data(), std::size_t(file.gcount()), hash);
  }
  return file.eof() ? fmt::format("bytes {:016x}", hash) : std::string();
}

/// As the file has it at its end, right or wrong.
std::string checksumOf(const fs::path& field) {
  constexpr int kBytes = 8;
  std::array<char, kBytes> bytes{};
  std::ifstream file(field, std::ios::binary);
  file.seekg(-kBytes, std::ios::end).read(bytes.data(), kBytes);
  std::string text;
  for (const char byte : bytes) text += fmt::format("{:02x}", std::uint8_t(byte));
  return file ? text : std::string();
}

/// Options that were written down: beside --paper, for one, that makes a difference, even with the value that they have
/// anyway.
Json givenNames(const Arguments& arguments) {
  Json names = Json::array();
  for (const Parameter& parameter : buildParameters())
    if (decides(parameter) && arguments.given(parameter.name)) names.push_back(parameter.name);
  return names;
}

Json optionsJson(const Arguments& arguments) {
  Json options = Json::array();
  std::istringstream lines(decidingArguments(arguments));
  for (std::string line; std::getline(lines, line);) options.push_back(line);
  return options;
}

/// An empty file that is there while a process builds a field, and after its death.
class Mark {
 public:
  /// Throws `Error` where it cannot be written: a death would leave no trace.
  explicit Mark(fs::path file) : file_(std::move(file)) {
    if (!std::ofstream(file_))
      throw Error(fmt::format("{}: cannot be written ({}); check the folder's permissions", file_.string(),
                              std::strerror(errno)));
  }
  ~Mark() {
    std::error_code ignored;
    fs::remove(file_, ignored);
  }
  Mark(const Mark&) = delete;
  Mark& operator=(const Mark&) = delete;

 private:
  fs::path file_;
};

class Batch {
 public:
  Batch(const Console& console, const Arguments& arguments, const std::vector<BatchMesh>& meshes,
        const fs::path& folder)
      : console_(console),
        arguments_(arguments),
        meshes_(meshes),
        folder_(folder),
        own_(folder / kOwnFolder),
        claims_(own_ / "claims") {}

  void run() {
    const auto start = std::chrono::steady_clock::now();
    try {
      workThrough();
    } catch (const Cancelled&) {
      throw CancelledPartway(fmt::format("{} of {} meshes were done and stay; the same command goes on with the others",
                                         done_, meshes_.size()));
    }
    console_.err << fmt::format("{}: {} built, {} skipped, {} built elsewhere, {} failed, {}\n", folder_.string(),
                                count(Status::built), count(Status::skipped), count(Status::elsewhere),
                                count(Status::failed), durationText(secondsSince(start)))
                 << std::flush;
    if (const std::size_t failed = count(Status::failed); failed > 0)
      throw Failed(fmt::format("{}: {} of {} meshes failed; the lines above say why", arguments_.text("batch"), failed,
                               meshes_.size()),
                   kExitPartlyFailed);
  }

 private:
  struct Made {
    Status status;
    std::optional<CurrentField> field = {};
    std::string error = {};
  };

  fs::path outputOf(const BatchMesh& mesh) const { return folder_ / (mesh.name + ".hpsdf"); }
  fs::path recordOf(const BatchMesh& mesh) const { return own_ / (mesh.name + ".json"); }
  fs::path markOf(const BatchMesh& mesh) const { return own_ / (mesh.name + ".begun"); }
  std::size_t count(Status status) const { return counts_[std::size_t(status)]; }

  /// In the list's order; what others are at work on at the end, as they end.
  void workThrough() {
    std::vector<const BatchMesh*> left;
    for (const BatchMesh& mesh : meshes_) left.push_back(&mesh);
    for (bool again = false; !left.empty(); again = true) {
      std::vector<const BatchMesh*> busy;
      for (const BatchMesh* mesh : left)
        if (!attempt(*mesh, again)) busy.push_back(mesh);
      if (!again && !busy.empty())
        note(console_, fmt::format("waiting for {} of {} meshes, which other processes are at work on", busy.size(),
                                   meshes_.size()));
      if (again && busy.size() == left.size()) std::this_thread::sleep_for(kTick);
      left = std::move(busy);
    }
  }

  /// Whether it is done; not where another process is at work on it.
  bool attempt(const BatchMesh& mesh, bool again) {
    if (InterruptGuard::interrupted() || (console_.listener != nullptr && console_.listener->wantsCancel()))
      throw Cancelled();
    const std::optional<Claim> claim = claims_.take(mesh.number);
    if (!claim) return false;
    console_.work = fmt::format("{} of {}, {}: ", done_ + 1, meshes_.size(), printable(mesh.surface));
    const auto start = std::chrono::steady_clock::now();
    const Made made = make(mesh, again);
    ++done_;
    ++counts_[std::size_t(made.status)];
    tell(mesh, made, secondsSince(start));
    return true;
  }

  Made make(const BatchMesh& mesh, bool again) {
    try {
      sweep(mesh);
      std::optional<CurrentField> field = finished(mesh);
      Made made = field ? Made{again ? Status::elsewhere : Status::skipped, std::move(field)} : built(mesh);
      std::error_code ignored;
      fs::remove(checkpointOf(outputOf(mesh)), ignored);  // of other options too: later it would stop a construction
      return made;
    } catch (const Cancelled&) {
      throw;
    } catch (const std::exception& error) {
      return {Status::failed, {}, errorText(error)};
    }
  }

  /// The field that is there, where it is what a construction would give.
  std::optional<CurrentField> finished(const BatchMesh& mesh) const {
    const fs::path output = outputOf(mesh), record = recordOf(mesh);
    if (!fs::exists(output) || !fs::exists(record)) return std::nullopt;
    const std::string content = contentOf(console_, mesh.surface);
    if (content.empty() || readTextFile(record.string()) != recordText(mesh, content)) return std::nullopt;
    try {
      return CurrentField{load(output), output.string(), fs::file_size(output)};
    } catch (const Error& error) {
      note(console_, std::string(error.what()) + "; building it anew");
      return std::nullopt;
    }
  }

  /// The claim is ours: who left a mark has died, and what it left half-written is abandoned, whatever machine it was
  /// on. Without a mark there is none, which saves a look through the whole folder.
  void sweep(const BatchMesh& mesh) const {
    if (!fs::exists(markOf(mesh))) return;
    const fs::path output = outputOf(mesh);
    for (const fs::path& file : {output, recordOf(mesh), checkpointOf(output)})
      OutputFile::removeAbandoned(file, OutputFile::Writers::others);
    fs::remove(markOf(mesh));
  }

  Made built(const BatchMesh& mesh) const {
    const fs::path output = outputOf(mesh);
    checkWritable(output);
    const fs::path checkpoint = arguments_.flag("checkpoint") ? checkpointOf(output) : fs::path();
    const Mark mark(markOf(mesh));
    // before the mesh is read: if it changes in between, the next run sees that
    const std::string content = contentOf(console_, mesh.surface);
    Field field = buildField(console_, mesh.surface, arguments_, checkpoint).field;
    try {
      write(mesh, field, content);
    } catch (const Error&) {
      // Where locks are lost, another process may have taken us for dead and swept away what we had half-written. It
      // may be done with the mesh itself; if not, it sweeps no more.
      if (std::optional<CurrentField> theirs = finished(mesh)) return {Status::elsewhere, std::move(theirs)};
      write(mesh, field, content);
    }
    return {Status::built, CurrentField{std::move(field), output.string(), fs::file_size(output)}};
  }

  /// The field, then what it was made of.
  void write(const BatchMesh& mesh, const Field& field, const std::string& content) const {
    save(field, outputOf(mesh));
    if (!content.empty()) writeTextFile(recordOf(mesh), recordText(mesh, content));
  }

  /// What the field that lies in the folder is made of, if the options are the ones of now: kept beside it, and
  /// compared as a whole. The field's checksum ties the two together.
  std::string recordText(const BatchMesh& mesh, const std::string& content) const {
    std::ostringstream text;
    printJson(text, {{"program", versionText()},
                     {"mesh", mesh.surface},
                     {"content", content},
                     {"options", optionsJson(arguments_)},
                     {"given", givenNames(arguments_)},
                     {"field", checksumOf(outputOf(mesh))}});
    return std::move(text).str();
  }

  void tell(const BatchMesh& mesh, const Made& made, double seconds) const {
    const std::string position = fmt::format("{} of {}", done_, meshes_.size()), name = printable(mesh.surface);
    if (made.status == Status::failed) {
      // some errors speak of what is wrong alone
      const std::string error = printable(made.error);
      const bool named = error.find(name) != std::string::npos;
      console_.err << fmt::format("hpsdf: error: {}: {}{}\n", position, named ? "" : name + ": ", error);
    } else {
      console_.err << fmt::format("{}: {}: {}, {} in {:.1f} s\n", position, name, statusName(made.status),
                                  fieldLine(made.field->field), seconds);
    }
    console_.err << std::flush;
    // in one piece, so that the lines of several processes do not mix
    console_.out << lineOf(mesh, made, seconds).dump(-1, ' ', false, Json::error_handler_t::replace) + "\n"
                 << std::flush;
    if (!console_.out) throw Error("cannot write to standard output: its reader has gone, or the disk is full");
  }

  Json lineOf(const BatchMesh& mesh, const Made& made, double seconds) const {
    Json field = made.field ? fieldJson(*made.field) : Json();
    const auto of = [&](const char* name) { return made.field ? field.at(name) : Json(); };
    return {{"file", mesh.surface},
            {"output", outputOf(mesh).string()},
            {"status", statusName(made.status)},
            {"seconds", std::round(1e3 * seconds) / 1e3},
            {"leaves", of("leaves")},
            {"bytes", of("bytes")},
            {"file_bytes", of("file_bytes")},
            {"rms_estimate", of("rms_estimate")},
            {"sign", made.field ? field.at("mesh").at("sign") : Json()},
            {"error", made.status == Status::failed ? Json(printable(made.error)) : Json()}};
  }

  Console console_;
  const Arguments& arguments_;
  const std::vector<BatchMesh>& meshes_;
  fs::path folder_;
  fs::path own_;
  FileLocks claims_;
  std::size_t done_ = 0;
  std::array<std::size_t, 4> counts_{};  // by `Status`
};

std::vector<BatchMesh> readList(const Console& console, const std::string& list) {
  const bool typed = list == "-";
  const std::string text = typed ? readText(console.in, "standard input") : readTextFile(list);
  try {
    std::vector<BatchMesh> meshes = parseBatchList(text);
    if (meshes.empty()) throw Error("names no mesh; write one a line");
    return meshes;
  } catch (const Error& error) {
    throw Error(fmt::format("{}: {}", typed ? "standard input" : list, error.what()));
  }
}

}  // namespace

void buildBatch(const Console& console, const Arguments& arguments) {
  requireConsistent(arguments);
  const std::vector<BatchMesh> meshes = readList(console, arguments.text("batch"));
  const InterruptGuard guard;  // no file is left half-written
  OutputFolder folder(arguments.text("output"));
  OutputFolder own(folder.path() / kOwnFolder);
  Batch batch(console, arguments, meshes, folder.path());
  own.keep();
  folder.keep();
  batch.run();
}

}  // namespace hpsdf::app
