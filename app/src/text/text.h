#pragma once
// Formats numbers, names and points for human readers.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "hpsdf/detail/text.h"
#include "hpsdf/types.h"

namespace hpsdf::app {

/// True for an ASCII digit. `isLetter` is true for an ASCII letter or an underscore. Unlike the functions of <cctype>,
/// both functions are independent of the locale.
constexpr bool isDigit(char c) { return c >= '0' && c <= '9'; }
constexpr bool isLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

/// Returns a colour as the text "#rrggbb".
std::string colorText(const std::array<std::uint8_t, 3>& color);

/// Returns a number as text with commas between thousands: 1234567 becomes "1,234,567".
std::string grouped(std::uint64_t number);

/// Returns a count with its noun, in the singular or the plural: "1 face", "1,234 faces".
std::string countOf(std::size_t count, std::string_view one, std::string_view many);

/// Returns a number as text with three significant digits, with an exponent if that is shorter: 1e-6, 3.06e-4, 0.125.
std::string shortNumber(double number);

/// Returns a point as the text "(0.1, 0.2, 0.3)".
std::string vectorText(const Vector3& v);

/// Returns a point of `box` as the text "(0.1, 0.2, 0.3)". Uses extra digits if the box is small compared with its
/// distance from the origin.
std::string vectorText(const Vector3& v, const Box& box);

/// Returns a box as the text "(0, 0, 0) to (1, 2, 3)", with as many digits as `vectorText` uses for points of this box.
std::string boxText(const Box& box);

/// Derives a name for files and commands from the name of a mesh file or a shape: "bunny" from bunny.obj,
/// "torus" from builtin:torus,major=0.7. The derived name consists of letters, digits, '.', '-' and '_'.
std::string plainName(const std::string& source);

/// Returns a word, quoted for a shell if it contains characters that a shell would interpret.
std::string shellWord(const std::string& word);

/// Escapes control characters and bytes that are not UTF-8, such as "\n", "\x1b" and "\xff", so that names and text
/// from untrusted files can neither break a line nor control the terminal. All else stays as it is, backslashes too.
std::string printable(std::string_view text);

/// Formats one indented line of a summary: a label and its value.
std::string summaryRow(std::string_view label, const std::string& value);

}  // namespace hpsdf::app
