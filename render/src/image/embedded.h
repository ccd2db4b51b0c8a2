#pragma once
// Files that are built into the library, so that no file has to be found at run time.

#include <string_view>

#include "hpsdf/render/font.h"

namespace hpsdf::render {

/// The text of shaders/<name>, unchanged, so that line numbers in compiler messages match the file. `name` must be one
/// of the files in that folder.
std::string_view shaderText(std::string_view name);

}  // namespace hpsdf::render
