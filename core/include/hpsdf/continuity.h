#pragma once
// Two methods that reduce or remove the jumps of a field between its leaves: weak continuity and blending.

#include "hpsdf/build_options.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// The result of `weaklyContinuous`.
struct WeaklyContinuous {
  Field field;
  int iterations = 0;
  double residual = 0;  ///< final residual of the conjugate gradient method divided by its initial residual
  /// RMS of f − f₀ over the domain, where f is the new field and f₀ the original field. The RMS errors of both fields
  /// satisfy error(f)² = error(f₀)² + change², because f₀ is an L2 projection.
  double change = 0;
};

/// Returns the field that minimises a weighted sum of its squared jumps between leaves and its squared change from
/// `field` (Koschier et al. 2017). The result has the same leaves, degrees and bytes as `field`, and does not depend on
/// `threads` (0: all that the machine offers). Float coefficients are converted to double and rounded again at the end.
/// In the metadata of the result, the weight λ is stored, and the error estimates grow by the change of the field and
/// by the second rounding. The proven bounds of `field`, and the tolerance within which it was built, are dropped
/// because they do not hold for the new polynomials. Exact leaves, and the linear polynomials in their place where the
/// surface is plane, do not change; their neighbours adapt to them.
///
/// Throws `Error` for options out of range; for a field that is weakly continuous already, because its original
/// polynomials f₀ are lost; and if the tolerance is not reached within `maxIterations`. Throws `Cancelled` when
/// `progress` says so.
WeaklyContinuous weaklyContinuous(const Field& field, const WeakContinuity& options = {}, int threads = 0,
                                  const Progress& progress = {});

/// Returns a copy of `field` in which neighbouring leaves are blended (`FieldData::blend`), so that value and gradient
/// are continuous throughout the domain. `width` is the width of the blended zones relative to the edge of a leaf, up
/// to `kMaxBlend`: the wider the zones, the smoother the field, and the more queries evaluate several leaves. A width
/// of 0 removes the blending. The proven bounds of `field`, and the tolerance within which it was built, are dropped
/// because they do not hold for the new field.
///
/// Exact leaves of a field that was built without blending list the triangles that are nearest within the leaf. In the
/// zones beyond it, their distance may be too great, and may jump where its sign is uncertain. To avoid this, build the
/// field with `BuildOptions::blend`.
///
/// Throws `Error` for a width out of range.
Field blended(const Field& field, double width = kDefaultBlend);

}  // namespace hpsdf
