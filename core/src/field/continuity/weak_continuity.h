#pragma once

#include "hpsdf/build_options.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/error.h"

namespace hpsdf {

/// Throws `Error` for a setting out of range.
void checkWeakContinuity(const WeakContinuity& options);

struct WeakContinuityFigures {
  int iterations = 0;
  double residual = 0;
  double change = 0;
};

/// As `weaklyContinuous`, of coefficients in double, which stay so, and where TBB is called.
WeakContinuityFigures makeWeaklyContinuous(FieldData& field, const WeakContinuity& options, const Progress& progress);

}  // namespace hpsdf
