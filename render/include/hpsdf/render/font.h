#pragma once
// The font of all pictures.

#include <span>

namespace hpsdf::render {

/// The bytes of DejaVuSans.ttf (Debian's fonts-dejavu-core), which is built into the library.
std::span<const unsigned char> dejavuSans();

}  // namespace hpsdf::render
