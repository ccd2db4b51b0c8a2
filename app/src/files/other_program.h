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

/// Calls waitpid, again where a signal interrupts it.
pid_t waitForProcess(pid_t id, int& status, int options);

/// Runs the program in `folder` with an empty standard input; standard output and standard error go to `log`. Returns
/// the exit status, or 128 + the signal that ended it. Throws `Error` where the program cannot be started, and
/// `Cancelled` after ending it once `cancelled` returns true.
int runOtherProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                    const std::filesystem::path& folder, const std::filesystem::path& log,
                    const std::function<bool()>& cancelled);

}  // namespace hpsdf::app
