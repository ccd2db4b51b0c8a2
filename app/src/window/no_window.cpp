// Replaces window.cpp in a build without GLFW.

#include "window/window.h"

namespace hpsdf::app {

std::size_t showWindow(Session&, const WindowOptions&) {
  throw Error(
      "view: this program was built without a window: install libglfw3-dev and build it with -D HPSDF_WINDOW=ON; "
      "'shot' in a script writes the same frames without one");
}

}  // namespace hpsdf::app
