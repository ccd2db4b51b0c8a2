#pragma once
// The explorer in a window of the desktop.

#include <optional>
#include <string>

#include "session/backend.h"
#include "session/session.h"

namespace hpsdf::app {

struct WindowOptions {
  std::string opening;             ///< line of script that makes the field
  int width = 1280, height = 720;  ///< of the window, in the desktop's units
  std::string title;
  Backend backend;
  std::optional<std::string> record;  ///< file for the script that does again what was done
  std::optional<std::string> shot;    ///< file for the last frame
};

/// Until the person closes it, or Ctrl-C. Gives the number of lines recorded. Throws `Error` where there is no display,
/// before the field is made, and where this program was built without a window.
std::size_t showWindow(Session& session, const WindowOptions& options);

}  // namespace hpsdf::app
