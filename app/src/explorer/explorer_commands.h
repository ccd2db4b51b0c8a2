#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the commands of the explorer: show, camera, plane, color, panel, ….
void addViewCommands(Registry& registry);

}  // namespace hpsdf::app
