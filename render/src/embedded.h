#pragma once
// Files that are built into the library, so that nothing is looked up at run time.

#include <span>
#include <string_view>

namespace hpsdf::render {

/// DejaVuSans.ttf of Debian's fonts-dejavu-core.
std::span<const unsigned char> dejavuSans();

/// The text of shaders/<name>, unchanged, so that line numbers in compiler messages are those of the file. The name
/// must be one of the files there.
std::string_view shaderText(std::string_view name);

}  // namespace hpsdf::render
