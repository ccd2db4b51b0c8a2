#pragma once
// Results for machines.

#include <nlohmann/json.hpp>
#include <ostream>

#include "hpsdf/types.h"

namespace hpsdf::app {

using Json = nlohmann::ordered_json;

/// Indented, ending in a newline; names that are not UTF-8 are mended rather than refused.
void printJson(std::ostream& out, const Json& json);

Json vectorJson(const Vector3& v);

Json boxJson(const Box& box);

}  // namespace hpsdf::app
