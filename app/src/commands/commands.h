#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// All commands of the program.
Registry makeRegistry();

}  // namespace hpsdf::app
