#pragma once

#include "hpsdf/build_options.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/error.h"

namespace hpsdf::continuity {

/// The figures that `weaklyContinuous` returns besides the field, see `WeaklyContinuous`.
struct WeakContinuityFigures {
  int iterations = 0;
  double residual = 0;
  double change = 0;
};

/// Reduces the jumps of a field between leaves like `weaklyContinuous`, but in place. The field's coefficients
/// must be double. Runs on the caller's TBB threads.
WeakContinuityFigures makeWeaklyContinuous(FieldData& field, const WeakContinuity& options, const Progress& progress);

}  // namespace hpsdf::continuity
