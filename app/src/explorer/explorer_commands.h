#pragma once

#include <functional>
#include <vector>

#include "explorer/view_state.h"
#include "language/registry.h"

namespace hpsdf::app {

/// Adds all commands of the explorer except `ui`: show, camera, plane, color, panel, ….
void addExplorerCommands(Registry& registry);

/// Adds `ui`, by which a script uses mouse and keyboard on the explorer.
void addUiCommand(Registry& registry);

/// Returns the action of a command: it changes a copy of the explorer's state, which then replaces the state.
/// `undo` reverts the whole change. If the change throws, the state stays as it was.
std::function<void(Session&, const Arguments&)> changing(void (*change)(ViewState&, const Arguments&, Session&));

/// Adds the commands that choose what the picture shows: show, camera, surface, plane, color, cells, arrows and beside.
void addExplorerPictureCommands(Registry& registry);

}  // namespace hpsdf::app
