#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds `slice` and `render`.
void addPictureCommands(Registry& registry);

}  // namespace hpsdf::app
