#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds `turntable` and `frames`. The registry must hold `slice` and `render`, whose parameters they take over.
void addMotionCommands(Registry& registry);

}  // namespace hpsdf::app
