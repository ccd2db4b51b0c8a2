#pragma once
// OpenGL objects that are deleted when their C++ owner is destroyed. Their context must be current when they
// are created and deleted.

#include <epoxy/gl.h>

#include <initializer_list>
#include <string_view>
#include <utility>

namespace hpsdf::render {

template <typename Kind>
class GlObject {
 public:
  GlObject() { Kind::create(&name_); }
  explicit GlObject(GLuint name) : name_(name) {}
  ~GlObject() {
    if (name_ != 0) Kind::destroy(&name_);
  }
  GlObject(GlObject&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

struct BufferKind {
  static void create(GLuint* name) { glCreateBuffers(1, name); }
  static void destroy(const GLuint* name) { glDeleteBuffers(1, name); }
};

template <GLenum target>
struct TextureKind {
  static void create(GLuint* name) { glCreateTextures(target, 1, name); }
  static void destroy(const GLuint* name) { glDeleteTextures(1, name); }
};

struct FramebufferKind {
  static void create(GLuint* name) { glCreateFramebuffers(1, name); }
  static void destroy(const GLuint* name) { glDeleteFramebuffers(1, name); }
};

struct VertexArrayKind {
  static void create(GLuint* name) { glCreateVertexArrays(1, name); }
  static void destroy(const GLuint* name) { glDeleteVertexArrays(1, name); }
};

struct QueryKind {
  static void create(GLuint* name) { glCreateQueries(GL_ANY_SAMPLES_PASSED, 1, name); }
  static void destroy(const GLuint* name) { glDeleteQueries(1, name); }
};

struct ProgramKind {
  static void create(GLuint* name) { *name = glCreateProgram(); }
  static void destroy(const GLuint* name) { glDeleteProgram(*name); }
};

using GlBuffer = GlObject<BufferKind>;
using GlTexture2D = GlObject<TextureKind<GL_TEXTURE_2D>>;
using GlBufferTexture = GlObject<TextureKind<GL_TEXTURE_BUFFER>>;
using GlFramebuffer = GlObject<FramebufferKind>;
using GlVertexArray = GlObject<VertexArrayKind>;
using GlQuery = GlObject<QueryKind>;
using GlProgram = GlObject<ProgramKind>;

/// Compiles and links a program of a vertex shader and a fragment shader, each concatenated from files in shaders/.
/// Throws `GlError` with the compiler's log.
GlProgram linkedProgram(std::initializer_list<std::string_view> vertexFiles,
                        std::initializer_list<std::string_view> fragmentFiles);

/// Throws `GlError` if OpenGL has reported an error since the last call. `what` completes the sentence "the
/// OpenGL device fails to".
void checkGl(const char* what);

}  // namespace hpsdf::render
