#pragma once
// Evaluation of exact leaves: the signed distance to the nearest of a list of triangles.

#include <cstdint>

#include "hpsdf/detail/field_data.h"

namespace hpsdf::query {

/// Computes the signed distance from x to the nearest of the triangles of an exact leaf; `leaf` is the packed node. The
/// overload for `ValueAndGradient` also gives the gradient. On the surface, where the distance is 0, the gradient is
/// the unit pseudonormal. The results do not depend on the instruction set.
void evaluateExact(const ExactTriangles& exact, std::uint64_t leaf, const Vector3& x, double& value);
void evaluateExact(const ExactTriangles& exact, std::uint64_t leaf, const Vector3& x, ValueAndGradient& result);

}  // namespace hpsdf::query
