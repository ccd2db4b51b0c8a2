#pragma once
// Small helpers for text, which the core library and the program share.

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>

namespace hpsdf {

/// Returns the text without blanks and line ends at its beginning and its end.
inline std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n\v\f";
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

/// Returns the text with the letters A to Z in lower case. Other bytes, such as those of UTF-8 characters, stay
/// unchanged.
inline std::string lowerCase(std::string text) {
  std::ranges::transform(text, text.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
  return text;
}

/// Returns the file's extension in lower case with its dot, such as ".ply", or an empty string if the file has
/// no extension.
inline std::string lowerExtension(const std::filesystem::path& file) { return lowerCase(file.extension().string()); }

/// Returns a text as messages show it: at most 40 bytes, with … behind them if there are more, and ? in the place of
/// control characters. Characters of UTF-8 are not cut.
inline std::string shownText(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::size_t end = std::min(text.size(), kLongest);
  while (end > 0 && end < text.size() && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U) --end;
  std::string shown(text.substr(0, end));
  std::ranges::replace_if(
      shown, [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }, '?');
  return end < text.size() ? shown + "…" : shown;
}

}  // namespace hpsdf
