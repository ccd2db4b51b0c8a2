#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds `report`, which writes a page about one field.
void addReportCommand(Registry& registry);

}  // namespace hpsdf::app
