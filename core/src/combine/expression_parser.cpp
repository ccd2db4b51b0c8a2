#include <algorithm>
#include <charconv>
#include <optional>
#include <system_error>

#include "combine/expression_words.h"
#include "hpsdf/combine/expression.h"
#include "hpsdf/detail/nearest_name.h"
#include "hpsdf/detail/text.h"

namespace hpsdf {
namespace combine {
namespace {

constexpr std::size_t kLongestExpression = 1'000'000;  ///< bytes

/// An argument of an operation: a number, a bare word that may name a side or a solid, or another expression.
struct ParsedArgument {
  std::size_t column;
  std::optional<double> number = {};
  std::optional<Expression> expression = {};
  std::string word = {};  ///< empty unless the argument is a bare word
};

class ExpressionParser {
 public:
  explicit ExpressionParser(std::string_view text) : text_(text) {}

  Expression parse() {
    if (text_.size() > kLongestExpression)
      throw Error(ErrorKind::limit, "expression", "it is longer than a million characters");
    const ParsedArgument whole = argument(1);
    if (whole.number) refuse(whole.column, "a number is no solid: expected a file, a shape or an operation");
    skipBlanks();
    if (at_ < text_.size()) refuse(column(), "expected the end of the expression, found " + found());
    return *whole.expression;
  }

 private:
  /// Reads the argument at the current position. `depth` counts the operations around it, itself included.
  ParsedArgument argument(int depth) {
    skipBlanks();
    const std::size_t start = column();
    if (at_ < text_.size() && isQuote(text_[at_])) return {.column = start, .expression = quoted(start)};
    const std::string_view word = text_.substr(at_, wordLength(text_.substr(at_)));
    if (word.empty()) refuse(start, "expected a file, a shape or an operation, found " + found());
    at_ += word.size();
    skipBlanks();
    if (at_ < text_.size() && text_[at_] == '(') return {.column = start, .expression = operation(word, start, depth)};
    if (looksLikeNumber(word)) return {.column = start, .number = number(word, start)};
    return {.column = start, .expression = Expression::named(std::string(word), start), .word = std::string(word)};
  }

  Expression quoted(std::size_t start) {
    const char quote = text_[at_++];
    std::string name;
    while (true) {
      const std::size_t end = text_.find(quote, at_);
      if (end == std::string_view::npos) refuse(start, "the quote is not closed");
      name += text_.substr(at_, end - at_);
      at_ = end + 1;
      if (!skip(quote)) break;
      name += quote;
    }
    if (name.empty()) refuse(start, "a name is missing between the quotes");
    return Expression::named(std::move(name), start);
  }

  static double number(std::string_view word, std::size_t start) {
    double value = 0;
    const std::string_view digits = word.substr(word[0] == '+' ? 1 : 0);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc::result_out_of_range) refuse(start, shownText(word) + " is out of the range of numbers");
    if (error != std::errc() || end != digits.data() + digits.size())
      refuse(start, "'" + shownText(word) + "' is not a number; write a name that looks like one between quotes");
    return value;
  }

  Expression operation(std::string_view name, std::size_t start, int depth) {
    const auto row = std::ranges::find(operations(), name, &OperationDescription::name);
    if (row == operations().end()) refuse(start, unknownOperation(name));
    if (depth >= kMaxExpressionDepth)
      refuse(start, "the expression is deeper than " + std::to_string(kMaxExpressionDepth) + " operations");
    ++at_;  // skip the parenthesis
    std::vector<ParsedArgument> arguments;
    do {
      arguments.push_back(argument(depth + 1));
      skipBlanks();
    } while (skip(','));
    if (!skip(')')) refuse(column(), "expected ',' or ')', found " + found());
    return make(*row, std::move(arguments), start);
  }

  static std::string unknownOperation(std::string_view name) {
    std::vector<std::string> names;
    std::string all;
    for (const OperationDescription& row : operations()) {
      names.emplace_back(row.name);
      all += (all.empty() ? "" : ", ") + names.back();
    }
    return "there is no operation '" + shownText(name) + "'; " + didYouMean(name, names, "there are " + all);
  }

  /// Makes an operation of its arguments: operands, then numbers, then the side of a shell.
  static Expression make(const OperationDescription& row, std::vector<ParsedArgument> arguments, std::size_t start) {
    ShellSide side = ShellSide::centred;
    if (row.operation == Operation::shell && arguments.size() > 2 && !arguments.back().word.empty()) {
      side = sideOf(arguments.back());
      arguments.pop_back();
    }
    std::vector<Expression> operands;
    std::vector<double> numbers;
    for (const ParsedArgument& argument : arguments) {
      if (argument.number) {
        if (operands.empty())
          refuse(argument.column, "expected a solid before the number: " + std::string(row.name) + " is written " +
                                      std::string(row.form));
        numbers.push_back(*argument.number);
      } else {
        if (!numbers.empty())
          refuse(argument.column,
                 "expected a number: " + std::string(row.name) + " is written " + std::string(row.form));
        operands.push_back(*argument.expression);
      }
    }
    try {
      return Expression::operation(row.operation, std::move(operands), std::move(numbers), side);
    } catch (const Error& error) {
      throw expressionError(error.kind(), start, error.what());
    }
  }

  static ShellSide sideOf(const ParsedArgument& argument) {
    const auto name = std::ranges::find(kSideNames, argument.word);
    if (name == kSideNames.end())
      refuse(argument.column, "expected inward, outward or centred, found '" + shownText(argument.word) + "'");
    return static_cast<ShellSide>(name - kSideNames.begin());
  }

  void skipBlanks() {
    while (at_ < text_.size() && isBlank(text_[at_])) ++at_;
  }

  bool skip(char c) {
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  /// Returns the number of the character at the current position, from 1. Bytes that continue a character of UTF-8 do
  /// not count.
  std::size_t column() {
    for (; counted_ < at_; ++counted_)
      if ((static_cast<unsigned char>(text_[counted_]) & 0xc0U) != 0x80U) ++characters_;
    return characters_ + 1;
  }

  std::string found() const {
    if (at_ >= text_.size()) return "the end";
    const std::size_t length = std::max<std::size_t>(1, wordLength(text_.substr(at_)));
    return "'" + shownText(text_.substr(at_, length)) + "'";
  }

  [[noreturn]] static void refuse(std::size_t column, const std::string& problem) {
    throw expressionError(ErrorKind::option, column, problem);
  }

  std::string_view text_;
  std::size_t at_ = 0;                        ///< position of the next byte
  std::size_t counted_ = 0, characters_ = 0;  ///< bytes whose characters are counted, and the characters
};

}  // namespace

}  // namespace combine

Expression parseExpression(std::string_view text) { return combine::ExpressionParser(text).parse(); }

}  // namespace hpsdf
