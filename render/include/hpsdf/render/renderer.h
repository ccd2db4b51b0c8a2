#pragma once

#include <memory>
#include <string>

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Which OpenGL device to take (the ladder of docs/rendering.md).
enum class GlChoice : std::uint8_t {
  automatic,  ///< a hardware device, then a software device, surfaceless Mesa, the default display
  software,   ///< Mesa's llvmpipe: the reference
  hardware,
};

/// Fills the buffers of views of one field. Not thread-safe; one renderer a thread.
class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual ViewBuffers slice(const SliceView& view, int width, int height) = 0;
  virtual ViewBuffers surface(const SurfaceView& view, int width, int height) = 0;
  /// What does the work, e.g. "llvmpipe (LLVM 15.0.6, 256 bits)" or "CPU, double precision".
  virtual std::string description() const = 0;
};

/// The oracle: the same buffers in double precision, without OpenGL. The field must outlive the renderer.
std::unique_ptr<Renderer> makeCpuRenderer(const Field& field);

/// OpenGL 4.5 core through EGL, without a window; the field is uploaded once, its coefficients as float.
/// Throws `Error` when no device serves, saying what was tried, or when the field exceeds the device's buffers.
std::unique_ptr<Renderer> makeGlRenderer(const Field& field, GlChoice choice = GlChoice::automatic);

/// Renderer string of the device that `choice` would take; throws as above.
std::string glDescription(GlChoice choice);

}  // namespace hpsdf::render
