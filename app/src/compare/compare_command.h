#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the command `compare`. The registry must already hold `slice` and `render`, because `compare` takes over some
/// of their parameters.
void addCompareCommand(Registry& registry);

}  // namespace hpsdf::app
