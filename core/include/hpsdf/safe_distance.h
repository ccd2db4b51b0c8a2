#pragma once
// Distances that are safe to go: what is certain about Φ between the samples that a field was made from.
//
// A signed distance never changes faster than the distance between two points: |Φ(x) − Φ(y)| ≤ |x − y|. Every known
// value bounds it everywhere, from above and from below, and best along the line to the surface. From such bounds and
// those of the cell's polynomial follow bounds of the field's error over whole cells (`CellBound`).
//
// They hold where Φ is the signed distance of a closed surface without self-intersections. Where the sign is wrong or
// has no meaning, as beside the holes of an open mesh, Φ jumps, and no bound holds there.

#include <cstdint>
#include <optional>

#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// The same field with a bound for each leaf, which takes 24 values of Φ a leaf. Their number is added to
/// `exactEvaluations`. The result does not depend on `threads` (0: all that the machine offers). Throws `Error` for a
/// Φ that is not finite, `Cancelled` when asked to stop.
Field withBounds(const Field& field, const DistanceFunction& distance, int threads = 0, const Progress& progress = {});

/// The bound of the leaf that holds x, or, for x outside, the domain's closest point; nothing where the field keeps no
/// bounds.
std::optional<CellBound> boundAt(const Field& field, const Vector3& x);

/// Nowhere within this distance of x lies the surface: |f| less the bound of the error, 0 where that is not above 0, as
/// beside the surface. For x outside the domain, that of the domain's closest point less the way to it. Throws `Error`
/// for a field without bounds.
double safeDistance(const Field& field, const Vector3& x);

/// How far a ray came.
struct SafeTrace {
  double length = 0;  ///< in the field's units: before it there is no surface
  /// The surface may be within `slack` of the ray's point there, or within what rounding leaves open, which far from
  /// the domain may be more; else the ray left the domain.
  bool mayTouch = false;
  int steps = 0;
};

/// Goes along a ray by safe distances until one is shorter than `slack`: it never passes through the surface, though it
/// may stop where a more exact field would let it pass. From an origin outside of the domain it starts at the wall.
/// `direction` is taken to unit length. Throws `Error` for a field without bounds, a direction that is none, and a
/// slack that is not above 0.
SafeTrace safeTrace(const Field& field, const Vector3& origin, const Vector3& direction, double slack);

}  // namespace hpsdf
