#pragma once
// The help topic about the colours of pictures.

#include <string>

namespace hpsdf::app {

/// Returns the help text about colours: what they can show, the colours of levels, and the colour maps. If
/// `showsColors` is true, bars of the colours are drawn by escape sequences of 24-bit terminals; otherwise colours are
/// given as
/// "#rrggbb".
std::string colorsHelp(bool showsColors);

}  // namespace hpsdf::app
