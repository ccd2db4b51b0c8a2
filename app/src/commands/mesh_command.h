#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// What is wrong with a mesh, where, and how its inside is told. Takes parameters of `render`, which is there already.
Command meshCommand(const Registry& registry);

}  // namespace hpsdf::app
