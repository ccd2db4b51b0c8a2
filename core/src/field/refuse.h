#pragma once

#include <sstream>

#include "hpsdf/error.h"

namespace hpsdf::detail {

/// Throws an `Error` whose message is made of these parts.
template <typename... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  std::ostringstream message;
  (message << ... << parts);
  throw Error(message.str());
}

}  // namespace hpsdf::detail
