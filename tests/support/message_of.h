#pragma once

#include <functional>
#include <string>

#include "hpsdf/error.h"

namespace hpsdf::support {

/// Returns the message of the `Error` that work() throws, or "" if it throws none.
inline std::string messageOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace hpsdf::support
