#pragma once

#include <vector>

#include "hpsdf/detail/field_data.h"

namespace hpsdf::query {

/// Returns the blend extents of every leaf (`namespace blend_extent`), by node; 0 for internal nodes.
std::vector<std::uint32_t> findBlendExtents(const FieldData& field);

}  // namespace hpsdf::query
