#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the command `index`.
void addIndexCommand(Registry& registry);

}  // namespace hpsdf::app
