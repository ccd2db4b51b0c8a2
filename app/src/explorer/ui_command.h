#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds `ui`, by which a script uses mouse and keyboard on the explorer.
void addUiCommand(Registry& registry);

}  // namespace hpsdf::app
