#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds `view`, which opens the explorer in a window.
void addWindowCommand(Registry& registry);

}  // namespace hpsdf::app
