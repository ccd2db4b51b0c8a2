#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds `simulate`, which runs the scenes of the paper.
void addSimulateCommand(Registry& registry);

}  // namespace hpsdf::app
