#include "commands/point_query.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "hpsdf/detail/text.h"
#include "hpsdf/error.h"
#include "hpsdf/range.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::size_t kBatch = 16384;
constexpr std::string_view kBlanks = " \t\r\v\f";

bool isSeparator(char c) { return c == ',' || c == ';' || kBlanks.find(c) != std::string_view::npos; }

/// Parses exactly N numbers, infinity and NaN included. Adjacent numbers are separated by blanks and at most one comma
/// or semicolon. Returns std::nullopt for any other text.
template <std::size_t N>
std::optional<std::array<double, N>> parseNumbers(std::string_view text) {
  std::array<double, N> numbers;
  const char* next = text.data();
  const char* const end = next + text.size();
  for (std::size_t n = 0; n < N; ++n) {
    const char* const before = next;
    int commas = 0;
    for (; next != end && isSeparator(*next); ++next) commas += kBlanks.find(*next) == std::string_view::npos;
    if (commas > (n == 0 ? 0 : 1) || (n > 0 && next == before)) return std::nullopt;
    if (next != end && *next == '+') ++next;
    const auto [after, error] = std::from_chars(next, end, numbers[n]);
    if (error != std::errc()) return std::nullopt;
    next = after;
  }
  return next == end ? std::optional(numbers) : std::nullopt;
}

/// True if the text is a header line of column names: it begins with a letter or a quote, and it is not a row of
/// numbers such as "nan nan nan".
template <std::size_t N>
bool isHeader(std::string_view text) {
  return !text.empty() && (isLetter(text[0]) || text[0] == '"') && !parseNumbers<N>(text);
}

/// Formats a number for JSON. Infinities and NaN become null, because JSON has no text for them.
std::string jsonNumber(double value) { return std::isfinite(value) ? fmt::format("{}", value) : "null"; }

using Text = std::back_insert_iterator<std::string>;

/// Points as questions to a field, which answers with value and gradient.
class PointAnswers {
 public:
  static constexpr std::size_t kNumbers = 3;
  static constexpr std::string_view kExpected = "three finite numbers x,y,z";

  explicit PointAnswers(const Field& field) : field_(field) {}

  static std::string header() { return "x,y,z,distance,gx,gy,gz\n"; }
  static std::string problem(const std::array<double, kNumbers>& /*numbers*/) { return {}; }

  std::size_t size() const { return points_.size(); }
  void take(const std::array<double, kNumbers>& numbers) { points_.emplace_back(numbers[0], numbers[1], numbers[2]); }
  void clear() { points_.clear(); }

  void answer() {
    answers_.resize(points_.size());
    field_.valuesAndGradients(points_, answers_);
  }

  void write(std::size_t i, PointFormat format, Text out) const {
    const Vector3& x = points_[i];
    const auto& [value, g] = answers_[i];
    if (format == PointFormat::csv)
      fmt::format_to(out, "{},{},{},{},{},{},{}\n", x.x(), x.y(), x.z(), value, g.x(), g.y(), g.z());
    else
      fmt::format_to(out, R"({{"x":{},"y":{},"z":{},"distance":{},"gx":{},"gy":{},"gz":{}}})", x.x(), x.y(), x.z(),
                     jsonNumber(value), jsonNumber(g.x()), jsonNumber(g.y()), jsonNumber(g.z()));
  }

 private:
  const Field& field_;
  std::vector<Vector3> points_;
  std::vector<ValueAndGradient> answers_;
};

/// Boxes as questions to a field, which answers with certified ranges.
class BoxAnswers {
 public:
  static constexpr std::size_t kNumbers = 6;
  static constexpr std::string_view kExpected = "six finite numbers, the lower and the upper corner of a box";

  explicit BoxAnswers(const Field& field) : index_(field), hasBounds_(!field.data().bounds.empty()) {}

  std::string header() const {
    return hasBounds_ ? "x0,y0,z0,x1,y1,z1,min,max,exact_min,exact_max\n" : "x0,y0,z0,x1,y1,z1,min,max\n";
  }
  static std::string problem(const std::array<double, kNumbers>& numbers) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (numbers[axis] > numbers[axis + 3])
        return fmt::format("the box is empty along {}: the lower corner comes first, give {} before {}", "xyz"[axis],
                           numbers[axis + 3], numbers[axis]);
    return {};
  }

  std::size_t size() const { return boxes_.size(); }
  void take(const std::array<double, kNumbers>& n) {
    boxes_.emplace_back(Vector3(n[0], n[1], n[2]), Vector3(n[3], n[4], n[5]));
  }
  void clear() { boxes_.clear(); }
  void answer() {
    ranges_.clear();
    for (const Box& box : boxes_) ranges_.push_back(index_.range(box));
  }

  void write(std::size_t i, PointFormat format, Text out) const {
    const Vector3 &from = boxes_[i].min(), &to = boxes_[i].max();
    const auto& [value, distance] = ranges_[i];
    if (format == PointFormat::csv) {
      fmt::format_to(out, "{},{},{},{},{},{},{},{}", from.x(), from.y(), from.z(), to.x(), to.y(), to.z(), value.min,
                     value.max);
      if (distance) fmt::format_to(out, ",{},{}", distance->min, distance->max);
      fmt::format_to(out, "\n");
      return;
    }
    fmt::format_to(out, R"({{"x0":{},"y0":{},"z0":{},"x1":{},"y1":{},"z1":{},"min":{},"max":{})", from.x(), from.y(),
                   from.z(), to.x(), to.y(), to.z(), jsonNumber(value.min), jsonNumber(value.max));
    if (distance)
      fmt::format_to(out, R"(,"exact_min":{},"exact_max":{})", jsonNumber(distance->min), jsonNumber(distance->max));
    fmt::format_to(out, "}}");
  }

 private:
  RangeIndex index_;
  bool hasBounds_;
  std::vector<Box> boxes_;
  std::vector<FieldRange> ranges_;
};

