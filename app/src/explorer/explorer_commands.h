#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds all commands of the explorer but `ui`: show, camera, plane, color, panel, ….
void addExplorerCommands(Registry& registry);

}  // namespace hpsdf::app
