#include "language/expectation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "hpsdf/detail/nearest_name.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"
#include "language/registry.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

struct DataSource {
  std::string_view name;
  std::string_view arguments;  ///< accepted arguments, as a user writes them
  std::size_t count;
};
constexpr DataSource kSources[] = {
    {"stats", "", 0}, {"jumps", "", 0}, {"pick", "(x,y)", 2}, {"at", "(x,y,z)", 3}, {"why", "(x,y,z)", 3}};

/// Parses the text of an expectation, such as "stats.leaves < 60000", from left to right.
class Reader {
 public:
  explicit Reader(std::string_view text) : text_(text) {}

  bool atEnd() {
    skipBlanks();
    return position_ == text_.size();
  }

  bool take(std::string_view word) {
    skipBlanks();
    if (!text_.substr(position_).starts_with(word)) return false;
    position_ += word.size();
    return true;
  }

  /// Reads a name of letters, digits, _ and - at the present position of the text. The name may be empty.
  std::string name() {
    skipBlanks();
    const std::size_t begin = position_;
    const auto isInName = [](char c) { return isLetter(c) || isDigit(c) || c == '-'; };
    while (position_ < text_.size() && isInName(text_[position_])) ++position_;
    return std::string(text_.substr(begin, position_ - begin));
  }

  double number() {
    skipBlanks();
    const std::size_t end = std::min(text_.find_first_of(" ,)", position_), text_.size());
    const auto word = text_.substr(position_, end - position_);
    const auto value = parseNumber(word);
    if (!value) fail(fmt::format("expected a number, found '{}'", word));
    position_ = end;
    return *value;
  }

  [[noreturn]] void fail(const std::string& message) const { throw Error(fmt::format("'{}': {}", text_, message)); }

 private:
  void skipBlanks() {
    while (position_ < text_.size() && text_[position_] == ' ') ++position_;
  }

  std::string_view text_;
  std::size_t position_ = 0;
};

const DataSource& sourceNamed(const std::string& name, const Reader& reader) {
  const auto source = std::ranges::find(kSources, name, &DataSource::name);
  if (source != std::end(kSources)) return *source;
  std::vector<std::string> known, shown;
  for (const DataSource& s : kSources) {
    known.emplace_back(s.name);
    shown.push_back(fmt::format("{}{}", s.name, s.arguments));
  }
  reader.fail(fmt::format("unknown figures '{}'; {}", name,
                          didYouMean(name, known, fmt::format("expected {}", fmt::join(shown, ", ")))));
}

}  // namespace

bool Expectation::holds(double found) const {
  if (comparison == "==") return std::abs(found - wanted) <= tolerance;
  if (comparison == "!=") return !(std::abs(found - wanted) <= tolerance);
  if (comparison == "<") return found < wanted;
  if (comparison == "<=") return found <= wanted;
  if (comparison == ">") return found > wanted;
  return found >= wanted;
}

Expectation parseExpectation(std::string_view text) {
  Reader reader(text);
  Expectation expectation;
  expectation.source = reader.name();
  const DataSource& source = sourceNamed(expectation.source, reader);
  if (reader.take("(")) {
    do expectation.arguments.push_back(reader.number());
    while (reader.take(","));
    if (!reader.take(")")) reader.fail("expected ) after the numbers");
  }
  if (expectation.arguments.size() != source.count)
    reader.fail(fmt::format("expected {}{}", source.name, source.arguments));
  while (reader.take(".")) {
    expectation.path.push_back(reader.name());
    if (expectation.path.back().empty()) reader.fail("expected a name after the point");
  }
  if (expectation.path.empty()) reader.fail(fmt::format("expected {}{}.NAME", source.name, source.arguments));
  for (const char* comparison : {"==", "!=", "<=", ">=", "<", ">"})
    if (expectation.comparison.empty() && reader.take(comparison)) expectation.comparison = comparison;
  if (expectation.comparison.empty()) reader.fail("expected ==, !=, <, <=, > or >= after the name");
  const bool wantsExact = expectation.isOfDegree() && reader.take(levelName(kExactDegree));
  expectation.wanted = wantsExact ? kExactDegree : reader.number();
  if (reader.take("within")) {
    if (expectation.comparison != "==" && expectation.comparison != "!=")
      reader.fail("'within' goes with == and != only");
    expectation.tolerance = reader.number();
    if (!(expectation.tolerance >= 0)) reader.fail("expected a tolerance of at least 0");
  }
  if (!reader.atEnd()) reader.fail("expected nothing more after the number, or 'within' and a tolerance");
  return expectation;
}

}  // namespace hpsdf::app
