#pragma once

#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>

namespace hpsdf::app {

/// As part of one line, on any terminal: what a stranger's file holds may be meant to move the cursor or to clear it.
inline std::string printable(std::string_view text) {
  std::string line;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : '\0');
    const bool isSecondSet = byte == 0xc2 && next >= 0x80 && next < 0xa0;  // U+0080 to U+009F in UTF-8
    line += std::iscntrl(byte) != 0 || isSecondSet ? ' ' : text[i];
    if (isSecondSet) ++i;
  }
  return line;
}

}  // namespace hpsdf::app
