#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds `study`.
void addStudyCommand(Registry& registry);

}  // namespace hpsdf::app
