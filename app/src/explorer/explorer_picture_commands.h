#pragma once
// The commands that choose what the explorer's picture shows.

#include <functional>

#include "explorer/explorer.h"
#include "language/registry.h"

namespace hpsdf::app {

/// The action of a command that changes a copy of the explorer's state, which then becomes the state. `undo` takes the
/// whole change back; a change that throws leaves the state alone.
std::function<void(Session&, const Arguments&)> changing(void (*change)(ViewState&, const Arguments&, Session&));

/// Adds the commands show, camera, surface, plane, color, cells, arrows and beside.
void addExplorerPictureCommands(Registry& registry);

}  // namespace hpsdf::app
