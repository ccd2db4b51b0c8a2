#include "files/data_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <sstream>

#include "files/text_file.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Parses a number at the beginning of `text`. The word "exact", the degree of an exact leaf, counts as `kExactDegree`.
std::from_chars_result parseCell(std::string_view text, double& number) {
  static const std::string exact = levelName(kExactDegree);
  if (!text.starts_with(exact)) return std::from_chars(text.data(), text.data() + text.size(), number);
  number = kExactDegree;
  return {text.data() + exact.size(), std::errc()};
}

/// Parses the numbers of a line of comma-separated values, NaN and infinity included. Returns std::nullopt if
/// a cell is not a number.
std::optional<std::vector<double>> numbersOf(const std::string& line) {
  std::vector<double> numbers;
  for (const char* cell = line.data();; ++cell) {
    const char* const end = line.data() + line.size();
    double number = 0;
    const auto [after, error] = parseCell({cell, end}, number);
    if (error != std::errc()) return std::nullopt;
    numbers.push_back(number);
    if (after == end) return numbers;
    if (*after != ',') return std::nullopt;
    cell = after;
  }
}

DataTable readCsv(const std::string& file, const std::string& text) {
  DataTable table;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto numbers = numbersOf(line);
    if (!numbers && number == 1) {
      table.header = line;
      table.columns = static_cast<std::size_t>(std::ranges::count(line, ',')) + 1;
      continue;
    }
    if (number == 1) table.columns = numbers->size();
    if (!numbers || numbers->size() != table.columns)
      throw Error(fmt::format("{}:{}: expected {} numbers with commas between them", file, number, table.columns));
    table.values.insert(table.values.end(), numbers->begin(), numbers->end());
    ++table.rows;
  }
  return table;
}

/// Reads a portable float map of one little-endian channel, as `hpsdf slice` writes it.
DataTable readPfm(const std::string& file, const std::string& text) {
  std::istringstream stream(text);
  std::string kind;
  DataTable table;
  double scale = 0;
  stream >> kind >> table.columns >> table.rows >> scale;
  const auto begin = static_cast<std::size_t>(std::max<std::streamoff>(stream.tellg(), 0)) + 1;
  // Reject a file that states more rows or columns than it has bytes: their product might overflow.
  const bool isWithin = table.columns <= text.size() && table.rows <= text.size();
  const std::size_t count = table.columns * table.rows;
  if (!stream || !isWithin || kind != "Pf" || scale >= 0 || begin > text.size() ||
      (text.size() - begin) / sizeof(float) != count || (text.size() - begin) % sizeof(float) != 0)
    throw Error(file + ": is not a complete .pfm file of one little-endian channel; write it again with 'hpsdf slice'");
  table.values.resize(count);
  for (std::size_t n = 0; n < count; ++n) {
    float value = 0;
    std::memcpy(&value, text.data() + begin + n * sizeof value, sizeof value);
    table.values[n] = value;
  }
  return table;
}

/// Returns |a − b|. The difference is 0 for two NaN and for two equal infinities. It is infinite between NaN
/// and a number.
double difference(double a, double b) {
  if (a == b || (std::isnan(a) && std::isnan(b))) return 0;
  const double distance = std::abs(a - b);
  return std::isnan(distance) ? std::numeric_limits<double>::infinity() : distance;
}

}  // namespace

bool isDataFile(const std::filesystem::path& file) {
  return lowerExtension(file) == ".csv" || lowerExtension(file) == ".pfm";
}

DataTable loadData(const std::filesystem::path& file) {
  const std::string text = readWholeFile(file.string());
  return lowerExtension(file) == ".pfm" ? readPfm(file.string(), text) : readCsv(file.string(), text);
}

DataComparison compare(const DataTable& baseline, const DataTable& actual, double bound) {
  DataComparison result{.sameShape = baseline.header == actual.header && baseline.columns == actual.columns &&
                                     baseline.rows == actual.rows};
  if (!result.sameShape) return result;
  result.compared = baseline.values.size();
  std::vector<DataDifference> beyond;
  for (std::size_t n = 0; n < baseline.values.size(); ++n) {
    const double found = difference(baseline.values[n], actual.values[n]);
    result.largest = std::max(result.largest, found);
    if (found > bound)
      beyond.push_back({n / baseline.columns, n % baseline.columns, baseline.values[n], actual.values[n], found});
  }
  result.differing = beyond.size();
  std::ranges::stable_sort(beyond, std::ranges::greater(), &DataDifference::difference);
  if (beyond.size() > kWorstData) beyond.resize(kWorstData);
  result.worst = std::move(beyond);
  return result;
}

std::string problem(const DataComparison& comparison, double bound, double budget) {
  if (!comparison.sameShape) return "the tables have other rows or columns";
  if (double(comparison.differing) <= budget * double(comparison.compared)) return {};
  return fmt::format("{} of {} values differ by more than {}, at most by {:.3g}", comparison.differing,
                     comparison.compared, shortNumber(bound), comparison.largest);
}

}  // namespace hpsdf::app
