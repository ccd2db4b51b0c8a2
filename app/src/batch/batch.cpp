#include "batch/batch.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
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
#include "console/console.h"
#include "console/error_text.h"
#include "console/interrupt.h"
#include "console/long_work.h"
#include "console/version.h"
#include "construction/build_arguments.h"
#include "construction/build_field.h"
#include "construction/surface.h"
#include "files/output_folder.h"
#include "files/text_file.h"
#include "hpsdf/app/failed.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/field_file.h"
#include "session/asked_errors.h"
#include "session/field_summary.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOwnFolder = ".batch";  // subfolder of the output folder, for locks and build records
constexpr auto kPollInterval = std::chrono::milliseconds(100);  // wait before locked meshes are tried again

/// The outcome of the work on one mesh of the batch. After every outcome except `failed`, the mesh's field file exists.
enum class Status : std::uint8_t {
  built,
  skipped,    ///< the field existed already
  elsewhere,  ///< another process built the field meanwhile
  failed,
};

std::string statusName(Status status) {
  constexpr std::array kNames = {"built", "skipped", "elsewhere", "failed"};
  return kNames[std::size_t(status)];
}

/// Returns a text that identifies the contents of a mesh file: a hash of the file's bytes. For glTF, whose files may
/// refer to other files, the imported mesh is hashed instead. Returns "" if the file cannot be read.
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

/// Returns the checksum at the end of a field file without verifying it. Returns "" if the file is too short.
std::string checksumOf(const fs::path& field) {
  constexpr int kBytes = 8;
  std::array<char, kBytes> bytes{};
  std::ifstream file(field, std::ios::binary);
  file.seekg(-kBytes, std::ios::end).read(bytes.data(), kBytes);
  std::string text;
  for (const char byte : bytes) text += fmt::format("{:02x}", std::uint8_t(byte));
  return file ? text : std::string();
}

/// Returns the names of the explicitly given options that affect the field. Options given with their default value are
/// included, because every explicit option overrides the preset --paper.
Json givenNames(const Arguments& arguments) {
  Json names = Json::array();
  for (const Parameter& parameter : buildParameters())
    if (decides(parameter) && arguments.given(parameter.name)) names.push_back(parameter.name);
  return names;
}

Json linesJson(const std::string& text) {
  Json list = Json::array();
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) list.push_back(line);
  return list;
}

/// Returns the error for a file that cannot be written, with the reason from `errno`. The caller must not
/// change `errno` before this call.
Error cannotWrite(const fs::path& file) {
  return Error(ErrorKind::file, file.string(),
               fmt::format("cannot be written ({}); check the folder's permissions", std::strerror(errno)));
}

/// Divides numbered tasks among processes by locks on single bytes of a shared file. A process claims a task by a lock
/// (fcntl record lock) on the byte whose offset follows from the task's number. The file stays empty, because a locked
/// byte need not exist. When a process ends, for any reason, the system releases its locks. The lock file must never be
/// removed: a process that opened a new file of the same name would not see the locks on the old file.
class FileLocks {
 public:
  /// Creates the lock file if it does not exist. Throws `Error` if the lock file cannot be written. A process must
  /// create only one object for each lock file: closing the file releases all locks that the process holds on the file.
  explicit FileLocks(fs::path file)
      : file_(std::move(file)), descriptor_(open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
    if (descriptor_ < 0) throw cannotWrite(file_);
  }
  ~FileLocks() { close(descriptor_); }
  FileLocks(const FileLocks&) = delete;
  FileLocks& operator=(const FileLocks&) = delete;

  /// Locks the task of this number. Returns false if another process holds the task's lock. Throws `Error` if the file
  /// system does not support locks.
  bool take(std::uint64_t number) const {
    if (change(number, F_WRLCK)) return true;
    if (errno == EACCES || errno == EAGAIN) return false;
    throw Error(
        fmt::format("{}: cannot be locked ({}), so that processes cannot share the work; name a folder on a "
                    "file system with locks",
                    file_.string(), std::strerror(errno)));
  }

  void release(std::uint64_t number) const { change(number, F_UNLCK); }

 private:
  bool change(std::uint64_t number, short type) const {
    struct flock range = {};
    range.l_type = type;
    range.l_whence = SEEK_SET;
    range.l_start = static_cast<off_t>(number >> 2);  // keeps offsets below 2^62, which all file servers support
    range.l_len = 1;
    for (;;) {
      if (fcntl(descriptor_, F_SETLK, &range) == 0) return true;
      if (errno != EINTR) return false;
    }
  }

  fs::path file_;
  int descriptor_;
};

