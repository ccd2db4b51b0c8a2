#pragma once

#include <exception>
#include <string>

namespace hpsdf::app {

/// Describes an exception for users. An `Error` has its own message; errors of the file system get the file's name and
/// a remedy, and lack of memory a remedy. Any other exception is called a fault of the program.
std::string errorText(const std::exception& error);

/// Returns "SUBJECT: MESSAGE", or the message alone where it names the subject already.
std::string withSubject(const std::string& subject, const std::string& message);

}  // namespace hpsdf::app
