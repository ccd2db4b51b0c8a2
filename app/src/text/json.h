#pragma once
// JSON output of commands.

#include <nlohmann/json.hpp>
#include <ostream>
#include <string>

#include "hpsdf/types.h"

namespace hpsdf::app {

using Json = nlohmann::ordered_json;

/// Indented JSON and a newline. Bytes that are not UTF-8, which names of files may contain, are replaced.
std::string jsonText(const Json& json);
void printJson(std::ostream& out, const Json& json);

/// The number of that name in an object.
inline double numberIn(const Json& object, const char* name) { return object.at(name).get<double>(); }

Json vectorJson(const Vector3& v);

Json boxJson(const Box& box);

}  // namespace hpsdf::app
