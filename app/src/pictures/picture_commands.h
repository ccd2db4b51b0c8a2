#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds `slice` and `render`.
void addPictureCommands(Registry& registry);

/// Adds `turntable` and `frames`. The registry must hold `slice` and `render`, whose parameters they take over.
void addMotionCommands(Registry& registry);

/// Adds `pick` and `expect`, which read and check numbers of the current field and of the last picture.
void addFigureCommands(Registry& registry);

/// Adds `report`, which writes a page about one field.
void addReportCommand(Registry& registry);

}  // namespace hpsdf::app
