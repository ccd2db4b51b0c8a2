#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds turntable and frames, whose parameters are those of slice and render: after these.
void addMotionCommands(Registry& registry);

}  // namespace hpsdf::app
