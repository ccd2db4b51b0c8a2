#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds `check` and `accept`.
void addCheckCommands(Registry& registry);

}  // namespace hpsdf::app
