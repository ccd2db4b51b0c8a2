#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds jumps.
void addJumpsCommand(Registry& registry);

}  // namespace hpsdf::app
