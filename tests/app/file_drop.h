#pragma once
// Drops a file onto a window of an X11 display, as a file manager does.

#include <string>

namespace hpsdf::app {

/// Drops the file with this absolute path onto the middle of a window. Returns whether the window has taken it.
bool dropFile(const std::string& display, unsigned long window, const std::string& file);

}  // namespace hpsdf::app
