#pragma once
// What `expect` says of figures: "stats.leaves < 60000", "pick(640,360).degree == 4".

#include <string>
#include <string_view>
#include <vector>

namespace hpsdf::app {

/// SOURCE[(NUMBER,…)][.KEY]… OPERATOR NUMBER [within NUMBER]
struct Expectation {
  std::string source;             ///< stats, jumps, pick, at
  std::vector<double> arguments;  ///< in parentheses
  std::vector<std::string> path;  ///< keys, or numbers of elements
  std::string comparison;         ///< == != < <= > >=
  double wanted = 0;
  double tolerance = 0;  ///< of == and !=

  bool holds(double found) const;
};

/// Throws `Error` for text that is none, with the nearest known source.
Expectation parseExpectation(std::string_view text);

}  // namespace hpsdf::app
