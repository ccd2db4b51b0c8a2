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

/// Returns the measured errors of a field as text: "near the surface RMS 2.06e-4, greatest 3.12e-3; over the domain RMS
/// 1.83e-4, greatest 4.57e-3; 2.57 % of the surface torn (mesh units)". Wrong signs are told if there are any. Returns
/// "not measured" for a field that was changed after it was measured, or that was never measured.
std::string measuredText(const Field& field);

/// Returns true if the field was built within a tolerance.
bool hasTolerance(const Field& field);
/// Returns true if the field misses its tolerance in a cell or at a measured point.
bool missesTolerance(const Field& field);
/// Returns the tolerance of a field, and whether the measurement found it kept.
std::string toleranceText(const Field& field);

/// Returns which values of the distance that a field was built from are exact, or "" for a field that is no
/// combination.
std::string exactnessText(const Field& field);

/// Return parts of `measuredText`: "RMS 2.06e-4, greatest 3.12e-3", "2.57 % of the surface torn", and the number of
/// points with a wrong sign.
std::string errorText(const Measurement::Error& error);
std::string tornText(const Measurement& m);
std::string wrongSignsText(const Measurement& m);

/// Returns the error that the construction estimated, and the measured error near the surface beside it, in one line.
std::string estimateLine(const Field& field);

/// Returns the measured errors of a field as JSON. Returns null if the field was not measured.
Json measuredJson(const Field& field);

/// Returns the size of a field as text: "54,935 leaves, 460,210 coefficients (float), 2.3 MB". If the field has exact
/// leaves, the text also has their number, the number of their triangles and the bytes of the field's parts.
std::string fieldLine(const Field& field);

/// Returns the number of exact leaves as text that follows the number of all leaves: " (12,345 exact)". Returns "" if
/// there are no exact leaves.
std::string exactCountText(const FieldStatistics& figures);

/// Returns the triangles of exact leaves as text: "5,012; a leaf lists 14 in the median, 64 at most".
std::string exactTrianglesText(const ExactLeafStatistics& exact);

/// Returns the bytes that a field takes as text. If the field has exact leaves, the text also has the bytes of its
/// parts: "2.30 MB (nodes 439 kB, coefficients 1.06 MB, triangles 801 kB)".
std::string memoryText(const Field& field);

/// Returns the statistics of exact leaves as JSON. Returns null if there are no exact leaves.
Json exactJson(const ExactLeafStatistics& exact);

std::string strategyName(Strategy strategy);

}  // namespace hpsdf::app
