#pragma once
// Runs other programs without a shell.

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace hpsdf::app {

/// Searches PATH for an executable file of this name.
std::optional<std::filesystem::path> findProgram(const std::string& name);

/// How a process is started. Its standard input is empty.
struct ProcessStart {
  std::filesystem::path program;
  std::vector<std::string> arguments;
  int output = -1;                    ///< file descriptor of its standard output
  bool isQuiet = false;               ///< drops its standard error, else part of the output, and keeps Ctrl-C from it
  std::filesystem::path folder = {};  ///< in which it runs; empty for that of this process
};

/// A process of another program. The destructor kills it if it still runs.
class OtherProcess {
 public:
  /// Throws std::system_error where the process cannot be started.
  explicit OtherProcess(const ProcessStart& start);
  ~OtherProcess();
  OtherProcess(const OtherProcess&) = delete;
  OtherProcess& operator=(const OtherProcess&) = delete;

  /// Returns the status that waitpid tells; nothing while the process runs.
  std::optional<int> ended();

 private:
  pid_t id_ = 0;
  bool running_ = true;
};

/// Runs the program in `folder`, where it is to write the file `result`. Returns "" or what went wrong: "gnuplot failed
/// with status 1 (the last line that it wrote)". Throws `Error` where the program cannot be started, and `Cancelled`
/// after ending it once `cancelled` returns true.
std::string runOtherProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                            const std::filesystem::path& folder, const std::string& result,
                            const std::function<bool()>& cancelled);

}  // namespace hpsdf::app
