#pragma once

#include <memory>
#include <string>

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// The OpenGL devices to try, in the order of docs/rendering.md.
enum class GlChoice : std::uint8_t {
  automatic,  ///< hardware devices, then software devices, surfaceless Mesa, the default display
  software,   ///< a software renderer only: Mesa's llvmpipe, the reference of the pictures
  hardware,   ///< a hardware device only
};

/// Fills the buffers of views of one field. Not thread-safe: use one renderer for each thread.
class Renderer {
 public:
  virtual ~Renderer();

  /// Samples a rectangle. Throws `Error` for a view that is not finite or a size outside 1 to 2^20 pixels per side.
  virtual ViewBuffers slice(const SliceView& view, int width, int height) = 0;

  /// Traces the surface f = offset. Throws `Error` as `slice` does, and for an offset that is not finite.
  virtual ViewBuffers surface(const SurfaceView& view, int width, int height) = 0;

  /// The name of the device, e.g. "llvmpipe (LLVM 15.0.6, 256 bits)" or "CPU, double precision".
  virtual std::string description() const = 0;
};

/// The reference renderer: fills the buffers in double precision, without OpenGL. The field must outlive the
/// renderer.
std::unique_ptr<Renderer> makeCpuRenderer(const Field& field);

/// Renders with OpenGL 4.5 core through EGL, without a window. The field is uploaded once, its coefficients as
/// float. Throws `Error` when no device offers OpenGL 4.5, naming the devices tried, or when the field is too
/// large for the device.
std::unique_ptr<Renderer> makeGlRenderer(const Field& field, GlChoice choice = GlChoice::automatic);

/// The GL_RENDERER string of the device that `choice` selects. Throws as `makeGlRenderer` does.
std::string glDescription(GlChoice choice);

}  // namespace hpsdf::render
