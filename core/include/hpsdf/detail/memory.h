#pragma once
// The memory that a process may take, tested before large arrays are made.

#include <filesystem>
#include <string>
#include <string_view>

namespace hpsdf {
namespace detail {

/// The bytes that control groups of version 1 and 2 allow this process, infinity without a limit: the least limit of
/// its own group and of the groups above. `root` is the folder that contains proc and sys.
double memoryOfControlGroups(const std::filesystem::path& root = "/");

/// The bytes of the machine's memory, or fewer where control groups limit this process. The first call reads them.
double machineMemory();

}  // namespace detail

/// Three quarters of the machine's memory, or of what control groups (Linux) leave this process, in bytes.
double allowedMemory();

/// Returns a number of bytes as text with a suitable unit, such as "8.40 MB".
std::string bytesText(double bytes);

/// Throws `Error` (limit) where `what`, such as "a cloth of 1e6 nodes", would take more bytes than `allowedMemory`. The
/// message ends with `advice`, which says what the user can do.
void requireMemory(const std::string& what, double bytes, std::string_view advice);

}  // namespace hpsdf
