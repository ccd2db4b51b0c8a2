#pragma once

#include <initializer_list>
#include <string_view>

#include "gl/gl_objects.h"

namespace hpsdf::render {

/// A linked program of the full-screen triangle and the fragment shader made of `fragmentFiles`, one after another, of
/// those in shaders/. Throws `Error` with the compiler's log.
GlProgram fullScreenProgram(std::initializer_list<std::string_view> fragmentFiles);

}  // namespace hpsdf::render
