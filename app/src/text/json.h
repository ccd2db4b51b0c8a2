#pragma once
// JSON output of commands.

#include <nlohmann/json.hpp>
#include <ostream>
#include <string>

#include "hpsdf/types.h"

namespace hpsdf::app {

using Json = nlohmann::ordered_json;

/// Returns indented JSON that ends with a newline. Bytes that are not UTF-8, which file names may contain, are
/// replaced.
std::string jsonText(const Json& json);
/// Returns JSON in one line that ends with a newline, with the same replacements.
std::string jsonLine(const Json& json);
void printJson(std::ostream& out, const Json& json);

/// Returns the number in `object` with the key `name`.
inline double numberIn(const Json& object, const char* name) { return object.at(name).get<double>(); }

Json vectorJson(const Vector3& v);

Json boxJson(const Box& box);

/// Returns the degree of a leaf as a number, or the word "exact" for an exact leaf.
Json degreeJson(int degree);
/// Returns the text of a degree that `degreeJson` returned.
std::string degreeText(const Json& degree);

}  // namespace hpsdf::app
