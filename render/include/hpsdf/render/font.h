#pragma once

#include <span>

namespace hpsdf::render {

/// DejaVuSans.ttf of Debian's fonts-dejavu-core, the font of all pictures: built into the library.
std::span<const unsigned char> dejavuSans();

}  // namespace hpsdf::render
