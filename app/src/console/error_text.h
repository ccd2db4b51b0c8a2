#pragma once

#include <exception>
#include <string>

namespace hpsdf::app {

/// Returns an exception's text for users. The text for an `Error` is its own message. The text for a file system
/// error names the file and a remedy, and the text for lack of memory names a remedy. Any other exception is
/// reported as a fault of the program.
std::string errorText(const std::exception& error);

}  // namespace hpsdf::app
