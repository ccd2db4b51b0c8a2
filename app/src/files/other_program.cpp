#include "files/other_program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <system_error>
#include <thread>

#include "files/text_file.h"
#include "hpsdf/error.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

/// Calls waitpid, and calls it again if a signal has interrupted the call.
pid_t waitForProcess(pid_t id, int& status, int options) {
  for (;;) {
    const pid_t ended = waitpid(id, &status, options);
    if (ended >= 0 || errno != EINTR) return ended;
  }
}

/// Returns the last line of the text that is not empty. Returns "" if there is no such line.
std::string lastLine(const std::string& text) {
  std::istringstream lines(text);
  std::string last;
  for (std::string line; std::getline(lines, line);)
    if (!line.empty()) last = line;
  return last;
}

}  // namespace

OtherProcess::OtherProcess(const ProcessStart& start) {
  std::vector<std::string> words = {start.program.string()};
  words.insert(words.end(), start.arguments.begin(), start.arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, start.output, STDOUT_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  if (start.isQuiet) {
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    sigset_t interrupts;
    sigemptyset(&interrupts);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&interrupts, signal);
    posix_spawnattr_setsigmask(&attributes, &interrupts);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  } else {
    posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  }
  if (!start.folder.empty()) posix_spawn_file_actions_addchdir_np(&actions, start.folder.c_str());
  const int error = posix_spawn(&id_, start.program.c_str(), &actions, &attributes, pointers.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::system_error(error, std::generic_category());
}

OtherProcess::~OtherProcess() {
  if (!running_) return;
  kill(id_, SIGKILL);
  int status = 0;
  waitForProcess(id_, status, 0);
}

std::optional<int> OtherProcess::ended() {
  int status = 0;
  if (waitForProcess(id_, status, WNOHANG) == 0) return std::nullopt;
  running_ = false;
  return status;
}

std::optional<fs::path> findProgram(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path file = fs::path(folder) / name;
    std::error_code missing;
    if (fs::is_regular_file(file, missing) && access(file.c_str(), X_OK) == 0) return fs::absolute(file);
  }
  return std::nullopt;
}

std::string runOtherProgram(const fs::path& program, const std::vector<std::string>& arguments, const fs::path& folder,
                            const std::string& result, const std::function<bool()>& cancelled) {
  const fs::path log = folder / "output.txt";
  std::optional<int> status;
  try {
    const int output = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    OtherProcess process({program, arguments, output, false, folder});
    close(output);
    while (!(status = process.ended())) {
      if (cancelled && cancelled()) throw Cancelled();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  } catch (const std::system_error& error) {
    throw Error(ErrorKind::file, program.string(),
                fmt::format("cannot be started ({}); check the program", error.code().message()));
  }
  if (cancelled && cancelled()) throw Cancelled();  // Ctrl-C may have ended the other program
  if (*status == 0 && fs::exists(folder / result)) return {};
  return fmt::format("{} failed with status {} ({})", program.filename().string(),
                     WIFSIGNALED(*status) ? 128 + WTERMSIG(*status) : WEXITSTATUS(*status),
                     lastLine(readTextFile(log.string())));
}

}  // namespace hpsdf::app
