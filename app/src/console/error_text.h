#pragma once

#include <exception>
#include <string>

namespace hpsdf::app {

/// Describes an exception for users. An `Error` has its own message; errors of the file system get the file's name and
/// a remedy, and lack of memory a remedy. Any other exception is called a fault of the program.
std::string errorText(const std::exception& error);

}  // namespace hpsdf::app
