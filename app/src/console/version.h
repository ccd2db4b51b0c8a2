#pragma once

#include <string>

namespace hpsdf::app {

/// Returns name and version of the program: "hpsdf 0.2.0".
inline std::string versionText() { return "hpsdf " HPSDF_VERSION; }

}  // namespace hpsdf::app
