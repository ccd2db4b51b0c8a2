#pragma once

#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>

namespace hpsdf::app {

/// Replaces control characters by blanks, so that text from other people's files can neither break a line nor control
/// the terminal.
inline std::string printable(std::string_view text) {
  std::string line;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : '\0');
    const bool isC1Control =
        byte == 0xc2 && next >= 0x80 && next < 0xa0;  // control characters U+0080 to U+009F in UTF-8
    line += std::iscntrl(byte) != 0 || isC1Control ? ' ' : text[i];
    if (isC1Control) ++i;
  }
  return line;
}

}  // namespace hpsdf::app
