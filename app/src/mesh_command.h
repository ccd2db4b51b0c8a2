#pragma once

#include "registry.h"

namespace hpsdf::app {

/// What was found in a mesh, where it meets itself, and how its inside is told.
Command meshCommand();

}  // namespace hpsdf::app
