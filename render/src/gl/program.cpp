#include "gl/program.h"

#include <algorithm>
#include <string>

#include "hpsdf/error.h"
#include "image/embedded.h"

namespace hpsdf::render {
namespace {

struct ShaderKind {
  static GLuint create() { return 0; }
  static void destroy(GLuint name) { glDeleteShader(name); }
};
using GlShader = GlObject<ShaderKind>;

std::string names(std::initializer_list<std::string_view> files) {
  std::string result;
  for (const std::string_view file : files) result += (result.empty() ? "" : ", ") + std::string(file);
  return result;
}

[[noreturn]] void fail(const std::string& what, std::string log) {
  std::replace(log.begin(), log.end(), '\n', ' ');
  throw Error(what + ": " + log + "; update the graphics driver, or render with --cpu");
}

GlShader compile(GLenum stage, std::initializer_list<std::string_view> files) {
  std::string text = "#version 450 core\n";
  int number = 1;
  // messages name the line of a file as NUMBER:LINE, the files counted in the order given
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
  if (!ok) {
    std::string log(4096, '\0');
    GLsizei length = 0;
    glGetShaderInfoLog(shader.name(), static_cast<GLsizei>(log.size()), &length, log.data());
    log.resize(length);
    fail("the OpenGL driver does not compile the shader " + names(files), log);
  }
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
  if (!ok) {
    std::string log(4096, '\0');
    GLsizei length = 0;
    glGetProgramInfoLog(program.name(), static_cast<GLsizei>(log.size()), &length, log.data());
    log.resize(length);
    fail("the OpenGL driver does not link the shader " + names(fragmentFiles), log);
  }
  return program;
}

}  // namespace hpsdf::render
