#pragma once

#include <exception>
#include <string>

namespace hpsdf::app {

/// Describes an exception for users. An `Error` has its own message. An error of the file system gets the file's
/// name and a remedy, lack of memory gets a remedy. Any other exception is reported as a fault of the program.
std::string errorText(const std::exception& error);

}  // namespace hpsdf::app
