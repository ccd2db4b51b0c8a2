#pragma once

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <numeric>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hpsdf {

/// Returns the smallest number of edits that turn `a` into `b`. An edit inserts, drops or replaces a letter, or
/// swaps it with the next letter. No letter is edited twice (the optimal string alignment distance). Upper and
/// lower case count as equal.
inline std::size_t editDistance(std::string_view a, std::string_view b) {
  const auto same = [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  };
  // row[j] is the distance between the first i letters of a and the first j letters of b; `before` is the row of
  // i - 1, and `twoBefore` the row of i - 2.
  std::vector<std::size_t> twoBefore, before, row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    twoBefore = std::exchange(before, row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({before[j] + 1, row[j - 1] + 1, before[j - 1] + (same(a[i - 1], b[j - 1]) ? 0 : 1)});
      if (i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1]))
        row[j] = std::min(row[j], twoBefore[j - 2] + 1);
    }
  }
  return row.back();
}

/// Returns the known name that is most similar to `wanted`, or an empty string if no name is similar. If several names
/// are equally similar, returns the first of them. A name is similar if at most a third of its letters (or one letter)
/// differ, or if it begins with `wanted` and `wanted` has three letters or more. Names of more than 64 letters are not
/// compared, because names in untrusted files can be very long.
inline std::string nearestName(std::string_view wanted, std::span<const std::string> known) {
  constexpr std::size_t kLongest = 64;
  std::string best;
  std::size_t bestDistance = std::string::npos;
  for (const std::string& name : known) {
    const std::size_t letters = std::max(wanted.size(), name.size());
    if (letters > kLongest) continue;
    std::size_t distance = editDistance(wanted, name);
    const bool isBeginning = wanted.size() >= 3 && name.starts_with(wanted);
    if (isBeginning) distance = std::min(distance, std::size_t{1});
    if (distance < bestDistance && distance <= std::max<std::size_t>(1, letters / 3) && distance < letters) {
      best = name;
      bestDistance = distance;
    }
  }
  return best;
}

/// Returns the end of an error message about the unknown name `wanted`: "did you mean 'NAME'?", where NAME is `prefix`
/// and the most similar known name, or `otherwise` if no known name is similar.
inline std::string didYouMean(std::string_view wanted, std::span<const std::string> known, std::string_view otherwise,
                              std::string_view prefix = "") {
  const std::string name = nearestName(wanted, known);
  return name.empty() ? std::string(otherwise) : "did you mean '" + std::string(prefix) + name + "'?";
}

}  // namespace hpsdf
