#pragma once
// Files that are built into the library, so that nothing is looked up at run time.

#include <string_view>

#include "hpsdf/render/font.h"

namespace hpsdf::render {

/// The text of shaders/<name>, unchanged, so that line numbers in compiler messages are those of the file. The name
/// must be one of the files there.
std::string_view shaderText(std::string_view name);

}  // namespace hpsdf::render