/// An empty file that exists while a process builds a field. If the process dies, the file remains.
struct BuildMark {
  /// Creates the empty file. Throws `Error` if the file cannot be written: without the file, a process that
  /// dies during a construction would leave no trace.
  explicit BuildMark(fs::path path) : file(std::move(path)) {
    if (!std::ofstream(file)) throw cannotWrite(file);
  }
  ~BuildMark() {
    std::error_code ignored;
    fs::remove(file, ignored);
  }
  BuildMark(const BuildMark&) = delete;
  BuildMark& operator=(const BuildMark&) = delete;

  fs::path file;
};

class Batch {
 public:
  Batch(const Console& console, const Arguments& arguments, const std::vector<BatchMesh>& meshes,
        const fs::path& folder)
      : console_(console),
        arguments_(arguments),
        meshes_(meshes),
        folder_(folder),
        ownFolder_(folder / kOwnFolder),
        locks_(ownFolder_ / "claims") {}

  void run() {
    const auto start = std::chrono::steady_clock::now();
    try {
      workThrough();
    } catch (const Cancelled&) {
      throw CancelledPartway(fmt::format(
          "{} of {} meshes are finished and kept; the same command continues with the others", done_, meshes_.size()));
    }
    console_.err << fmt::format("{}: {} built, {} skipped, {} built elsewhere, {} failed, {}\n",
                                printable(folder_.string()), count(Status::built), count(Status::skipped),
                                count(Status::elsewhere), count(Status::failed), durationText(secondsSince(start)))
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
    Status status;
    std::optional<CurrentField> field = {};
    std::string error = {};
    bool errorNamesMesh = false;
    std::string missed = {};  ///< what the field misses of the errors that were asked for
  };

  fs::path outputOf(const BatchMesh& mesh) const { return folder_ / (mesh.name + ".hpsdf"); }
  fs::path recordOf(const BatchMesh& mesh) const { return ownFolder_ / (mesh.name + ".json"); }
  fs::path markOf(const BatchMesh& mesh) const { return ownFolder_ / (mesh.name + ".begun"); }
  std::size_t count(Status status) const { return counts_[std::size_t(status)]; }

  /// Builds the fields of the meshes in the order of the list. Meshes that are locked by other processes are tried
  /// again until all meshes are finished.
  void workThrough() {
    std::vector<const BatchMesh*> remaining;
    for (const BatchMesh& mesh : meshes_) remaining.push_back(&mesh);
    for (bool again = false; !remaining.empty(); again = true) {
      const std::size_t finished =
          std::erase_if(remaining, [&](const BatchMesh* mesh) { return attempt(*mesh, again); });
      if (!again && !remaining.empty())
        note(console_, fmt::format("waiting for {} of {} meshes, which other processes are building", remaining.size(),
                                   meshes_.size()));
      if (again && finished == 0) std::this_thread::sleep_for(kPollInterval);
    }
  }

  /// Builds the field of a mesh unless it exists already. Returns false if another process is working on the mesh.
  bool attempt(const BatchMesh& mesh, bool again) {
    if (InterruptGuard::interrupted() || (console_.listener != nullptr && console_.listener->wantsCancel()))
      throw Cancelled();
    if (!locks_.take(mesh.number)) return false;
    console_.work = fmt::format("{} of {}, {}: ", done_ + 1, meshes_.size(), printable(mesh.surface));
    const auto start = std::chrono::steady_clock::now();
    Made made = make(mesh, again);
    ++done_;
    ++counts_[std::size_t(made.status)];
    if (made.field) made.missed = missedErrors(arguments_, made.field->field);
    missed_ += made.missed.empty() ? 0 : 1;
    report(mesh, made, secondsSince(start));
    locks_.release(mesh.number);
    return true;
  }

  Made make(const BatchMesh& mesh, bool again) {
    try {
      removeAbandoned(mesh);
      std::optional<CurrentField> field = finished(mesh);
      Made made = field ? Made{again ? Status::elsewhere : Status::skipped, std::move(field)} : built(mesh);
      std::error_code ignored;
      fs::remove(checkpointOf(outputOf(mesh)), ignored);  // an old checkpoint would stop a build with other options
      return made;
    } catch (const Cancelled&) {
      throw;
    } catch (const std::exception& error) {
      const auto* known = dynamic_cast<const Error*>(&error);
      return {Status::failed, {}, printable(errorText(error)), known != nullptr && known->subject() == mesh.surface};
    }
  }

