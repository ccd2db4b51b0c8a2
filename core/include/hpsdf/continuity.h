#pragma once
// Two methods that reduce or remove the jumps of a field between its leaves.

#include "hpsdf/build_options.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// The result of weak continuity.
struct WeaklyContinuous {
  Field field;
  int iterations = 0;
  double residual = 0;  ///< residual at the end divided by that at the start
  double change = 0;  ///< RMS change √(‖f − f₀‖²/|Ω|); as f₀ is a projection, error² = error₀² + change²
};

/// Minimises the weighted sum of a field's jumps and of its change (Koschier et al. 2017). The result has the same
/// leaves, degrees and bytes, and does not depend on `threads` (0: all that the machine offers). Float coefficients are
/// converted to double and rounded again at the end. The metadata gets the weight λ, and its error estimates grow by
/// the change and the second rounding. Bounds are dropped because they do not hold for the new polynomials.
///
/// Throws `Error` for options out of range, for a field that is weakly continuous already, because its original
/// polynomials f₀ are lost, and if `maxIterations` do not reach the tolerance; `Cancelled` when `progress` says so.
WeaklyContinuous weaklyContinuous(const Field& field, const WeakContinuity& options = {}, int threads = 0,
                                  const Progress& progress = {});

/// Returns the same leaves with blending (`FieldData::blend`), which makes value and gradient continuous throughout the
/// domain. `width` is the width of the blend zones in edges of a leaf, up to `kMaxBlend`: wider zones are smoother, and
/// more queries evaluate several leaves. A width of 0 removes the blending. Bounds are dropped because they do not hold
/// for the new field. Throws `Error` for a width out of range.
Field blended(const Field& field, double width = kDefaultBlend);

}  // namespace hpsdf
