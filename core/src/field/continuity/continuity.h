#pragma once

#include "hpsdf/build_options.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/error.h"

namespace hpsdf::continuity {

/// The figures that `WeaklyContinuous` reports besides the field.
struct WeakContinuityFigures {
  int iterations = 0;
  double residual = 0;
  double change = 0;
};

/// Does the same as `weaklyContinuous`, but in place, for a field whose coefficients are double. Runs on the
/// caller's TBB threads.
WeakContinuityFigures makeWeaklyContinuous(FieldData& field, const WeakContinuity& options, const Progress& progress);

}  // namespace hpsdf::continuity
