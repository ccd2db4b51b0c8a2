#pragma once

#include <array>
#include <functional>
#include <span>

#include "hpsdf/types.h"

namespace hpsdf::contouring {

/// The cosine of the angle between the normals of a triangle and of the surface below which the triangle counts as
/// folded over.
constexpr double kFolded = 0.1;

/// Evaluates the function whose zero set a mesh follows, at many points.
using Evaluate = std::function<void(std::span<const Vector3> points, std::span<double> values)>;

/// Returns the barycentric coordinates of some points of a triangle, at most `spacing` from one to the next, unless
/// that takes more than 2,000 points.
std::span<const Vector3> placesInTriangle(const std::array<Vector3, 3>& triangle, double spacing);

/// Raises `errors`, one for each triangle, to the greatest magnitude of a function that is found in the triangle. The
/// triangles are given by their corners. Few points are enough in most triangles, at most `spacing` from one to the
/// next; where the error is not far below the tolerance, more points are searched.
void raiseErrors(const Evaluate& evaluate, std::span<const std::array<Vector3, 3>> triangles, double tolerance,
                 double spacing, std::span<double> errors);

}  // namespace hpsdf::contouring
