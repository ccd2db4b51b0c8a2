#pragma once
// JSON output of commands.

#include <nlohmann/json.hpp>
#include <ostream>

#include "hpsdf/types.h"

namespace hpsdf::app {

using Json = nlohmann::ordered_json;

/// Writes indented JSON and a newline. Bytes that are not UTF-8, which names of files may contain, are replaced.
void printJson(std::ostream& out, const Json& json);

Json vectorJson(const Vector3& v);

Json boxJson(const Box& box);

}  // namespace hpsdf::app
