#pragma once
// What captions say.

#include <string>

#include "hpsdf/field.h"
#include "picture/legend.h"

namespace hpsdf::render {

inline std::string formatVector(const Vector3& v, int digits = 4) {
  return "(" + formatNumber(v.x(), digits) + ", " + formatNumber(v.y(), digits) + ", " + formatNumber(v.z(), digits) +
         ")";
}

inline std::string describeTarget(const Field& field) { return "τ = " + formatNumber(field.metadata().targetError, 3); }

inline std::string describeSource(const Field& field) {
  const std::string& name = field.metadata().source.name;
  return name.empty() ? "unnamed field" : name;
}

}  // namespace hpsdf::render
