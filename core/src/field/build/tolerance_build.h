#pragma once

#include "hpsdf/build_options.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {

/// Builds a field within `BuildOptions::tolerance`, and seeks the one that takes the fewest bytes. Its coefficients are
/// rounded, and its bounds computed, as the options ask for. Makes a forecast before a tenth of the work is done.
/// Throws `Error` if the field does not fit into the allowed memory: at the latest when the forecast is made if that
/// shows it.
FieldData buildWithinTolerance(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                               const Progress& progress);

}  // namespace hpsdf::detail
