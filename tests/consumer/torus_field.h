#pragma once

#include <hpsdf/build.h>

#include <cmath>

constexpr double kMajorRadius = 0.7;
constexpr double kMinorRadius = 0.3;

/// Returns the field of a torus about the z axis, built from a distance function instead of a mesh.
inline hpsdf::Field torusField() {
  const auto torus = [](const hpsdf::Vector3& x) {
    return std::hypot(std::hypot(x.x(), x.y()) - kMajorRadius, x.z()) - kMinorRadius;
  };
  const hpsdf::Box domain(hpsdf::Vector3::Constant(-1.1), hpsdf::Vector3::Constant(1.1));
  return hpsdf::build(torus, domain, {.targetError = 1e-6});
}
