#pragma once

#include <algorithm>
#include <string>
#include <string_view>

namespace hpsdf::mesh {

/// Returns a word of a file for a message: its beginning if it is long, with control characters and characters beyond
/// ASCII shown as question marks.
inline std::string wordText(std::string_view word) {
  constexpr std::size_t kLongest = 40;
  std::string text(word.substr(0, kLongest));
  std::ranges::replace_if(
      text, [](char c) { return c < ' ' || c > '~'; }, '?');
  return text + (word.size() > kLongest ? "…" : "");
}

}  // namespace hpsdf::mesh
