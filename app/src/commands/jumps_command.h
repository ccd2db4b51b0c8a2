#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the command `jumps`.
void addJumpsCommand(Registry& registry);

}  // namespace hpsdf::app
