#pragma once
// Proven bounds of a field's error, and safe distances from the surface that follow from these bounds.
//
// A signed distance Φ is 1-Lipschitz, |Φ(x) − Φ(y)| ≤ |x − y|. Therefore each exact value of Φ bounds Φ at all other
// points from above and from below. Together with bounds of a leaf's polynomial f, these bounds of Φ give a bound of
// |f − Φ| over the whole leaf (`CellBound`).
//
// An exact leaf measures the same distance as Φ, so that its error consists of rounding errors alone. They follow from
// the leaf's triangles, without evaluations of Φ. In the zones of a blended field, an exact leaf is evaluated outside
// its box, where its list may lack the nearest triangles; it does not if the field was built with blending.
//
// The bounds hold if Φ is the signed distance of a closed surface without self-intersections. Near the holes of an open
// mesh, and wherever else the sign of Φ is wrong, Φ jumps and no bound holds.

#include <cstdint>
#include <optional>

#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// Returns a copy of `field` with a proven error bound (`CellBound`) for each leaf. The function evaluates Φ at 48
/// points per leaf that is a polynomial and, with blending, at 24 points for each exact leaf that touches it. If Φ is a
/// distance to triangles, some of the points lie outside the domain. Φ must be the distance that the field was made
/// from. `exactEvaluations` in the metadata includes these evaluations. The result does not depend on `threads` (0: all
/// that the machine offers). Throws `Error` if Φ is not finite. Throws `Cancelled` when `progress` says so.
Field withBounds(const Field& field, const DistanceFunction& distance, int threads = 0, const Progress& progress = {});

/// Returns the error bound of the leaf that holds x or, for x outside the domain, of the leaf that holds the domain's
/// closest point to x. Returns std::nullopt if the field has no bounds.
std::optional<CellBound> boundAt(const Field& field, const Vector3& x);

/// Returns the radius of a ball around x that the surface certainly does not enter: |f(x)| minus the error bound at x,
/// and at least 0. For x outside the domain, the radius is the safe distance at the domain's closest point minus the
/// distance from x to this point. Throws `Error` if the field has no bounds.
double safeDistance(const Field& field, const Vector3& x);

/// The result of `safeTrace`.
struct SafeTrace {
  double length = 0;  ///< length, in the field's units, that the ray certainly goes without touching the surface
  /// True if the surface may lie within `slack` of the ray's point at `length`; far from the domain, rounding may
  /// enlarge the slack. False if the ray left the domain.
  bool mayTouch = false;
  int steps = 0;
};

/// Follows a ray by steps of the safe distance until a safe distance is shorter than `slack`, in the field's
/// units. The ray never passes through the surface, though it may stop at a place where a more exact field
/// would let it pass. If the origin lies outside the domain, the march starts where the ray enters the domain.
/// `direction` need not have unit length. Throws `Error` if the field has no bounds, for a direction of length
/// 0, and for a slack that is not above 0.
SafeTrace safeTrace(const Field& field, const Vector3& origin, const Vector3& direction, double slack);

}  // namespace hpsdf