  /// Returns the mesh's existing field if it is up to date, that is, if the record stored beside it matches the present
  /// program, mesh and options. Returns std::nullopt otherwise.
  std::optional<CurrentField> finished(const BatchMesh& mesh) const {
    const fs::path output = outputOf(mesh), record = recordOf(mesh);
    if (!fs::exists(output) || !fs::exists(record)) return std::nullopt;
    const std::string content = contentOf(console_, mesh.surface);
    if (content.empty() || readTextFile(record.string()) != recordText(mesh, content)) return std::nullopt;
    try {
      return CurrentField{load(output), output.string(), fs::file_size(output)};
    } catch (const Error& error) {
      note(console_, std::string(error.what()) + "; building it again");
      return std::nullopt;
    }
  }

  /// Removes the half-written files that a killed process left for this mesh. Searches the folder only if the mesh's
  /// mark file exists, because a killed process leaves the mark file too. The caller must hold the mesh's lock.
  void removeAbandoned(const BatchMesh& mesh) const {
    if (!fs::exists(markOf(mesh))) return;
    const fs::path output = outputOf(mesh);
    for (const fs::path& file : {output, recordOf(mesh), checkpointOf(output)})
      OutputFile::removeAbandoned(file, OutputFile::Writers::others);
    fs::remove(markOf(mesh));
  }

  Made built(const BatchMesh& mesh) const {
    const fs::path output = outputOf(mesh);
    const BuildMark mark(markOf(mesh));  // created first, because `checkWritable` writes a file
    checkWritable(output);
    const fs::path checkpoint = arguments_.flag("checkpoint") ? checkpointOf(output) : fs::path();
    // Hash the file before reading the mesh: if the file changes in between, the next run notices that the hash
    // differs.
    const std::string content = contentOf(console_, mesh.surface);
    Field field = buildField(console_, mesh.surface, arguments_, checkpoint).field;
    try {
      write(mesh, field, content);
    } catch (const Error&) {
      // If the file system lost the locks, another process may have taken this process for dead and removed its
      // unfinished files. If the other process has finished the field, use that field. Otherwise write the field once
      // more: the files are not removed a second time.
      if (std::optional<CurrentField> other = finished(mesh)) return {Status::elsewhere, std::move(other)};
      write(mesh, field, content);
    }
    return {Status::built, CurrentField{std::move(field), output.string(), fs::file_size(output)}};
  }

  /// Saves the field, then the record of the mesh and options from which it was built.
  void write(const BatchMesh& mesh, const Field& field, const std::string& content) const {
    save(field, outputOf(mesh), {.compress = arguments_.flag("compress")});
    if (!content.empty()) writeTextFile(recordOf(mesh), recordText(mesh, content));
  }

  /// Returns the record of how the mesh's field file was built: program version, mesh, options and checksum of the
  /// file. A later run reuses the field only if it computes the same record.
  std::string recordText(const BatchMesh& mesh, const std::string& content) const {
    return jsonText({{"program", versionText()},
                     {"mesh", mesh.surface},
                     {"content", content},
                     {"options", linesJson(decidingArguments(arguments_))},
                     {"given", givenNames(arguments_)},
                     {"compress", arguments_.flag("compress")},
                     {"field", checksumOf(outputOf(mesh))}});
  }

  void report(const BatchMesh& mesh, const Made& made, double seconds) const {
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
    console_.out << lineOf(mesh, made, seconds).dump(-1, ' ', false, Json::error_handler_t::replace) + "\n"
                 << std::flush;
    const std::string output = outputOf(mesh).string();
    requireWritten(console_.out, std::span(&output, made.status == Status::failed ? 0 : 1));
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
  const Arguments& arguments_;
  const std::vector<BatchMesh>& meshes_;
  fs::path folder_;
  fs::path ownFolder_;
  FileLocks locks_;
  std::size_t done_ = 0;
  std::array<std::size_t, 4> counts_{};  // number of meshes for each `Status`
  std::size_t missed_ = 0;               // number of fields that miss the errors that were asked for
};

std::vector<BatchMesh> readList(const Console& console, const std::string& list) {
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

}  // namespace

void buildBatch(const Console& console, const Arguments& arguments) {
  requireConsistent(arguments);
  const std::vector<BatchMesh> meshes = readList(console, arguments.text("batch"));
  const InterruptGuard guard;  // on Ctrl-C, each file is written completely or not at all
  OutputFolder folder(arguments.text("output"));
  OutputFolder own(folder.path() / kOwnFolder);
  Batch batch(console, arguments, meshes, folder.path());
  own.keep();
  folder.keep();
  batch.run();
}

}  // namespace hpsdf::app
