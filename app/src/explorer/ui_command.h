#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds ui.
void addUiCommand(Registry& registry);

}  // namespace hpsdf::app
