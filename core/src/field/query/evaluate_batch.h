#pragma once

#include <span>

#include "hpsdf/detail/field_data.h"
#include "hpsdf/detail/lookup_grid.h"

namespace hpsdf::query {

/// Evaluates a field at many points. The results equal those of single queries to the bit, on every instruction set.
void evaluateBatch(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                   std::span<double> out);
void evaluateBatch(const FieldData& field, const LookupGrid& lookupGrid, std::span<const Vector3> points,
                   std::span<ValueAndGradient> out);

}  // namespace hpsdf::query
