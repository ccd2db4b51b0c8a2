#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the command `export`.
void addExportCommand(Registry& registry);

}  // namespace hpsdf::app
