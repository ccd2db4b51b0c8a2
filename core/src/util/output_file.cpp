#include "hpsdf/detail/output_file.h"

#include <signal.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "hpsdf/error.h"
#include "util/number_text.h"

namespace hpsdf {
namespace {

std::string reason(int error) { return std::generic_category().message(error); }

constexpr std::string_view kTemporary = ".part-";  ///< followed in file names by machine, process id and number

/// Returns the common beginning of the names of all temporary files of `file`: the name of `file`, followed by
/// `kTemporary`. A name that is too long for a suffix is replaced by its first characters (whole UTF-8 characters) and
/// a hash of the name.
std::string beginningOfTemporaries(const std::filesystem::path& file) {
  constexpr std::size_t kLongest = 100, kKept = 60;
  std::string name = file.filename();
  if (name.size() > kLongest) {
    const std::uint64_t hash = XXH3_64bits(name.data(), name.size());
    std::size_t kept = kKept;
    while (kept > 0 && (static_cast<unsigned char>(name[kept]) & 0xc0) == 0x80) --kept;
    name.resize(kept);
    name += '~' + std::to_string(hash);
  }
  return name + std::string(kTemporary);
}

/// Returns a hash of this machine's name, and of the container in which process ids are counted, as hexadecimal digits.
/// Several machines may write to one folder.
const std::string& thisMachine() {
  static const std::string hash = [] {
    std::array<char, 256> name{};
    gethostname(name.data(), name.size() - 1);
    std::error_code ignored;
    const std::string machine =
        std::string(name.data()) + std::filesystem::read_symlink("/proc/self/ns/pid", ignored).string();
    return detail::hexText(XXH3_64bits(machine.data(), machine.size())).substr(0, 8);
  }();
  return hash;
}

/// Returns a name for a temporary file in the folder of `file`. The name contains the machine, the process id and a
/// counter, and is therefore not in use by a running process.
std::filesystem::path temporaryBeside(const std::filesystem::path& file) {
  static std::atomic<unsigned> counter = 0;
  std::filesystem::path name = file;
  name.replace_filename(beginningOfTemporaries(file) + thisMachine() + "-" + std::to_string(getpid()) + "-" +
                        std::to_string(counter++));
  return name;
}

/// Returns the file to which `file` leads if `file` is a symbolic link, else `file` itself. That file need not exist.
/// Renaming a temporary file to it keeps the link. Links that lead in a circle give one of these links.
std::filesystem::path resolved(const std::filesystem::path& file) {
  constexpr int kMostLinks = 40;  // as many as the system follows
  std::filesystem::path target = file;
  std::error_code error;
  for (int links = 0; links < kMostLinks && std::filesystem::is_symlink(target, error); ++links) {
    const std::filesystem::path next = std::filesystem::read_symlink(target, error);
    if (error) return file;
    target = target.parent_path() / next;  // equals `next` if `next` begins at the root folder
  }
  return target;
}

/// The names of this process's existing temporary files, which `removeUnfinished` deletes. The array has room for 16
/// names.
std::array<std::atomic<const char*>, 16> unfinished{};
static_assert(std::atomic<const char*>::is_always_lock_free, "a signal handler reads these");

void remember(const char* name) {
  for (auto& slot : unfinished) {
    const char* none = nullptr;
    if (slot.compare_exchange_strong(none, name)) return;
  }
}

void forget(const char* name) {
  for (auto& slot : unfinished) {
    const char* expected = name;
    if (slot.compare_exchange_strong(expected, nullptr)) return;
  }
}

/// Returns true if `name` is the name, without a folder, of a temporary file that this process is writing.
bool isOurs(const std::filesystem::path& name) {
  return std::ranges::any_of(unfinished, [&](const auto& slot) {
    const char* ours = slot.load();
    return ours != nullptr && name == std::filesystem::path(ours).filename();
  });
}

/// The process that wrote a temporary file.
struct Writer {
  std::string machine;
  pid_t process = 0;
};

/// Returns the writer of the temporary file `name`, whose name begins with `beginning`. Returns std::nullopt if it is
/// not the name of such a file.
std::optional<Writer> writerOf(const std::string& name, std::string_view beginning) {
  if (!name.starts_with(beginning)) return std::nullopt;
  const std::size_t dash = name.find('-', beginning.size());
  if (dash == std::string::npos) return std::nullopt;
  Writer writer{.machine = name.substr(beginning.size(), dash - beginning.size())};
  const auto [end, error] = std::from_chars(name.data() + dash + 1, name.data() + name.size(), writer.process);
  if (error != std::errc() || writer.process <= 0 || *end != '-') return std::nullopt;
  return writer;
}

bool isRunning(pid_t process) { return kill(process, 0) == 0 || errno != ESRCH; }

/// Returns true if nobody writes the temporary file any more. Nothing is known of the processes of other machines:
/// their files count as abandoned after a day without a change.
bool isAbandoned(const std::filesystem::path& temporary, const Writer& writer) {
  if (writer.machine == thisMachine()) return writer.process == getpid() || !isRunning(writer.process);
  std::error_code error;
  const auto written = std::filesystem::last_write_time(temporary, error);
  return !error && std::filesystem::file_time_type::clock::now() - written > std::chrono::hours(24);
}

}  // namespace

namespace {

/// Removes the abandoned temporary files of a folder. `beginningOf(name)` returns how the name of a temporary file
/// begins, up to and with `kTemporary`, or "" for a file that is to stay.
template <typename BeginningOf>
void removeAbandonedIn(const std::filesystem::path& folder, const BeginningOf& beginningOf) {
  std::error_code ignored;
  std::vector<std::filesystem::path> abandoned;
  for (std::filesystem::directory_iterator entry(folder, ignored), end; entry != end; entry.increment(ignored)) {
    const std::string name = entry->path().filename(), beginning = beginningOf(name);
    const std::optional<Writer> writer = beginning.empty() ? std::nullopt : writerOf(name, beginning);
    if (writer && !isOurs(name) && isAbandoned(entry->path(), *writer)) abandoned.push_back(entry->path());
  }
  for (const std::filesystem::path& name : abandoned) std::filesystem::remove(name, ignored);
}

}  // namespace

void OutputFile::removeAbandoned(const std::filesystem::path& file) {
  const std::filesystem::path target = resolved(file);
  const std::string beginning = beginningOfTemporaries(target);
  removeAbandonedIn(target.has_parent_path() ? target.parent_path() : ".",
                    [&](const std::string& /*name*/) { return beginning; });
}

void OutputFile::removeAllAbandoned(const std::filesystem::path& folder) {
  removeAbandonedIn(folder, [](const std::string& name) {
    const std::size_t at = name.rfind(kTemporary);
    return at == std::string::npos ? std::string() : name.substr(0, at + kTemporary.size());
  });
}

void OutputFile::removeUnfinished() noexcept {
  for (const auto& slot : unfinished)
    if (const char* name = slot.load()) unlink(name);
}

OutputFile::OutputFile(const std::filesystem::path& file) : file_(resolved(file)) {
  if (file_.empty()) throw Error(ErrorKind::file, "", "the output file's name is empty; give a file name");
  std::error_code error;
  const auto status = std::filesystem::status(file_, error);
  const auto refuse = [&](int why) {
    throw Error(ErrorKind::file, file.string(), "cannot be written (" + reason(why) + "); check the folder");
  };
  // Refuse a file name that is too long. The temporary file has a shorter name and would open, but `commit` would fail.
  if (error == std::errc::filename_too_long) refuse(error.value());
  if (std::filesystem::is_symlink(file_, error)) refuse(ELOOP);
  if (std::filesystem::is_directory(status))
    throw Error(ErrorKind::file, file.string(), "is a folder; give a file name");
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    throw Error(ErrorKind::file, file.string(), "is not a regular file; give another name");
  if (!file_.has_filename()) throw Error(ErrorKind::file, file.string(), "names a folder; give a file name");
  // Try names until the temporary file can be created. A killed process with the same process id may have left a file
  // with one of these names.
  for (int tries = 100; tries > 0; --tries) {
    temporary_ = temporaryBeside(file_);
    remember(temporary_.c_str());  // before the file is there, because a signal may end the process at any time
    stream_ = std::fopen(temporary_.c_str(), "wbx");
    if (stream_ != nullptr) return;
    const int why = errno;
    forget(temporary_.c_str());
    if (why != EEXIST || tries == 1) refuse(why);
  }
}

OutputFile::~OutputFile() {
  if (stream_ == nullptr) return;
  std::fclose(stream_);
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
  forget(temporary_.c_str());
}

void OutputFile::fail() {
  throw Error(ErrorKind::file, file_.string(),
              "writing failed (" + reason(errno) + "); check the space left on the disk");
}

void OutputFile::write(std::span<const std::byte> bytes) {
  if (!bytes.empty() && std::fwrite(bytes.data(), 1, bytes.size(), stream_) != bytes.size()) fail();
}

void OutputFile::write(std::string_view text) { write(std::as_bytes(std::span(text))); }

void OutputFile::flush() {
  if (std::fflush(stream_) != 0 || fsync(fileno(stream_)) != 0) fail();
}

void OutputFile::commit() {
  flush();
  if (std::rename(temporary_.c_str(), file_.c_str()) != 0) fail();
  forget(temporary_.c_str());
  std::fclose(stream_);
  stream_ = nullptr;
}

void checkWritable(const std::filesystem::path& file) { OutputFile trial(file); }

}  // namespace hpsdf
