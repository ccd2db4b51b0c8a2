#include "gl/gl_objects.h"

#include <algorithm>
#include <string>

#include "hpsdf/render/renderer.h"
#include "image/embedded.h"

namespace hpsdf::render {
namespace {

struct ShaderKind {
  static void create(GLuint*) {}  // empty, because glCreateShader also needs the shader stage
  static void destroy(const GLuint* name) { glDeleteShader(*name); }
};
using GlShader = GlObject<ShaderKind>;

std::string names(std::initializer_list<std::string_view> files) {
  std::string result;
  for (const std::string_view file : files) result += (result.empty() ? "" : ", ") + std::string(file);
  return result;
}

/// Throws `Error` unless `ok`. The message starts with `what` and contains the log of the shader compiler.
template <typename GetLog>
void checkLog(GLint ok, const std::string& what, const GetLog& getLog, GLuint name) {
  if (ok) return;
  std::string log(4096, '\0');
  GLsizei length = 0;
  getLog(name, static_cast<GLsizei>(log.size()), &length, log.data());
  log.resize(length);
  std::replace(log.begin(), log.end(), '\n', ' ');
  throw GlError(what + ": " + log + "; update the graphics driver");
}

GlShader compile(GLenum stage, std::initializer_list<std::string_view> files) {
  std::string text = "#version 450 core\n";
  int number = 1;
  // Give each file a number, in the order of the list. The compiler's messages name lines as NUMBER:LINE.
  for (const std::string_view file : files) {
    text += "#line 1 " + std::to_string(number++) + "\n";
    text += shaderText(file);
  }
  GlShader shader(glCreateShader(stage));
  const char* source = text.c_str();
  glShaderSource(shader.name(), 1, &source, nullptr);
  glCompileShader(shader.name());
  GLint ok = GL_FALSE;
  glGetShaderiv(shader.name(), GL_COMPILE_STATUS, &ok);
  checkLog(ok, "the OpenGL driver does not compile the shader " + names(files), glGetShaderInfoLog, shader.name());
  return shader;
}

}  // namespace

GlProgram linkedProgram(std::initializer_list<std::string_view> vertexFiles,
                        std::initializer_list<std::string_view> fragmentFiles) {
  const GlShader vertex = compile(GL_VERTEX_SHADER, vertexFiles);
  const GlShader fragment = compile(GL_FRAGMENT_SHADER, fragmentFiles);
  GlProgram program;
  glAttachShader(program.name(), vertex.name());
  glAttachShader(program.name(), fragment.name());
  glLinkProgram(program.name());
  glDetachShader(program.name(), vertex.name());
  glDetachShader(program.name(), fragment.name());
  GLint ok = GL_FALSE;
  glGetProgramiv(program.name(), GL_LINK_STATUS, &ok);
  checkLog(ok, "the OpenGL driver does not link the shader " + names(fragmentFiles), glGetProgramInfoLog,
           program.name());
  return program;
}

void checkGl(const char* what) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  throw GlError(std::string("the OpenGL device fails to ") + what + " (error " + std::to_string(error) +
                "): render a smaller picture");
}

}  // namespace hpsdf::render
