#pragma once

#include <stdexcept>
#include <string>

namespace hpsdf {

/// Bad input: a file, a mesh, an option. The message is one line that says what is wrong, where, and what to do.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Thrown by a long operation whose `Progress` asked it to stop. Nothing has been written.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled") {}
};

}  // namespace hpsdf
