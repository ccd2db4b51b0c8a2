#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/directed_edges.h"
#include "mesh/disjoint_sets.h"

namespace hpsdf::mesh {

/// The components of a surface: sets of triangles that are connected by edges of any number of triangles. `edges` are
/// the directed edges of `faces` triangles, sorted by edge.
DisjointSets componentsOf(std::size_t faces, std::span<const DirectedEdge> edges);

/// The patches of a surface: sets of triangles that are connected by edges of exactly two triangles. The triangles of a
/// patch can be reversed until all agree in orientation, unless the patch is one-sided, as a Möbius strip is.
struct Patches {
  std::size_t count = 0;
  std::vector<std::uint32_t> patchOf;  ///< the patch of each triangle; patches are numbered by their lowest triangles
  std::vector<char> against;           ///< 1 for triangles oriented opposite to their patch's lowest triangle
  std::vector<char> oneSided;          ///< 1 for patches that have no consistent orientation
};

/// `edges` are the directed edges of `faces` triangles, sorted by edge.
Patches patchesOf(std::size_t faces, std::span<const DirectedEdge> edges);

}  // namespace hpsdf::mesh
