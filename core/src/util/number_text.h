#pragma once

#include <array>
#include <charconv>
#include <string>

namespace hpsdf::detail {

/// Appends the shortest decimal text from which the same number is read back.
template <typename Number>
void appendNumber(std::string& text, Number number) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  text.append(digits.data(), end);
}

}  // namespace hpsdf::detail
