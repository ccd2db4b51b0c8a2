#pragma once

#include <algorithm>
#include <cctype>
#include <string>

namespace hpsdf::app {

/// As part of one line, on any terminal: what a stranger's file holds may be meant to move the cursor or to clear it.
inline std::string printable(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  return text;
}

}  // namespace hpsdf::app
