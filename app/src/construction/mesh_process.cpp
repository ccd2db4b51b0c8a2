#include "construction/mesh_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <new>
#include <optional>
#include <thread>
#include <vector>

#include "construction/mesh_reply.h"
#include "files/other_program.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "language/registry.h"
#include "text/printable.h"

extern char** environ;

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kCommand = "__read-mesh";  // hidden command; FILE SECONDS BYTES follow
constexpr const char* kSecondsVariable = "HPSDF_IMPORT_SECONDS";
constexpr const char* kBytesVariable = "HPSDF_IMPORT_BYTES";
constexpr auto kTick = std::chrono::milliseconds(50);  // longest time before Ctrl-C is noticed
constexpr double kSilentSeconds = 2;                   // a busy machine starts a process slowly

// An idle machine reads 20 MB a second and takes 4 to 9 bytes of memory for one of the file (docs/meshes.md).
constexpr double kSeconds = 60;
constexpr double kBytesASecond = 2e6;
constexpr std::uint64_t kMemory = std::uint64_t{1} << 30;
constexpr std::uint64_t kMemoryAByte = 32;

/// The number in an environment variable; nothing where it is unset. Throws `Error` for other texts.
std::optional<double> numberOf(const char* variable) {
  const char* text = std::getenv(variable);
  if (text == nullptr || *text == '\0') return std::nullopt;
  const auto number = parseNumber(text);
  if (!number || !(*number > 0 && *number <= 1e15))
    throw Error(fmt::format("{}: expected a number above 0 and at most 1e15, found '{}'", variable, text));
  return number;
}

/// Settings of posix_spawn: the standard streams of the reading process, and the signals that it ignores.
class SpawnSettings {
 public:
  explicit SpawnSettings(int output) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions_, output, STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions_, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    sigset_t ours;
    sigemptyset(&ours);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
      sigaddset(&ours, signal);  // Ctrl-C reaches both processes; this one reacts
    posix_spawnattr_init(&attributes_);
    posix_spawnattr_setsigmask(&attributes_, &ours);
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK);
  }
  ~SpawnSettings() {
    posix_spawnattr_destroy(&attributes_);
    posix_spawn_file_actions_destroy(&actions_);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  const posix_spawn_file_actions_t* actions() const { return &actions_; }
  const posix_spawnattr_t* attributes() const { return &attributes_; }

 private:
  posix_spawn_file_actions_t actions_;
  posix_spawnattr_t attributes_;
};

/// The reading process and the pipe from its standard output. The destructor kills it if it still runs.
class ReadingProcess {
 public:
  ReadingProcess(const fs::path& program, const fs::path& file, const ReadingLimits& limits) {
    std::vector<std::string> words = {program.string(), kCommand, file.string(), fmt::format("{}", limits.seconds),
                                      fmt::format("{}", limits.bytes)};
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw notStarted(file, errno);
    output_ = ends[0];
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    const SpawnSettings settings(ends[1]);
    const int error =
        posix_spawn(&id_, program.c_str(), settings.actions(), settings.attributes(), pointers.data(), environ);
    close(ends[1]);
    if (error == 0) return;
    close(output_);
    throw notStarted(file, error);
  }
  ~ReadingProcess() {
    close(output_);
    if (!running_) return;
    kill(id_, SIGKILL);
    int status = 0;
    waitForProcess(id_, status, 0);
  }
  ReadingProcess(const ReadingProcess&) = delete;
  ReadingProcess& operator=(const ReadingProcess&) = delete;

  /// Waits at most `kTick`. Returns true if there is output, or its end.
  bool hasOutput() const {
    pollfd stream = {output_, POLLIN, 0};
    return poll(&stream, 1, kTick.count()) > 0;
  }

  /// Reads the available output into `buffer`; the result is empty at the end of the output.
  std::span<const std::byte> read(std::span<std::byte> buffer) const {
    for (;;) {
      const ssize_t count = ::read(output_, buffer.data(), buffer.size());
      if (count >= 0) return buffer.first(std::size_t(count));
      if (errno != EINTR) return {};
    }
  }

  /// The exit status; nothing while the process runs.
  std::optional<int> ended() {
    int status = 0;
    if (waitForProcess(id_, status, WNOHANG) == 0) return std::nullopt;
    running_ = false;
    return status;
  }

 private:
  static Error notStarted(const fs::path& file, int error) {
    return Error(fmt::format("{}: no process can be started to read it ({}); close other programs and try again",
                             file.string(), std::strerror(error)));
  }

  pid_t id_ = 0;
  int output_ = -1;
  bool running_ = true;
};

std::string endText(int status) {
  if (WIFEXITED(status)) return fmt::format("exit status {}", WEXITSTATUS(status));
  switch (WTERMSIG(status)) {
    case SIGABRT:
      return "aborted by a check of its own";
    case SIGSEGV:
    case SIGBUS:
      return "wrong access to memory";
    case SIGFPE:
      return "division by zero";
    case SIGKILL:
      return "killed; perhaps the machine ran out of memory";
    default:
      return fmt::format("signal {}", WTERMSIG(status));
  }
}

/// The reading of one file from the start of the process to its reply.
class Reading {
 public:
  Reading(const fs::path& program, const fs::path& file, const ReadingLimits& limits, const Progress& progress)
      : file_(file),
        limits_(limits),
        progress_(progress),
        task_("Reading " + printable(file.filename().string())),
        process_(program, file, limits) {}

  MeshReply reply() {
    receive();
    if (expected_ == 0 || bytes_.size() < expected_) throw died();
    MeshReply reply = parseReply(bytes_);
    if (reply.kind == MeshReply::Kind::outOfMemory) throw tooLarge();
    return reply;
  }

