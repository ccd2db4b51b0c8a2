#pragma once
// Queries of many points: the same results to the bit as of one at a time, on every instruction set.

#include <span>

#include "hpsdf/field.h"

namespace hpsdf {

void answerBatch(const FieldData& field, const Directory& directory, std::span<const Vector3> points,
                 std::span<double> out);
void answerBatch(const FieldData& field, const Directory& directory, std::span<const Vector3> points,
                 std::span<ValueAndGradient> out);

}  // namespace hpsdf
