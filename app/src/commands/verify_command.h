#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the command `verify`.
void addVerifyCommand(Registry& registry);

}  // namespace hpsdf::app