 private:
  Error tooLarge() const {
    return Error(
        fmt::format("{}: reading it takes more than {} of memory; check or export the file again, or set {} "
                    "above {}",
                    file_.string(), bytesText(double(limits_.bytes)), kBytesVariable, limits_.bytes));
  }

  void receive() {
    std::array<std::byte, 65536> buffer;
    for (;;) {
      pause();
      if (!process_.hasOutput()) continue;
      const auto piece = process_.read(buffer);
      if (piece.empty()) return;
      bytes_.insert(bytes_.end(), piece.begin(), piece.end());
      if (expected_ == 0 && bytes_.size() >= kReplyHeaderBytes) expectWhole();
      if (expected_ > 0 && bytes_.size() > expected_) throw DamagedReply("it goes on too long");
    }
  }

  /// Applies the limit of memory to this process too: a reply may be long although its sender needed little memory.
  void expectWhole() {
    expected_ = replyBytes(bytes_);
    if (expected_ > limits_.bytes) throw tooLarge();
    bytes_.reserve(expected_);
  }

  /// Checks for cancellation and the limit of time, and reports progress.
  void pause() const {
    progress_.throwIfCancelled();
    const double elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
    if (elapsed > limits_.seconds)
      throw Error(fmt::format("{}: reading it takes more than {} s; check or export the file again, or set {} above {}",
                              file_.string(), limits_.seconds, kSecondsVariable, limits_.seconds));
    if (elapsed > kSilentSeconds && progress_.report) progress_.report(task_, 0);  // the fraction is unknown
  }

  Error died() {
    std::optional<int> status;
    for (; !(status = process_.ended()); pause()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return Error(
        fmt::format("{}: the process that read it came down ({}): the file is damaged, or too much for assimp; "
                    "check or export it again",
                    file_.string(), endText(*status)));
  }

  const fs::path& file_;
  const ReadingLimits& limits_;
  const Progress& progress_;
  std::string task_;
  Clock::time_point start_ = Clock::now();
  ReadingProcess process_;
  std::vector<std::byte> bytes_;
  std::uint64_t expected_ = 0;  ///< length of the reply; 0 until its header has arrived
};

// The reading process

void toStandardOutput(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(STDOUT_FILENO, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) _exit(1);  // the other process has ended
    bytes = bytes.subspan(std::size_t(count));
  }
}

/// Ends the process at once: assimp would catch bad_alloc and report damage, or continue without the memory.
void onMemoryOut() {
  writeOutOfMemory(toStandardOutput);
  _exit(0);
}

void limit(decltype(RLIMIT_CORE) resource, double most) {
  rlimit now{};
  if (getrlimit(resource, &now) != 0) return;
  if (now.rlim_max == RLIM_INFINITY || most < double(now.rlim_max)) now.rlim_max = rlim_t(most);
  now.rlim_cur = now.rlim_max;
  setrlimit(resource, &now);
}

void confine(double seconds, [[maybe_unused]] double bytes) {
#ifdef __linux__
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  prctl(PR_SET_DUMPABLE, 0);  // the limit of core files does not hold for cores that are piped to a program
#endif
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, std::ceil(seconds) + 1);  // ends the process if its parent died
#ifndef HPSDF_SANITIZED                       // a sanitizer reserves terabytes of address space
  limit(RLIMIT_DATA, bytes);
#endif
  std::set_new_handler(onMemoryOut);
}

}  // namespace

ReadingLimits readingLimits(const fs::path& file) {
  std::error_code unknown;
  const std::uintmax_t found = fs::file_size(file, unknown);
  const std::uint64_t size = unknown ? 0 : found;
  const auto seconds = numberOf(kSecondsVariable);
  const auto bytes = numberOf(kBytesVariable);
  return {.seconds = seconds ? *seconds : kSeconds + std::floor(double(size) / kBytesASecond),
          .bytes = bytes ? std::uint64_t(*bytes)
                         : std::uint64_t(std::min(double(kMemory + kMemoryAByte * size), allowedMemory()))};
}

fs::path ownProgram() {
  constexpr const char* kLink = "/proc/self/exe";  // it is valid even when the file has been replaced
  return access(kLink, X_OK) == 0 ? fs::path(kLink) : fs::path();
}

ImportedMesh importInSubprocess(const fs::path& program, const fs::path& file, const ReadingLimits& limits,
                                const Progress& progress) {
  try {
    MeshReply reply = Reading(program, file, limits, progress).reply();
    if (reply.kind == MeshReply::Kind::refusal) throw Error(reply.refusal);
    reply.imported.mesh.name = file.filename().string();
    return std::move(reply.imported);
  } catch (const DamagedReply& damage) {
    throw Error(
        fmt::format("{}: the process that read it gave a wrong answer ({}): the file is damaged; check or "
                    "export it again",
                    file.string(), damage.what()));
  }
}

bool asksForReading(std::span<const std::string> words) { return words.size() == 4 && words[0] == kCommand; }

int readForOtherProcess(std::span<const std::string> words) {
  const auto seconds = parseNumber(words[2]);
  const auto bytes = parseNumber(words[3]);
  if (!seconds || !bytes) return 2;
  confine(*seconds, *bytes);
  try {
    // The stacks of threads would count as memory.
    writeMesh(withThreads(1, [&] { return importMesh(words[1]); }), toStandardOutput);
  } catch (const Error& error) {
    writeRefusal(error.what(), toStandardOutput);
  } catch (const std::bad_alloc&) {  // thrown by code that calls malloc, as Eigen does, and bypasses `onMemoryOut`
    writeOutOfMemory(toStandardOutput);
  } catch (const std::exception& error) {
    writeRefusal(fmt::format("{}: {} (this is a fault of the program)", words[1], error.what()), toStandardOutput);
  }
  return 0;
}

}  // namespace hpsdf::app
