#pragma once
// What is known of a baseline, in a small JSON file beside it; docs/check.md is the manual.

#include <array>
#include <filesystem>
#include <optional>
#include <string>

namespace hpsdf::app {

struct BaselineFacts {
  std::array<std::size_t, 2> size = {};  ///< width and height of a picture, columns and rows of raw values
  std::string renderer = {};             ///< that drew it; "" where none did
  std::string version = {};              ///< of the program
  std::optional<double> budget = {};     ///< share of its pixels or values that may differ
  std::optional<double> bound = {};      ///< by how much raw values may differ
};

/// degree.json of degree.png; of raw values the whole name counts: values.csv.json.
std::filesystem::path factsFile(const std::filesystem::path& baseline);

/// Throws `Error` naming the JSON file when it is missing or holds something else.
BaselineFacts loadFacts(const std::filesystem::path& baseline);
void saveFacts(const BaselineFacts& facts, const std::filesystem::path& baseline);

/// A picture or raw values, by its ending.
bool isComparable(const std::filesystem::path& file);

}  // namespace hpsdf::app
