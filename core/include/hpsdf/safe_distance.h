#pragma once
// Proven bounds of a field's error, and distances from the surface that follow from them.
//
// A signed distance is 1-Lipschitz, |Φ(x) − Φ(y)| ≤ |x − y|, so that every exact value bounds Φ everywhere from above
// and from below. These bounds and those of a leaf's polynomial give a bound of |f − Φ| over the whole leaf
// (`CellBound`).
//
// The bounds hold if Φ is the signed distance of a closed surface without self-intersections. Near the holes of an open
// mesh and wherever else the sign is wrong, Φ jumps and no bound holds.

#include <cstdint>
#include <optional>

#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// Returns the field with a bound for each leaf. This evaluates Φ 24 times a leaf, which `exactEvaluations` counts. The
/// result does not depend on `threads` (0: all that the machine offers). Throws `Error` if Φ is not finite, `Cancelled`
/// when `progress` says so.
Field withBounds(const Field& field, const DistanceFunction& distance, int threads = 0, const Progress& progress = {});

/// Returns the bound of the leaf that holds x or, for x outside the domain, the domain's closest point; nothing if the
/// field has no bounds.
std::optional<CellBound> boundAt(const Field& field, const Vector3& x);

/// Returns a distance from x within which the surface certainly does not lie: |f| less the bound of the error, and at
/// least 0. For x outside the domain, it is the safe distance of the domain's closest point less the distance to that
/// point. Throws `Error` if the field has no bounds.
double safeDistance(const Field& field, const Vector3& x);

/// The result of tracing a ray by safe distances.
struct SafeTrace {
  double length = 0;  ///< length of the ray, in the field's units, that certainly does not touch the surface
  /// True if the surface may lie within `slack` of the ray at this length. Rounding may add to the slack far from the
  /// domain. If false, the ray left the domain.
  bool mayTouch = false;
  int steps = 0;
};

/// Follows a ray by safe distances until one is shorter than `slack`, in the field's units. The ray never passes
/// through the surface, though it may stop where a more exact field would let it pass. From an origin outside the
/// domain the march starts where the ray enters the domain. `direction` need not have unit length. Throws `Error` if
/// the field has no bounds, for a direction of length 0 and for a slack that is not above 0.
SafeTrace safeTrace(const Field& field, const Vector3& origin, const Vector3& direction, double slack);

}  // namespace hpsdf
