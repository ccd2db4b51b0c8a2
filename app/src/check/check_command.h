#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the commands `check` and `accept`.
void addCheckCommands(Registry& registry);

}  // namespace hpsdf::app
