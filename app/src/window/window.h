#pragma once
// The explorer in a desktop window.

#include <optional>
#include <string>

#include "language/registry.h"
#include "session/backend.h"
#include "session/session.h"

namespace hpsdf::app {

struct WindowOptions {
  std::string opening;             ///< line of script that loads or builds the field; if empty, there is none at first
  int width = 1280, height = 720;  ///< size of the window, points
  std::optional<double> scale;     ///< pixels per point; if absent, the desktop's scale
  std::string title;
  Backend backend;
  std::optional<std::string> record;  ///< file for the script that repeats the session
  std::optional<std::string> shot;    ///< file for the last frame, *.png
};

/// Shows the window until the user closes it or presses Ctrl-C. It shows the progress while the field is loaded or
/// built; if the user closes it then, or before there is a field, nothing is written. Returns the number of recorded
/// lines. Throws `Error`, before the field is made, if there is no display or if the program was built without GLFW.
std::size_t showWindow(Session& session, const WindowOptions& options);

/// Adds the command `view`, which shows the explorer in a window.
void addWindowCommand(Registry& registry);

}  // namespace hpsdf::app
