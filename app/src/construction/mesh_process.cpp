#include "construction/mesh_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
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
#include <new>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "files/other_program.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/mesh_file.h"
#include "language/registry.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kCommand = "__read-mesh";  // hidden command, followed by FILE SECONDS BYTES
constexpr const char* kSecondsVariable = "HPSDF_IMPORT_SECONDS";
constexpr const char* kBytesVariable = "HPSDF_IMPORT_BYTES";
// The process answers with a PLY file, or with one of these words; a reason follows the first of them.
constexpr std::string_view kRefused = "refused: ";
constexpr std::string_view kOutOfMemory = "out of memory";

constexpr auto kInterruptInterval = std::chrono::milliseconds(50);  // longest time before Ctrl-C is noticed
constexpr double kSilentSeconds = 2;  // progress is shown only after this time: processes may start slowly

// Limits of time and memory for reading a mesh file. They are generous: with assimp an idle machine reads 20 MB/s and
// needs 4 to 9 bytes of memory for each byte of the file.
constexpr double kSeconds = 60;
constexpr double kBytesASecond = 2e6;
constexpr std::uint64_t kMemory = std::uint64_t{1} << 30;
constexpr std::uint64_t kMemoryAByte = 32;

/// Returns the number in an environment variable, or std::nullopt if the variable is unset or empty. Throws
/// `Error` if its text is not a number within the accepted range.
std::optional<double> numberOf(const char* variable) {
  const char* text = std::getenv(variable);
  if (text == nullptr || *text == '\0') return std::nullopt;
  const auto number = parseNumber(text);
  if (!number || !(*number > 0 && *number <= 1e15))
    throw Error(fmt::format("{}: expected a number above 0 and at most 1e15, found '{}'", variable, text));
  return number;
}

/// The pipe through which the process that reads a mesh file sends its reply to this process.
struct Pipe {
  Pipe() {
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category());
  }
  ~Pipe() {
    closeInput();
    close(ends[0]);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  void closeInput() {
    if (ends[1] >= 0) close(std::exchange(ends[1], -1));
  }

  std::array<int, 2> ends{-1, -1};
};

std::string endText(int status) {
  if (WIFEXITED(status)) return fmt::format("exit status {}", WEXITSTATUS(status));
  constexpr std::pair<int, const char*> kCauses[] = {{SIGABRT, "aborted by a check of its own"},
                                                     {SIGSEGV, "wrong access to memory"},
                                                     {SIGBUS, "wrong access to memory"},
                                                     {SIGFPE, "division by zero"},
                                                     {SIGKILL, "killed; perhaps the machine ran out of memory"}};
  for (const auto& [signal, cause] : kCauses)
    if (WTERMSIG(status) == signal) return cause;
  return fmt::format("signal {}", WTERMSIG(status));
}

/// One run of the process that reads a mesh file, from its start to its answer.
class Reading {
 public:
  Reading(const fs::path& program, const fs::path& file, const ReadingLimits& limits, const Progress& progress)
      : file_(file),
        limits_(limits),
        progress_(progress),
        process_(
            {.program = program,
             .arguments = {kCommand, file.string(), fmt::format("{}", limits.seconds), fmt::format("{}", limits.bytes)},
             .output = pipe_.ends[1],
             .isQuiet = true}) {
    pipe_.closeInput();
  }

  /// Returns the mesh that the process read. Nothing in its answer is believed, since the mesh file may have corrupted
  /// the process: the answer is read as any PLY file is.
  TriangleMesh mesh() {
    receive();
    const int status = exitStatus();
    const std::string_view answer = answer_;
    if (status != 0) throw died(endText(status));
    if (answer == kOutOfMemory) throw tooLarge();
    if (answer.starts_with(kRefused)) throw Error(printable(answer.substr(kRefused.size())));
    if (answer.empty()) throw died("it gave no answer");
    try {
      return readPly(answer, file_.string(), progress_);
    } catch (const Error& error) {
      throw died("its answer was no mesh: " + error.problem());
    }
  }

 private:
  static Error exceeded(const std::string& most, const char* variable, const std::string& number) {
    return Error(fmt::format("reading it takes more than {}; check or export the file again, or set {} above {}", most,
                             variable, number));
  }

