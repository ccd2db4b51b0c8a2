#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the command `probe`.
void addProbeCommand(Registry& registry);

}  // namespace hpsdf::app
