#pragma once

#include <string>

namespace hpsdf::app {

/// Returns name and version of the program: "hpsdf 0.2.0".
std::string versionText();

}  // namespace hpsdf::app
