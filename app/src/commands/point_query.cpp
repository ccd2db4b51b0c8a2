#include "commands/point_query.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <iterator>
#include <optional>
#include <vector>

#include "hpsdf/detail/text.h"
#include "hpsdf/error.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::size_t kBatch = 16384;
constexpr std::string_view kBlanks = " \t\r\v\f";

bool isSeparator(char c) { return c == ',' || c == ';' || kBlanks.find(c) != std::string_view::npos; }

/// Parses exactly three numbers, infinity and NaN included. Adjacent numbers are separated by blanks and at most one
/// comma or semicolon. Returns std::nullopt for any other text.
std::optional<Vector3> parsePoint(std::string_view text) {
  Vector3 point;
  const char* next = text.data();
  const char* const end = next + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    const char* const before = next;
    int commas = 0;
    for (; next != end && isSeparator(*next); ++next) commas += kBlanks.find(*next) == std::string_view::npos;
    if (commas > (axis == 0 ? 0 : 1) || (axis > 0 && next == before)) return std::nullopt;
    if (next != end && *next == '+') ++next;
    const auto [after, error] = std::from_chars(next, end, point[axis]);
    if (error != std::errc()) return std::nullopt;
    next = after;
  }
  return next == end ? std::optional(point) : std::nullopt;
}

/// True if the text is a header line of column names: it begins with a letter or a quote, and it is not a point such as
/// "nan nan nan".
bool isHeader(std::string_view text) {
  return !text.empty() && (isLetter(text[0]) || text[0] == '"') && !parsePoint(text);
}

class Query {
 public:
  Query(const Field& field, std::string name, PointFormat format, const std::function<void(std::string_view)>& write)
      : field_(field), name_(std::move(name)), format_(format), write_(write) {}

  std::size_t run(std::istream& in) {
    text_ = format_ == PointFormat::csv ? "x,y,z,distance,gx,gy,gz\n" : "[";
    std::string line;
    for (std::size_t number = 1; std::getline(in, line); ++number) {
      std::string_view text = line;
      if (number == 1 && text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // byte order mark
      take(trimmed(text), number);
      if (in.rdbuf()->in_avail() <= 0) flush();  // the sender may wait for the answers before it sends more
    }
    if (in.bad()) throw Error(name_ + ": cannot be read");
    flush();
    if (format_ == PointFormat::json) write_(count_ == 0 ? "]\n" : "\n]\n");
    return count_;
  }

 private:
  void take(std::string_view line, std::size_t number) {
    if (const std::size_t comment = line.find('#'); comment != std::string_view::npos)
      line = trimmed(line.substr(0, comment));
    if (line.empty()) return;
    const bool first = std::exchange(first_, false);
    const auto point = parsePoint(line);
    if (!point && first && isHeader(line)) return;
    if (!point || !point->allFinite()) refuse(line, number);
    points_.push_back(*point);
    if (points_.size() == kBatch) flush();
  }

  /// Formats a number for JSON. Infinities and NaN become null, because JSON has no text for them.
  static std::string number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : "null"; }

  [[noreturn]] void refuse(std::string_view line, std::size_t number) const {
    constexpr std::size_t kShown = 60;
    const std::string shown(line.substr(0, kShown));
    throw Error(fmt::format("{}:{}: expected three finite numbers x,y,z, found '{}{}'", name_, number, shown,
                            line.size() > kShown ? "…" : ""));
  }

  void flush() {
    answers_.resize(points_.size());
    field_.valuesAndGradients(points_, answers_);
    auto out = std::back_inserter(text_);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vector3& x = points_[i];
      const auto& [value, g] = answers_[i];
      if (format_ == PointFormat::csv)
        fmt::format_to(out, "{},{},{},{},{},{},{}\n", x.x(), x.y(), x.z(), value, g.x(), g.y(), g.z());
      else
        fmt::format_to(out, R"({}{{"x":{},"y":{},"z":{},"distance":{},"gx":{},"gy":{},"gz":{}}})",
                       count_ + i == 0 ? "\n" : ",\n", x.x(), x.y(), x.z(), number(value), number(g.x()), number(g.y()),
                       number(g.z()));
    }
    count_ += points_.size();
    points_.clear();
    write_(text_);
    text_.clear();
  }

  const Field& field_;
  std::string name_;
  PointFormat format_;
  const std::function<void(std::string_view)>& write_;
  bool first_ = true;
  std::size_t count_ = 0;
  std::vector<Vector3> points_;
  std::vector<ValueAndGradient> answers_;
  std::string text_;
};

}  // namespace

std::size_t queryPoints(const Field& field, std::istream& in, const std::string& name, PointFormat format,
                        const std::function<void(std::string_view)>& write) {
  return Query(field, name, format, write).run(in);
}

}  // namespace hpsdf::app
