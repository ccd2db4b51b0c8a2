#pragma once

#include <string>

#include "hpsdf/error.h"

namespace hpsdf::mesh {

/// The error "NAME: problem" about a mesh; a mesh without a name is called "mesh".
inline Error meshError(const std::string& name, const std::string& problem) {
  return {ErrorKind::mesh, name.empty() ? "mesh" : name, problem};
}

}  // namespace hpsdf::mesh
