#pragma once
// The memory that a process may take, tested before large arrays are made.

#include <string>
#include <string_view>

namespace hpsdf {

/// Three quarters of the machine's memory, or of what control groups (Linux) leave this process, in bytes.
double allowedMemory();

/// A number of bytes in the unit that suits it, such as "8.40 MB".
std::string bytesText(double bytes);

/// Throws `Error` (limit) where `what`, such as "a cloth of 1e6 nodes", would take more bytes than `allowedMemory`. The
/// message ends with `advice`, which says what the user can do.
void requireMemory(const std::string& what, double bytes, std::string_view advice);

}  // namespace hpsdf