  Error tooLarge() const {
    return exceeded(bytesText(double(limits_.bytes)) + " of memory", kBytesVariable, std::to_string(limits_.bytes));
  }

  static Error died(const std::string& cause) {
    return Error(
        fmt::format("the process that read it came down ({}): the file is damaged, or too much for the library that "
                    "reads it; check or export it again",
                    printable(cause)));
  }

  /// Receives the answer until the process closes its output. The answer takes memory as it arrives, up to the limit.
  void receive() {
    std::array<char, 65536> buffer;
    for (;;) {
      pause();
      pollfd output = {pipe_.ends[0], POLLIN, 0};
      if (poll(&output, 1, kInterruptInterval.count()) <= 0) continue;
      const ssize_t count = read(output.fd, buffer.data(), buffer.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return;
      answer_.append(buffer.data(), std::size_t(count));
      if (answer_.size() > limits_.bytes) throw tooLarge();
    }
  }

  /// Checks for cancellation and the limit of time, and reports progress, whose fraction is unknown.
  void pause() const {
    progress_.throwIfCancelled();
    const double elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
    const std::string seconds = fmt::format("{}", limits_.seconds);
    if (elapsed > limits_.seconds) throw exceeded(seconds + " s", kSecondsVariable, seconds);
    if (elapsed > kSilentSeconds && progress_.report) progress_.report("Reading the mesh", 0);
  }

  int exitStatus() {
    std::optional<int> status;
    for (; !(status = process_.ended()); pause()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return *status;
  }

  const fs::path& file_;
  const ReadingLimits& limits_;
  const Progress& progress_;
  Clock::time_point start_ = Clock::now();
  Pipe pipe_;
  OtherProcess process_;
  std::string answer_;
};

// The following functions run in the separate process that reads a mesh file.

void toStandardOutput(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(STDOUT_FILENO, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) _exit(1);  // the receiving process has ended
    bytes = bytes.subspan(std::size_t(count));
  }
}

void toStandardOutput(std::string_view text) { toStandardOutput(std::as_bytes(std::span(text))); }

/// Ends the process that reads a mesh file as soon as it runs out of memory. If bad_alloc were thrown instead, the
/// importer assimp would catch the exception and report a damaged file, or continue.
void onMemoryOut() {
  toStandardOutput(kOutOfMemory);
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
  prctl(PR_SET_DUMPABLE, 0);  // no core dump; RLIMIT_CORE does not apply to cores piped to a program
#endif
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, std::ceil(seconds) + 1);  // ends the process even if its parent has died
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
  constexpr const char* kLink = "/proc/self/exe";  // remains valid if the program's file is replaced
  return access(kLink, X_OK) == 0 ? fs::path(kLink) : fs::path();
}

ImportedMesh importInSubprocess(const fs::path& program, const fs::path& file, const ReadingLimits& limits,
                                const Progress& progress) {
  const auto refused = [&](const std::string& problem) { return Error(ErrorKind::file, file.string(), problem); };
  try {
    ImportedMesh imported = cleaned(Reading(program, file, limits, progress).mesh());
    imported.mesh.name = file.filename().string();
    return imported;
  } catch (const std::system_error& error) {
    throw refused(fmt::format("no process can be started to read it ({}); close other programs and try again",
                              error.code().message()));
  } catch (const Error& error) {
    throw refused(error.problem());
  }
}

bool asksForReading(std::span<const std::string> words) { return words.size() == 4 && words[0] == kCommand; }

int readForOtherProcess(std::span<const std::string> words) {
  const auto seconds = parseNumber(words[2]);
  const auto bytes = parseNumber(words[3]);
  if (!seconds || !bytes) return 2;
  confine(*seconds, *bytes);
  try {
    const TriangleMesh mesh = readMesh(words[1]);
    writePly(mesh, [](std::span<const std::byte> piece) { toStandardOutput(piece); });
  } catch (const Error& error) {
    toStandardOutput(std::string(kRefused) + (error.subject() == words[1] ? error.problem() : error.what()));
  } catch (const std::bad_alloc&) {  // Eigen calls malloc directly and bypasses `onMemoryOut`
    toStandardOutput(kOutOfMemory);
  } catch (const std::exception& error) {
    toStandardOutput(fmt::format("{}{} (this is a fault of the program)", kRefused, error.what()));
  }
  return 0;
}

}  // namespace hpsdf::app
