#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds view.
void addViewCommand(Registry& registry);

}  // namespace hpsdf::app
