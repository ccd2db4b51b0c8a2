#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds `pick` and `expect`, which read and check numbers of the current field and of the last picture.
void addFigureCommands(Registry& registry);

}  // namespace hpsdf::app
