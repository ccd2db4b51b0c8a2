#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "hpsdf/error.h"
#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// The OpenGL devices to try; docs/rendering.md states their order.
enum class GlChoice : std::uint8_t {
  automatic,  ///< hardware devices, then software devices, then surfaceless Mesa, then the default display
  software,   ///< a software renderer only, such as Mesa's llvmpipe
  hardware,   ///< a hardware device only
};

/// Thrown if OpenGL cannot draw, because there is no device or the device lacks something. A renderer that works on the
/// CPU draws the same picture without OpenGL.
class GlError : public Error {
 public:
  /// `problem` tells what is wrong and how OpenGL may be made to draw.
  explicit GlError(const std::string& problem) : Error(problem + ", or render on the CPU"), problem_(problem) {}

  /// Returns the message with the advice to render by `means`, such as "with --cpu".
  std::string advising(const std::string& means) const { return problem_ + ", or render " + means; }

 private:
  std::string problem_;
};

/// Renders views of one field into buffers. Not thread-safe: use one renderer for each thread.
class Renderer {
 public:
  virtual ~Renderer();

  /// Samples the field in a rectangle, one sample per pixel. Throws `Error` if the view is not finite or if
  /// the size is outside 1 to 2^20 pixels per side.
  virtual ViewBuffers slice(const SliceView& view, int width, int height) = 0;

  /// Traces the rays of a camera to the surface f = offset. Throws `Error` as `slice` does, and if the offset
  /// is not finite.
  ViewBuffers surface(const SurfaceView& view, int width, int height) { return surface(view, width, height, {}); }

  /// Traces the rays of those pixels for which `chosen`, in rows from top to bottom, is not 0; of all pixels if it is
  /// empty. The other pixels show nothing. Throws `Error` as above, and if `chosen` has another size than the view.
  virtual ViewBuffers surface(const SurfaceView& view, int width, int height, std::span<const std::uint8_t> chosen) = 0;

  /// The name of the device, e.g. "llvmpipe (LLVM 15.0.6, 256 bits)" or "CPU, double precision".
  virtual std::string description() const = 0;
};

/// The reference renderer: fills the buffers in double precision, without OpenGL. The field must outlive the
/// renderer.
std::unique_ptr<Renderer> makeCpuRenderer(const Field& field);

/// Makes a renderer that uses OpenGL 4.5 core through EGL, without a window. The field is uploaded once,
/// with its coefficients as float. Throws `GlError`, which names the devices tried, if no device offers
/// OpenGL 4.5. Throws `GlError` if the field is too large for the device.
std::unique_ptr<Renderer> makeGlRenderer(const Field& field, GlChoice choice = GlChoice::automatic);

/// The GL_RENDERER string of the device that `choice` selects. Throws as `makeGlRenderer` does.
std::string glDescription(GlChoice choice);

}  // namespace hpsdf::render
