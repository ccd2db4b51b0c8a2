#pragma once

#include <functional>
#include <span>
#include <vector>

#include "explorer/view_state.h"
#include "language/registry.h"

namespace hpsdf::app {

/// Adds all commands of the explorer (show, camera, plane, color, panel, …) except `ui`.
void addExplorerCommands(Registry& registry);

/// A view that answers a common question. The command `preset` shows it.
struct Preset {
  const char* name;
  const char* question;  ///< label of its button
  const char* help;
};
std::span<const Preset> presets();

/// Adds the command `ui`, with which a script sends mouse and keyboard events to the explorer.
void addUiCommand(Registry& registry);

/// Returns the action of a command that changes the explorer's state. The action applies `change` to a copy of the
/// state and then replaces the state by the copy. If `change` throws, the state remains as it was. One `undo` reverts
/// all changes of one action.
std::function<void(Session&, const Arguments&)> changing(void (*change)(ViewState&, const Arguments&, Session&));

/// Adds the commands that choose what the picture shows: show, camera, surface, plane, color, cells, arrows,
/// triangles and beside.
void addExplorerPictureCommands(Registry& registry);

}  // namespace hpsdf::app
