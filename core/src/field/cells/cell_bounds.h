#pragma once

// Proven bounds of the error and the slope of each leaf.

#include <cstdint>

#include "hpsdf/detail/field_data.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {

/// Sets `field.bounds` to proven bounds of each leaf, see `withBounds`. Uses the threads of the calling TBB arena.
/// Returns the number of evaluations of Φ.
std::uint64_t findBounds(FieldData& field, const DistanceFunction& distance, const Progress& progress);

}  // namespace hpsdf::detail
