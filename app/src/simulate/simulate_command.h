#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the command `simulate`, which runs the scenes of the paper.
void addSimulateCommand(Registry& registry);

}  // namespace hpsdf::app
