#pragma once
// Runs other programs without a shell.

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace hpsdf::app {

/// Searches PATH for an executable file of this name. Returns std::nullopt if there is none.
std::optional<std::filesystem::path> findProgram(const std::string& name);

/// Describes how to start a process. The standard input of the process is empty.
struct ProcessStart {
  std::filesystem::path program;
  std::vector<std::string> arguments;
  int output = -1;                    ///< file descriptor of its standard output
  bool isQuiet = false;               ///< discards stderr and blocks Ctrl-C; if false, stderr goes to `output` too
  std::filesystem::path folder = {};  ///< working directory; empty for the one of this process
};

/// A process that runs another program. The destructor kills the process if it is still running.
class OtherProcess {
 public:
  /// Starts the process. Throws std::system_error if the process cannot be started.
  explicit OtherProcess(const ProcessStart& start);
  ~OtherProcess();
  OtherProcess(const OtherProcess&) = delete;
  OtherProcess& operator=(const OtherProcess&) = delete;

  /// Returns the exit status of the process as waitpid reports it. Returns std::nullopt while the process is
  /// running.
  std::optional<int> ended();

 private:
  pid_t id_ = 0;
  bool running_ = true;
};

/// Runs the program in `folder`. The program must write the file `result` there. Returns "" on success, and
/// otherwise a message such as "gnuplot failed with status 1 (the last line that it wrote)". Throws `Error` if
/// the program cannot be started. If `cancelled` returns true, ends the program and throws `Cancelled`.
std::string runOtherProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                            const std::filesystem::path& folder, const std::string& result,
                            const std::function<bool()>& cancelled);

}  // namespace hpsdf::app
