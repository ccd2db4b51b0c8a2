#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds build, smooth, load, save, info, query.
void addFieldCommands(Registry& registry);

}  // namespace hpsdf::app
