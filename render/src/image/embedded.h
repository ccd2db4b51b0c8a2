#pragma once
// Files that are built into the library, so that the program needs no separate files at run time.

#include <string_view>

#include "hpsdf/render/font.h"

namespace hpsdf::render {

/// The text of the file shaders/<name>, unchanged, so that line numbers in compiler messages match the file.
/// The folder shaders/ must contain a file `name`.
std::string_view shaderText(std::string_view name);

}  // namespace hpsdf::render
