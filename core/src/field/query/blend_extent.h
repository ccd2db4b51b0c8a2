#pragma once

#include <vector>

#include "hpsdf/detail/field_data.h"

namespace hpsdf {

/// Of every leaf (`namespace reach`), by node; 0 for internal nodes.
std::vector<std::uint32_t> findBlendExtents(const FieldData& field);

}  // namespace hpsdf
