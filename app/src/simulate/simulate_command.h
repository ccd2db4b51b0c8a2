#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds simulate.
void addSimulateCommand(Registry& registry);

}  // namespace hpsdf::app
