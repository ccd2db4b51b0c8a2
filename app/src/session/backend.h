#pragma once
// The choice of a renderer, and the command options for this choice.

#include <memory>
#include <vector>

#include "hpsdf/render/renderer.h"
#include "language/registry.h"

namespace hpsdf::app {

/// The choice between the CPU renderer and an OpenGL renderer.
struct Backend {
  bool cpu = false;
  render::GlChoice gl = render::GlChoice::automatic;
  bool operator==(const Backend&) const = default;
};

/// Makes a renderer of the field, which must outlive it. A mapped field is drawn on the CPU, unless an OpenGL device is
/// chosen.
std::unique_ptr<render::Renderer> makeRenderer(const Field& field, const Backend& backend);

/// Returns the parameters `cpu` and `gl`, which choose the renderer.
std::vector<Parameter> backendParameters();

/// Returns the OpenGL device that the argument `gl` names.
render::GlChoice glChoice(const Arguments& arguments);

/// Returns the renderer that the arguments choose. Throws `Error` if both `cpu` and `gl` are given.
Backend backend(const Arguments& arguments);

}  // namespace hpsdf::app
