#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds run, set, include, mesh, shapes, doctor, help, docs.
void addToolCommands(Registry& registry);

}  // namespace hpsdf::app
