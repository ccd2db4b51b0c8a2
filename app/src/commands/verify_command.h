#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds verify.
void addVerifyCommand(Registry& registry);

}  // namespace hpsdf::app
