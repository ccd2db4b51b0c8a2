#pragma once

#include <cstdint>

#include "hpsdf/detail/field_data.h"

namespace hpsdf {

/// Calls f(index) for each triangle of an exact leaf's list. `leaf` is the packed node.
template <typename F>
void forEachTriangle(const ExactTriangles& exact, std::uint64_t leaf, const F& f) {
  for (const std::uint32_t* run = &exact.lists[node::offset(leaf)];; ++run) {
    const std::uint32_t first = triangle_run::first(*run), end = first + triangle_run::length(*run);
    for (std::uint32_t triangle = first; triangle < end; ++triangle) f(triangle);
    if (triangle_run::isLast(*run)) return;
  }
}

}  // namespace hpsdf
