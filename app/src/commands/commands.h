#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Returns the registry of all commands of the program.
Registry makeRegistry();

}  // namespace hpsdf::app
