#pragma once

#include <exception>
#include <string>

namespace hpsdf::app {

/// What went wrong, in words for people: an `Error` speaks for itself; of a file that was removed or cannot be written
/// while it is in use, which; that there is not enough memory; and that all else is a fault of the program.
std::string errorText(const std::exception& error);

}  // namespace hpsdf::app
