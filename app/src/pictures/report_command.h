#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds report.
void addReportCommand(Registry& registry);

}  // namespace hpsdf::app
