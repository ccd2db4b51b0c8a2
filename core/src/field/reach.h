#pragma once

#include <vector>

#include "hpsdf/field.h"

namespace hpsdf {

/// Of every leaf (`namespace reach`), by node; 0 for internal nodes.
std::vector<std::uint32_t> findReaches(const FieldData& field);

}  // namespace hpsdf
