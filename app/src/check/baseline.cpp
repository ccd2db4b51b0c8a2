#include "check/baseline.h"

#include <algorithm>

#include "files/data_table.h"
#include "files/text_file.h"
#include "hpsdf/error.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Reads the size of a baseline (an accepted picture or table) from `json`, which must be an array of two whole
/// numbers. The types are checked because nlohmann's JSON would silently convert other numbers.
std::array<std::size_t, 2> sizeOf(const std::string& file, const Json& json) {
  const auto isWhole = [](const Json& number) { return number.is_number_unsigned(); };
  if (!json.is_array() || json.size() != 2 || !std::ranges::all_of(json, isWhole))
    throw Error(file + ": size: expected two whole numbers");
  return json.get<std::array<std::size_t, 2>>();
}

/// Parses the description of a baseline (size, renderer, tolerances) from JSON. Throws `Error`, or an exception of
/// nlohmann's JSON, if the JSON is not of the form that `saveFacts` writes.
BaselineFacts factsOf(const std::string& file, const Json& json) {
  BaselineFacts facts;
  for (const auto& [key, value] : json.items()) {
    if (key == "size")
      facts.size = sizeOf(file, value);
    else if (key == "renderer")
      value.get_to(facts.renderer);
    else if (key == "version")
      value.get_to(facts.version);
    else if (key == "budget")
      facts.budget = value.get<double>();
    else if (key == "bound")
      facts.bound = value.get<double>();
    else
      throw Error(file + ": unknown key '" + printable(key) + "'");
  }
  if (facts.budget && !(*facts.budget >= 0 && *facts.budget <= 1))
    throw Error(file + ": budget: expected a share from 0 to 1");
  if (facts.bound && !(*facts.bound >= 0)) throw Error(file + ": bound: expected a number of at least 0");
  return facts;
}

}  // namespace

std::filesystem::path factsFile(const std::filesystem::path& baseline) {
  if (isDataFile(baseline)) return baseline.string() + ".json";
  return std::filesystem::path(baseline).replace_extension(".json");
}

BaselineFacts loadFacts(const std::filesystem::path& baseline) {
  const std::string file = factsFile(baseline).string();
  if (!std::filesystem::exists(file)) throw Error(file + ": is missing beside its baseline; 'hpsdf accept' writes it");
  try {
    return factsOf(file, Json::parse(readTextFile(file)));
  } catch (const Json::exception& error) {
    throw Error(file + ": is not the JSON of a baseline (" + printable(error.what()) +
                "); remove it and accept the picture again");
  }
}

void saveFacts(const BaselineFacts& facts, const std::filesystem::path& baseline) {
  Json json = {{"size", facts.size}, {"renderer", facts.renderer}, {"version", facts.version}};
  if (facts.budget) json["budget"] = *facts.budget;
  if (facts.bound) json["bound"] = *facts.bound;
  writeTextFile(factsFile(baseline), jsonText(json));
}

bool isComparable(const std::filesystem::path& file) { return lowerExtension(file) == ".png" || isDataFile(file); }

}  // namespace hpsdf::app
