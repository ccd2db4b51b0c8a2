#pragma once

#include <initializer_list>
#include <string_view>

#include "gl/gl_objects.h"

namespace hpsdf::render {

/// A linked program of a vertex shader and a fragment shader, each of which is the concatenation of files in shaders/.
/// Throws `Error` with the compiler's log.
GlProgram linkedProgram(std::initializer_list<std::string_view> vertexFiles,
                        std::initializer_list<std::string_view> fragmentFiles);

}  // namespace hpsdf::render
