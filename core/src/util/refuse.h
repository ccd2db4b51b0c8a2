#pragma once

#include <sstream>
#include <string>

#include "hpsdf/error.h"

namespace hpsdf::detail {

/// Joins the parts of a message.
template <typename... Parts>
std::string messageOf(const Parts&... parts) {
  std::ostringstream message;
  (message << ... << parts);
  return message.str();
}

/// Throws an `Error` whose message is made of these parts.
template <typename... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  throw Error(messageOf(parts...));
}

/// Throws the `Error` "NAME: problem" about a mesh; a mesh without a name is called "mesh".
template <typename... Parts>
[[noreturn]] void refuseMesh(const std::string& name, const Parts&... parts) {
  throw Error(ErrorKind::mesh, name.empty() ? "mesh" : name, messageOf(parts...));
}

}  // namespace hpsdf::detail
