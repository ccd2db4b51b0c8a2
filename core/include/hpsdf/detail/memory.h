#pragma once
// The memory that a process may take. Functions test this limit before they make large arrays.

#include <filesystem>
#include <string>
#include <string_view>

namespace hpsdf {
namespace detail {

/// Returns the memory limit in bytes that Linux control groups (cgroups, versions 1 and 2) set for this process: the
/// lowest limit of its own group and of the groups above it, or infinity without a limit. `root` is the folder that
/// contains proc and sys.
double memoryOfControlGroups(const std::filesystem::path& root = "/");

/// Returns the greatest number of bytes of this process's address space (`ulimit -v`), or infinity without a limit.
double addressLimit();

/// Returns the size of the machine's memory in bytes or, if it is lower, the limit that Linux control groups set for
/// this process. The size is determined at the first call.
double machineMemory();

}  // namespace detail

/// Returns the bytes that this process may take: three quarters of the machine's memory or, if it is lower, of the
/// limit that Linux control groups or the limit of the address space (`ulimit -v`) set.
double allowedMemory();

/// Returns a number of bytes as text with a suitable unit, such as "8.40 MB".
std::string bytesText(double bytes);

/// Throws `Error` (of the kind `limit`) if `bytes` exceeds `allowedMemory`. The message begins with `what`, the name of
/// the thing that needs the bytes ("a cloth of 1e6 nodes"), and ends with `advice`, which tells the user what to do.
void requireMemory(const std::string& what, double bytes, std::string_view advice);

}  // namespace hpsdf
