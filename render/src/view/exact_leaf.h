#pragma once
// Exact leaves in double precision, for bounds and for the CPU renderer. This code is simpler than the queries of a
// field and shares only the walk through a list with them, so that tests can compare the two.

#include <cstdint>
#include <optional>

#include "hpsdf/detail/field_data.h"

namespace hpsdf::render {

/// Value and gradient, in world units, of an exact leaf; `bits` is its packed node. The point x may lie outside of the
/// leaf.
ValueAndGradient evaluateExactLeaf(const ExactTriangles& exact, std::uint64_t bits, const Vector3& x);

/// The unit normal of a triangle, or zero for a triangle without area.
Vector3 unitNormal(const ExactTriangles& exact, std::uint32_t triangle);

/// The corners of a triangle.
std::array<Vector3, 3> cornersOf(const ExactTriangles& exact, std::uint32_t triangle);

/// The point where a ray crosses a triangle.
struct Crossing {
  double t;  ///< length along the ray
  std::uint32_t triangle;
};

/// A part of a ray: start + t · direction, with t from `first` to `last`.
struct RayPart {
  Vector3 start, direction;  ///< world units; the direction is a unit vector
  double first, last;
};

/// Finds the first crossing of a ray through a listed triangle, from its outer to its inner side if `side` is positive,
/// or the other way if it is negative. A ray through a common edge of triangles crosses at least one of them.
std::optional<Crossing> firstCrossing(const ExactTriangles& exact, std::uint64_t bits, const RayPart& ray, double side);

}  // namespace hpsdf::render
