#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds export.
void addExportCommand(Registry& registry);

}  // namespace hpsdf::app
