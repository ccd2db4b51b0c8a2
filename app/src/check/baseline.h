#pragma once
// A baseline is an accepted picture or table with which `hpsdf check` compares new results. A small JSON file beside
// the baseline describes it. docs/check.md is the manual.

#include <array>
#include <filesystem>
#include <optional>
#include <string>

namespace hpsdf::app {

struct BaselineFacts {
  std::array<std::size_t, 2> size = {};  ///< width and height of a picture, or columns and rows of raw values
  std::string renderer = {};             ///< renderer that drew the picture; "" for raw values
  std::string version = {};              ///< version of the program that wrote the baseline
  std::optional<double> budget = {};     ///< share of pixels or values that may differ, 0 to 1
  std::optional<double> bound = {};      ///< greatest difference of raw values that is accepted
};

/// Returns the name of a baseline's JSON file: degree.json for degree.png, but values.csv.json for the raw
/// values of values.csv.
std::filesystem::path factsFile(const std::filesystem::path& baseline);

/// Loads the description of a baseline from its JSON file. Throws `Error` naming the JSON file if it is missing or
/// malformed.
BaselineFacts loadFacts(const std::filesystem::path& baseline);
void saveFacts(const BaselineFacts& facts, const std::filesystem::path& baseline);

/// True if the file extension is one for pictures or for raw values.
bool isComparable(const std::filesystem::path& file);

}  // namespace hpsdf::app
