#pragma once
// Fields without jumps, made from others.

#include "hpsdf/field.h"

namespace hpsdf {

/// A query takes twice as long on average at most, and the gradient's error near faces stays that of the leaves
/// (docs/decisions.md).
constexpr double kDefaultBlend = 0.04;

/// The same leaves, blended (`FieldData::blend`): value and gradient are continuous throughout the domain. `width` is
/// that of the blended zones as a part of a leaf's edges, up to `kMaxBlend`: the wider, the gentler they lead from leaf
/// to leaf, and the more queries ask several. 0 takes the blending off. Throws `Error` for a width out of range.
Field blended(const Field& field, double width = kDefaultBlend);

}  // namespace hpsdf
