#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the commands build, smooth, blend, bounds, info, query, load and save.
void addFieldCommands(Registry& registry);

}  // namespace hpsdf::app
