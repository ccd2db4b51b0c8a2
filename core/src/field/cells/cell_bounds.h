#pragma once

// Proven upper bounds of the error and of the slope of the field in each leaf.

#include <cstdint>

#include "hpsdf/detail/field_data.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {

/// Computes proven bounds of the error and of the slope in each leaf, and stores them in `field.bounds`; see
/// `withBounds`. Uses the threads of the calling TBB arena. Returns the number of evaluations of the exact distance.
std::uint64_t findBounds(FieldData& field, const DistanceFunction& distance, const Progress& progress);

}  // namespace hpsdf::detail
