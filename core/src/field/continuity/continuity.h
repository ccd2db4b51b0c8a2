#pragma once

#include "hpsdf/build_options.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/error.h"

namespace hpsdf::continuity {

/// The figures of `WeaklyContinuous`.
struct WeakContinuityFigures {
  int iterations = 0;
  double residual = 0;
  double change = 0;
};

/// Does what `weaklyContinuous` does to a field with coefficients in double, on the caller's TBB threads.
WeakContinuityFigures makeWeaklyContinuous(FieldData& field, const WeakContinuity& options, const Progress& progress);

}  // namespace hpsdf::continuity
