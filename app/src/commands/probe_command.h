#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds probe.
void addProbeCommand(Registry& registry);

}  // namespace hpsdf::app
