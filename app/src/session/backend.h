#pragma once
// Which renderer draws, and the options that choose it.

#include <vector>

#include "hpsdf/render/renderer.h"
#include "language/registry.h"

namespace hpsdf::app {

/// Which renderer draws.
struct Backend {
  bool cpu = false;
  render::GlChoice gl = render::GlChoice::automatic;
  bool operator==(const Backend&) const = default;
};

/// The parameters `cpu` and `gl`.
std::vector<Parameter> backendParameters();

/// The OpenGL device that the argument `gl` names.
render::GlChoice glChoice(const Arguments& arguments);

/// The renderer that the arguments choose. Throws `Error` when `cpu` and `gl` are both given.
Backend backend(const Arguments& arguments);

}  // namespace hpsdf::app
