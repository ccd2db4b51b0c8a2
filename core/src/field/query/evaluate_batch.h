#pragma once
// Queries of many points: the same results to the bit as of one at a time, on every instruction set.

#include <span>

#include "hpsdf/detail/field_data.h"
#include "hpsdf/detail/lookup_grid.h"

namespace hpsdf {

void answerBatch(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                 std::span<double> out);
void answerBatch(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                 std::span<ValueAndGradient> out);

}  // namespace hpsdf
