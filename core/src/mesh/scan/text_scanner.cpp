#include "mesh/scan/text_scanner.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

#include "mesh/scan/word_text.h"

namespace hpsdf::mesh {
namespace {

/// Returns the `double` nearest to a number whose size `double` cannot hold: 0 or the least denormal number, or
/// infinity.
double beyondDouble(std::string_view number) {
  long double value = 0;
  const auto error = std::from_chars(number.data(), number.data() + number.size(), value).ec;
  if (error == std::errc()) return double(value);
  const bool isTiny = number.find("e-") != number.npos || number.find("E-") != number.npos;
  return isTiny ? 0 : std::numeric_limits<double>::infinity();
}

bool isLineEnd(char c) { return c == '\n' || c == '\r'; }
bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

}  // namespace

TextScanner::TextScanner(Input& input, char comment, std::uint64_t line)
    : input_(input), comment_(comment), line_(line) {
  for (const char c : {' ', '\t', '\v', '\f', '\n', '\r', '\0', comment})
    endsWord_[static_cast<unsigned char>(c)] = true;
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  input_.ensure(kByteOrderMark.size());
  for (const std::string_view utf16 : {"\xff\xfe", "\xfe\xff"})
    if (input_.offset() == 0 && input_.rest().starts_with(utf16)) refuse("the text is UTF-16: convert it to UTF-8");
  if (input_.offset() == 0 && input_.rest().starts_with(kByteOrderMark)) input_.skip(kByteOrderMark.size());
}

void TextScanner::skipLineEnd(char c) {
  input_.skip(1);
  ++line_;
  if (c == '\r') take('\n');
}

/// Skips a continuation sign together with the line end, or the file's end, behind it.
bool TextScanner::skipContinuation() {
  const std::string_view rest = input_.rest();
  const std::size_t end = std::min(rest.find_first_not_of(" \t", 1), rest.size());
  if (end < rest.size() ? !isLineEnd(rest[end]) : end > kLongestWord) return false;
  input_.skip(end);
  if (end < rest.size()) skipLineEnd(rest[end]);
  return true;
}

/// Skips blanks and comments of this line. Returns false if nothing is left of the file then.
bool TextScanner::skipBlanks() {
  for (;;) {
    const char c = peek();
    if (input_.rest().empty()) return false;
    if (isBlank(c)) {
      input_.skip(1);
    } else if (c == comment_ && c != '\0') {
      while (!input_.rest().empty() && !isLineEnd(peek())) input_.skip(1);
    } else if (c != continuation_ || c == '\0' || !skipContinuation()) {
      return !input_.rest().empty();
    }
  }
}

bool TextScanner::skipToWord() {
  while (skipBlanks()) {
    const char c = input_.rest().front();
    if (!isLineEnd(c)) return true;
    skipLineEnd(c);
  }
  return false;
}

bool TextScanner::atLineEnd() { return !skipBlanks() || isLineEnd(input_.rest().front()); }

void TextScanner::skipLine() {
  bool isComment = false;
  for (;;) {
    const char c = peek();
    const std::string_view rest = input_.rest();
    if (rest.empty()) return;
    if (isLineEnd(c)) return skipLineEnd(c);
    isComment |= c == comment_ && c != '\0';
    if (c == continuation_ && c != '\0' && !isComment && skipContinuation()) continue;
    std::size_t length = 1;
    while (length < rest.size() && !isLineEnd(rest[length]) && rest[length] != continuation_ &&
           rest[length] != comment_)
      ++length;
    input_.skip(length);
  }
}

std::string_view TextScanner::word() {
  peek();
  const std::string_view rest = input_.rest();
  std::size_t length = std::min<std::size_t>(rest.size(), 1);
  while (length < rest.size() && !endsWord(rest[length])) ++length;
  if (length > kLongestWord) refuse("a word of more than " + std::to_string(kLongestWord) + " characters");
  input_.skip(length);
  return rest.substr(0, length);
}

bool TextScanner::take(char c) {
  if (peek() != c || input_.rest().empty()) return false;
  input_.skip(1);
  return true;
}

double TextScanner::number() {
  peek();
  const std::string_view rest = input_.rest();
  const bool hasPlus = rest.starts_with('+') && !rest.starts_with("+-");
  const char* const begin = rest.data() + (hasPlus ? 1 : 0);
  const char* const end = rest.data() + rest.size();
  double value = 0;
  const auto [stop, error] = std::from_chars(begin, end, value);
  const auto length = std::size_t(stop - rest.data());
  const bool isWhole = stop == end || endsWord(*stop);
  if (error == std::errc::invalid_argument || !isWhole || length > kLongestWord) refuseWord("a number");
  if (error == std::errc::result_out_of_range) value = beyondDouble({begin, stop});
  if (!std::isfinite(value))
    refuse("'" + wordText(word()) + "' is not a finite number (or beyond 1.8e308, where double ends)");
  input_.skip(length);
  return value;
}

/// Throws the error for a word that stands where something else was expected.
void TextScanner::refuseWord(const std::string& expected) {
  if (input_.rest().empty()) refuse("expected " + expected + ", but the file ends");
  if (isLineEnd(input_.rest().front())) refuse("expected " + expected + ", but the line ends");
  refuse("expected " + expected + ", found '" + wordText(word()) + "'");
}

Vector3 TextScanner::vector(std::string_view what) {
  Vector3 v;
  for (double& x : v) {
    if (!toWord()) refuse("the file ends within " + std::string(what));
    x = number();
  }
  return v;
}

std::int64_t TextScanner::wholeNumberBefore(std::string_view what) {
  constexpr std::size_t kMostDigits = std::numeric_limits<std::int64_t>::digits10;
  const char sign = peek();
  const std::string_view rest = input_.rest();
  const auto isDigit = [&](std::size_t at) { return at < rest.size() && rest[at] >= '0' && rest[at] <= '9'; };
  std::size_t begin = sign == '-' || sign == '+' ? 1 : 0;
  while (rest.substr(begin).starts_with('0') && isDigit(begin + 1) && begin < kLongestWord) ++begin;
  std::size_t end = begin;
  std::int64_t value = 0;
  for (; isDigit(end) && end - begin < kMostDigits; ++end) value = 10 * value + (rest[end] - '0');
  if (end == begin || isDigit(end)) refuseWord("a whole number (" + std::string(what) + ")");
  input_.skip(end);
  return sign == '-' ? -value : value;
}

std::int64_t TextScanner::wholeNumber(std::string_view what) {
  if (!toWord()) refuse("the file ends where " + std::string(what) + " should stand");
  const std::int64_t value = wholeNumberBefore(what);
  if (!endsWord())
    refuse("'" + wordText(word()) + "' follows the number " + std::to_string(value) + " (" + std::string(what) + ")");
  return value;
}

void TextScanner::refuse(const std::string& problem) const {
  input_.refuse("line " + std::to_string(line_) + ": " + problem + "; check or export the file again");
}

}  // namespace hpsdf::mesh
