#pragma once
// Expectations compare a number that a command reports with a limit: "stats.leaves < 60000",
// "pick(640,360).degree == 4".

#include <string>
#include <string_view>
#include <vector>

namespace hpsdf::app {

/// An expectation, written as SOURCE[(NUMBER,…)][.KEY]… OPERATOR NUMBER|exact [within NUMBER].
struct Expectation {
  std::string source;             ///< one of stats, jumps, pick, at and why
  std::vector<double> arguments;  ///< the numbers in parentheses after the source
  std::vector<std::string> path;  ///< JSON keys and array indices that lead to the number
  std::string comparison;         ///< operator: == != < <= > >=
  double wanted = 0;
  double tolerance = 0;  ///< largest difference that == and != accept as equal

  /// True if the expectation is about the degree of a leaf. The degree of an exact leaf is written as the word "exact"
  /// and counts as `kExactDegree`, which is greater than all other degrees.
  bool isOfDegree() const { return path.back() == "degree"; }

  bool holds(double found) const;
};

/// Parses an expectation. Throws `Error` for any other text. If the source is unknown, the message names the
/// most similar known source.
Expectation parseExpectation(std::string_view text);

}  // namespace hpsdf::app
