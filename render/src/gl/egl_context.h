#pragma once

#include <memory>
#include <string>

#include "hpsdf/render/renderer.h"

namespace hpsdf::render {

/// An OpenGL 4.5 core context without a surface, on the first device of the ladder that serves.
class EglContext {
 public:
  /// Throws `Error` that says what was tried and why each failed.
  explicit EglContext(GlChoice choice);
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// GL_RENDERER.
  const std::string& renderer() const { return renderer_; }

  /// Makes the context current on this thread and, at its end, whatever was current before.
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
  void* display_ = nullptr;
  void* context_ = nullptr;
  std::string renderer_;
};

}  // namespace hpsdf::render
