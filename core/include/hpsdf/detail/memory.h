#pragma once
// How much memory may be taken, before it is.

#include <string>
#include <string_view>

namespace hpsdf {

/// Three quarters of the machine's, or of what control groups (Linux) leave this process, in bytes.
double allowedMemory();

/// In the unit that suits, such as "8.40 MB".
std::string bytesText(double bytes);

/// Throws `Error` where `what` ("a cloth of 1e6 nodes") would take more bytes than `allowedMemory`; `advice` says what
/// to do then.
void requireMemory(const std::string& what, double bytes, std::string_view advice);

}  // namespace hpsdf
