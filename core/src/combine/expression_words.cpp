#include "combine/expression_words.h"

namespace hpsdf::combine {
namespace {

bool endsWord(char c) { return isBlank(c) || isQuote(c) || c == ',' || c == '(' || c == ')'; }
bool isParameterLetter(char c) { return (c >= 'a' && c <= 'z') || c == '-'; }

/// Returns the length of the text ",name=" at the beginning of `text`, or 0 if it begins otherwise.
std::size_t parameterStart(std::string_view text) {
  std::size_t end = 1;
  if (text.empty() || text[0] != ',') return 0;
  while (end < text.size() && isParameterLetter(text[end])) ++end;
  return end > 1 && end < text.size() && text[end] == '=' ? end + 1 : 0;
}

}  // namespace

bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
bool isQuote(char c) { return c == '"' || c == '\''; }

bool isShapeName(std::string_view name) { return name.starts_with("builtin:") || name.starts_with("analytic:"); }

bool looksLikeNumber(std::string_view word) {
  const std::size_t digit = word.find_first_not_of("+-.");
  return digit != std::string_view::npos && word[digit] >= '0' && word[digit] <= '9' &&
         word.find_first_not_of("0123456789+-.eE") == std::string_view::npos;
}

std::size_t wordLength(std::string_view text) {
  std::size_t end = 0;
  const auto skipLetters = [&] {
    while (end < text.size() && !endsWord(text[end])) ++end;
  };
  skipLetters();
  if (!isShapeName(text.substr(0, end))) return end;
  while (const std::size_t start = parameterStart(text.substr(end))) {
    end += start;
    skipLetters();
  }
  return end;
}

bool readsAsName(std::string_view name) {
  return !name.empty() && wordLength(name) == name.size() && !looksLikeNumber(name);
}

Error expressionError(ErrorKind kind, std::size_t column, const std::string& problem) {
  return {kind, "expression", "column " + std::to_string(column) + ": " + problem};
}

}  // namespace hpsdf::combine
