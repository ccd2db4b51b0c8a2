#pragma once
// Fields that jump less where their leaves meet, or not at all.

#include "hpsdf/build_options.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// A field after the post-process, and what it took.
struct WeaklyContinuous {
  Field field;
  int iterations = 0;
  double residual = 0;  ///< reached, over the one at the start
  double change = 0;    ///< √(‖f − f₀‖²/|Ω|): f₀ being a projection, error² = error₀² + change²
};

/// The field whose jumps and whose change are least together. It has the same leaves, degrees and bytes; the result
/// does not depend on `threads` (0: all that the machine offers). Coefficients in float are taken to double and
/// rounded again at the end. Metadata: λ is noted, ε grows by the change as nearness weighs it, the rounding by the
/// second one. Bounds are left out: they would have to be found anew.
///
/// Throws `Error` for settings out of range, for a field that is weakly continuous already (f₀ is lost), and where
/// `maxIterations` do not reach the tolerance; `Cancelled` when asked to stop.
WeaklyContinuous weaklyContinuous(const Field& field, const WeakContinuity& options = {}, int threads = 0,
                                  const Progress& progress = {});

/// A query takes twice as long on average at most, and the gradient's error near faces stays that of the leaves
/// (docs/decisions.md).
constexpr double kDefaultBlend = 0.04;

/// The same leaves, blended (`FieldData::blend`): value and gradient are continuous throughout the domain. `width` is
/// that of the blended zones as a part of a leaf's edges, up to `kMaxBlend`: the wider, the gentler they lead from leaf
/// to leaf, and the more queries ask several. 0 takes the blending off. Bounds are
/// left out. Throws `Error` for a width out of range.
Field blended(const Field& field, double width = kDefaultBlend);

}  // namespace hpsdf
