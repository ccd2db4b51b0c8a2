#pragma once
// Other programs of the machine, run without a shell.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace hpsdf::app {

/// Where PATH has a program of this name.
std::optional<std::filesystem::path> findProgram(const std::string& name);

/// Runs it in `folder` with nothing to read, what it writes going to `log`. The exit status, or 128 + the signal that
/// ended it. Once `cancelled` answers true it is ended, and `Cancelled` thrown. Throws `Error` when it cannot be
/// started.
int runOtherProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                    const std::filesystem::path& folder, const std::filesystem::path& log,
                    const std::function<bool()>& cancelled);

}  // namespace hpsdf::app
