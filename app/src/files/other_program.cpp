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
#include <cstring>
#include <sstream>
#include <thread>

#include "hpsdf/error.h"

extern char** environ;

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

/// Sets the standard streams and the working folder of a new process.
class SpawnActions {
 public:
  SpawnActions(const fs::path& folder, const fs::path& log) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&actions_, STDOUT_FILENO, STDERR_FILENO);
    posix_spawn_file_actions_addchdir_np(&actions_, folder.c_str());
  }
  ~SpawnActions() { posix_spawn_file_actions_destroy(&actions_); }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;

  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_;
};

pid_t start(const fs::path& program, const std::vector<std::string>& arguments, const SpawnActions& actions) {
  std::vector<std::string> words = {program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  pid_t id = 0;
  if (const int error = posix_spawn(&id, program.c_str(), actions.get(), nullptr, pointers.data(), environ); error != 0)
    throw Error(fmt::format("{}: cannot be started ({}); check the program", program.string(), std::strerror(error)));
  return id;
}

}  // namespace

pid_t waitForProcess(pid_t id, int& status, int options) {
  for (;;) {
    const pid_t ended = waitpid(id, &status, options);
    if (ended >= 0 || errno != EINTR) return ended;
  }
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

int runOtherProgram(const fs::path& program, const std::vector<std::string>& arguments, const fs::path& folder,
                    const fs::path& log, const std::function<bool()>& cancelled) {
  const pid_t id = start(program, arguments, SpawnActions(folder, log));
  int status = 0;
  while (waitForProcess(id, status, WNOHANG) == 0) {
    if (cancelled && cancelled()) {
      kill(id, SIGKILL);
      waitForProcess(id, status, 0);
      throw Cancelled();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (cancelled && cancelled()) throw Cancelled();  // Ctrl-C ends the other program too
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

}  // namespace hpsdf::app
