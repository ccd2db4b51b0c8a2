#pragma once
// Describes a field in text and in JSON.

#include <map>
#include <string>

#include "hpsdf/field.h"
#include "session/current_field.h"
#include "text/json.h"

namespace hpsdf::app {

/// Converts a map from degrees or depths to values into a JSON object with the degrees or depths as keys, and the key
/// "exact" for exact leaves.
template <typename Value>
Json levelsJson(const std::map<int, Value>& levels) {
  Json json = Json::object();
  for (const auto& [level, value] : levels) json[levelName(level)] = value;
  return json;
}

/// Returns the median and the greatest of the leaves' error bounds as JSON. Returns null if the field holds
/// no error bounds.
Json boundsJson(const Field& field);

Json fieldJson(const CurrentField& current);
std::string fieldText(const CurrentField& current);

/// Returns the unit of the estimated RMS error in parentheses: mesh units or normalized units.
std::string unitText(const Field& field);

/// Returns the size of a field as text: "54,935 leaves, 460,210 coefficients (float), 2.3 MB".
std::string fieldLine(const Field& field);

std::string strategyName(Strategy strategy);

}  // namespace hpsdf::app
