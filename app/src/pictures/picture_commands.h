#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Adds the commands `slice` and `render`.
void addPictureCommands(Registry& registry);

/// Adds the commands `turntable` and `frames`. They take over parameters of `slice` and `render`, so the
/// registry must already hold `slice` and `render`.
void addMotionCommands(Registry& registry);

/// Adds the commands `pick` and `expect`, which read and check numbers of the current field and of the last picture.
void addFigureCommands(Registry& registry);

/// Adds the command `report`, which writes a page about one field.
void addPageCommand(Registry& registry);
void addReportCommand(Registry& registry);

}  // namespace hpsdf::app