/// Points as questions to a mesh, which answers with closest points and winding numbers.
class ClosestAnswers {
 public:
  static constexpr std::size_t kNumbers = PointAnswers::kNumbers;
  static constexpr std::string_view kExpected = PointAnswers::kExpected;

  explicit ClosestAnswers(const ExactDistance& distance) : distance_(distance) {}

  static std::string header() { return "x,y,z,distance,px,py,pz,face,feature,k,b0,b1,b2,winding\n"; }
  static std::string problem(const std::array<double, kNumbers>& /*numbers*/) { return {}; }

  std::size_t size() const { return points_.size(); }
  void take(const std::array<double, kNumbers>& numbers) { points_.emplace_back(numbers[0], numbers[1], numbers[2]); }
  void clear() { points_.clear(); }

  void answer() {
    closest_.resize(points_.size());
    windings_.resize(points_.size());
    distance_.closestPoints(points_, closest_);
    distance_.windingNumbers(points_, windings_);
  }

  void write(std::size_t i, PointFormat format, Text out) const {
    constexpr std::array<std::string_view, 3> kFeatures = {"face", "edge", "vertex"};
    const Vector3& x = points_[i];
    const ClosestPoint& closest = closest_[i];
    const Vector3 &p = closest.point, &b = closest.barycentric;
    const std::string_view feature = kFeatures[static_cast<std::size_t>(closest.feature)];
    if (format == PointFormat::csv)
      fmt::format_to(out, "{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", x.x(), x.y(), x.z(), closest.signedDistance,
                     p.x(), p.y(), p.z(), closest.triangle, feature, closest.featureIndex, b.x(), b.y(), b.z(),
                     windings_[i]);
    else
      fmt::format_to(
          out,
          R"({{"x":{},"y":{},"z":{},"distance":{},"px":{},"py":{},"pz":{},"face":{},"feature":"{}","k":{},"b0":{},"b1":{},"b2":{},"winding":{}}})",
          x.x(), x.y(), x.z(), jsonNumber(closest.signedDistance), jsonNumber(p.x()), jsonNumber(p.y()),
          jsonNumber(p.z()), closest.triangle, feature, closest.featureIndex, jsonNumber(b.x()), jsonNumber(b.y()),
          jsonNumber(b.z()), jsonNumber(windings_[i]));
  }

 private:
  const ExactDistance& distance_;
  std::vector<Vector3> points_;
  std::vector<ClosestPoint> closest_;
  std::vector<double> windings_;
};

/// Reads questions, one a line, and writes the answers. `Answers` is one of the classes above, which asks `asked`.
template <typename Answers>
class Query {
 public:
  template <typename Asked>
  Query(const Asked& asked, std::string name, PointFormat format, const std::function<void(std::string_view)>& write)
      : answers_(asked), name_(std::move(name)), format_(format), write_(write) {}

  std::size_t run(std::istream& in) {
    text_ = format_ == PointFormat::csv ? answers_.header() : "[";
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
  static constexpr std::size_t kNumbers = Answers::kNumbers;

  void take(std::string_view line, std::size_t number) {
    if (const std::size_t comment = line.find('#'); comment != std::string_view::npos)
      line = trimmed(line.substr(0, comment));
    if (line.empty()) return;
    const bool first = std::exchange(first_, false);
    const auto numbers = parseNumbers<kNumbers>(line);
    if (!numbers && first && isHeader<kNumbers>(line)) return;
    if (!numbers || !std::ranges::all_of(*numbers, [](double n) { return std::isfinite(n); })) refuse(line, number);
    if (const std::string problem = answers_.problem(*numbers); !problem.empty())
      throw Error(fmt::format("{}:{}: {}", name_, number, problem));
    answers_.take(*numbers);
    if (answers_.size() == kBatch) flush();
  }

  [[noreturn]] void refuse(std::string_view line, std::size_t number) const {
    constexpr std::size_t kShown = 60;
    const std::string shown(line.substr(0, kShown));
    throw Error(fmt::format("{}:{}: expected {}, found '{}{}'", name_, number, Answers::kExpected, shown,
                            line.size() > kShown ? "…" : ""));
  }

  void flush() {
    answers_.answer();
    for (std::size_t i = 0; i < answers_.size(); ++i) {
      if (format_ == PointFormat::json) text_ += count_ + i == 0 ? "\n" : ",\n";
      answers_.write(i, format_, std::back_inserter(text_));
    }
    count_ += answers_.size();
    answers_.clear();
    write_(text_);
    text_.clear();
  }

  Answers answers_;
  std::string name_;
  PointFormat format_;
  const std::function<void(std::string_view)>& write_;
  bool first_ = true;
  std::size_t count_ = 0;
  std::string text_;
};

}  // namespace

std::size_t queryPoints(const Field& field, std::istream& in, const std::string& name, PointFormat format,
                        const std::function<void(std::string_view)>& write) {
  return Query<PointAnswers>(field, name, format, write).run(in);
}

std::size_t queryBoxes(const Field& field, std::istream& in, const std::string& name, PointFormat format,
                       const std::function<void(std::string_view)>& write) {
  return Query<BoxAnswers>(field, name, format, write).run(in);
}

std::size_t queryClosestPoints(const ExactDistance& distance, std::istream& in, const std::string& name,
                               PointFormat format, const std::function<void(std::string_view)>& write) {
  return Query<ClosestAnswers>(distance, name, format, write).run(in);
}

}  // namespace hpsdf::app
