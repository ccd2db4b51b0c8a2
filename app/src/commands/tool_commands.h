#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the commands run, set, include, mesh, shapes, doctor, help and docs.
void addToolCommands(Registry& registry);

}  // namespace hpsdf::app
