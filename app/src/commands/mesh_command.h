#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Returns the command `mesh`. It shares parameters of `render`, which the registry must contain already.
Command meshCommand(const Registry& registry);

}  // namespace hpsdf::app
