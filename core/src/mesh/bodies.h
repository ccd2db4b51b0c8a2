#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/patches.h"

namespace hpsdf {

/// The bodies of a surface. Patches that only together are closed are one: at every edge as many sides run one way as
/// the other, as where bodies share a wall. Any other patch is one of its own.
struct Bodies {
  std::vector<std::uint32_t> of;  ///< each patch's: the lowest of its patches
  std::vector<char> closed;       ///< 1 for patches of closed bodies, each with two sides
};

/// `sides`: by edge, of the faces that `patches` is of, which look one way within each of them but the one-sided.
Bodies bodiesOf(const Patches& patches, std::span<const Side> sides);

}  // namespace hpsdf
