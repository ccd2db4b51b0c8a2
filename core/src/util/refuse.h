#pragma once

#include <sstream>
#include <string>

#include "hpsdf/error.h"

namespace hpsdf::detail {

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

/// Throws an `Error` about options, whose message is made of these parts and names the options.
template <typename... Parts>
[[noreturn]] void refuseOptions(const Parts&... parts) {
  throw Error(ErrorKind::option, "", messageOf(parts...));
}

/// Throws an `Error` about a mesh with the message "NAME: problem". NAME is the mesh's name, or "mesh" for
/// a mesh without a name.
template <typename... Parts>
[[noreturn]] void refuseMesh(const std::string& name, const Parts&... parts) {
  throw Error(ErrorKind::mesh, name.empty() ? "mesh" : name, messageOf(parts...));
}

}  // namespace hpsdf::detail
