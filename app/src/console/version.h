#pragma once

#include <string>

namespace hpsdf::app {

/// "hpsdf 0.1.0"
std::string versionText();

}  // namespace hpsdf::app
