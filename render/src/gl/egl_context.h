#pragma once

#include <memory>
#include <string>

#include "hpsdf/error.h"
#include "hpsdf/render/renderer.h"

namespace hpsdf::render {

/// An OpenGL 4.5 core context without a window surface. It is created on the first device of the `GlChoice`
/// that offers such a context.
class EglContext {
 public:
  /// Throws `Error` if no device works. The message names the devices tried and why each failed.
  explicit EglContext(GlChoice choice);
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// The GL_RENDERER string of the device.
  const std::string& renderer() const { return renderer_; }

  /// Makes the context current on this thread for the lifetime of this object. The destructor restores the
  /// context that was current before.
  class Current {
   public:
    explicit Current(const EglContext& context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    struct Before;
    std::unique_ptr<const Before> before_;
  };

 private:
  /// Creates the context on a display. Throws `Error` with the reason if the display cannot provide what `choice`
  /// asks for.
  void open(void* display, GlChoice choice);

  void* display_ = nullptr;
  void* context_ = nullptr;
  int process_ = 0;  ///< a forked process cannot use the threads of the driver
  std::string renderer_;
};

/// Deletes OpenGL objects of a context. If the context is current on another thread, the objects remain until
/// the context is destroyed.
template <typename Objects>
void deleteObjects(const EglContext& context, std::unique_ptr<Objects>& objects) {
  try {
    const EglContext::Current current(context);
    objects.reset();
  } catch (const Error&) {
    static_cast<void>(objects.release());
  }
}

}  // namespace hpsdf::render
