#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds pick and expect.
void addFigureCommands(Registry& registry);

}  // namespace hpsdf::app
