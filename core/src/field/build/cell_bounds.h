#pragma once

#include <cstdint>

#include "hpsdf/detail/field_data.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"

namespace hpsdf {

/// Fills `field.bounds` in, as `withBounds` does, where TBB is called. Returns the calls of Φ.
std::uint64_t findBounds(FieldData& field, const DistanceFunction& distance, const Progress& progress);

}  // namespace hpsdf
