#include "text/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

namespace hpsdf::app {

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
