#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the command `mesh`. It shares parameters of `render`, which the registry must contain already.
void addMeshCommand(Registry& registry);

}  // namespace hpsdf::app
