#include "text/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <utility>

namespace hpsdf::app {
namespace {

constexpr std::pair<char, const char*> kNamedControls[] = {{'\n', "\\n"}, {'\r', "\\r"}, {'\t', "\\t"}};

/// Returns the number of bytes of the character with which `text` begins, or 0 if `text` does not begin with valid
/// UTF-8 (The Unicode Standard, table 3-7).
std::size_t utf8Length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  if (first < 0xc2 || first > 0xf4) return 0;
  const std::size_t length = first < 0xe0 ? 2 : first < 0xf0 ? 3 : 4;
  const unsigned least = first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
  const unsigned greatest = first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
  if (byte(1) < least || byte(1) > greatest) return 0;
  for (std::size_t i = 2; i < length; ++i)
    if (byte(i) < 0x80 || byte(i) > 0xbf) return 0;
  return length;
}

}  // namespace

std::string vectorText(const Vector3& v) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x(), v.y(), v.z()); }

std::string vectorText(const Vector3& v, const Box& box) {
  const double largest = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  const double size = box.sizes().maxCoeff();
  const int extraDigits = size > 0 && largest > size ? int(std::log10(largest / size)) : 0;
  return fmt::format("({1:.{0}g}, {2:.{0}g}, {3:.{0}g})", std::min(6 + extraDigits, 17), v.x(), v.y(), v.z());
}

std::string colorText(const std::array<std::uint8_t, 3>& color) {
  return fmt::format("#{:02x}{:02x}{:02x}", color[0], color[1], color[2]);
}

std::string summaryRow(std::string_view label, const std::string& value) {
  return fmt::format("  {:<22} {}\n", label, value);
}

std::string grouped(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t i = text.size(); i > 3;) text.insert(i -= 3, ",");
  return text;
}

std::string countOf(std::size_t count, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", grouped(count), count == 1 ? one : many);
}

std::string shortNumber(double number) {
  if (!std::isfinite(number)) return fmt::format("{}", number);  // fields of other programs may hold infinities or NaN
  const double size = std::abs(number);
  if (number == 0 || (size >= 0.01 && size < 1e5)) return fmt::format("{:.3g}", number);
  std::string mantissa = fmt::format("{:.2e}", number);
  const std::size_t e = mantissa.find('e');
  const int exponent = std::stoi(mantissa.substr(e + 1));
  mantissa.erase(mantissa.find_last_not_of("0", e - 1) + 1);
  if (mantissa.ends_with('.')) mantissa.pop_back();
  return fmt::format("{}e{}", mantissa, exponent);
}

std::string shellWord(const std::string& word) {
  const bool needsNoQuotes = std::ranges::all_of(word, [](unsigned char c) {
    return std::isalnum(c) || std::string_view("._-/:,=+").find(char(c)) != std::string::npos;
  });
  if (needsNoQuotes && !word.empty()) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string printable(std::string_view text) {
  std::string line;
  while (!text.empty()) {
    const std::size_t length = utf8Length(text);
    const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
    const auto first = static_cast<unsigned char>(text[0]);
    if (length == 2 && first == 0xc2 && static_cast<unsigned char>(text[1]) < 0xa0)  // control characters after ASCII
      line += fmt::format("\\u{:04x}", static_cast<unsigned char>(text[1]));
    else if (const auto* named = std::ranges::find(kNamedControls, text[0], &std::pair<char, const char*>::first);
             named != std::end(kNamedControls))
      line += named->second;
    else if (length == 0 || std::iscntrl(first) != 0)
      line += fmt::format("\\x{:02x}", first);
    else
      line += character;
    text.remove_prefix(character.size());
  }
  return line;
}

std::string plainName(const std::string& source) {
  const bool isShape = source.starts_with("builtin:") || source.starts_with("analytic:");
  std::string name = isShape ? source.substr(source.find(':') + 1) : std::filesystem::path(source).stem().string();
  name = name.substr(0, name.find(','));
  std::ranges::replace_if(
      name, [](unsigned char c) { return !(std::isalnum(c) || c == '.' || c == '-' || c == '_'); }, '_');
  return name.empty() ? "field" : name;
}

std::string boxText(const Box& box) { return vectorText(box.min(), box) + " to " + vectorText(box.max(), box); }

}  // namespace hpsdf::app
