#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"
#include "mesh/patches.h"

namespace hpsdf {

/// The bodies of a surface. Patches are one that only together are closed: at every edge as many sides run one way as
/// the other, and a solid lies between them. Those of solids that touch along an edge or in a wall are apart.
/// Any other patch is one of its own.
struct Bodies {
  std::vector<std::uint32_t> of;  ///< each patch's: the lowest of its patches
  std::vector<char> closed;       ///< 1 for patches of closed bodies, each with two sides
};

/// `sides`: by edge, of the mesh that `patches` is of, whose faces look one way within each of them but the one-sided.
Bodies bodiesOf(const TriangleMesh& mesh, const Patches& patches, std::span<const Side> sides);

}  // namespace hpsdf
