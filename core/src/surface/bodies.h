#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/triangle_mesh.h"
#include "mesh/patches.h"

namespace hpsdf::surface {

/// The bodies of a surface. Patches form one body if they are closed only in union: at each of their edges as many
/// triangles run in one direction as in the other, and a solid lies between them. Solids that touch along an edge or in
/// a shared wall (`redundantFaces`) are different bodies. Every other patch is a body of its own.
struct Bodies {
  std::vector<std::uint32_t> ofPatch;  ///< for each patch its body: the lowest index of the body's patches
  std::vector<char> closed;            ///< for each patch 1 if its body is closed; such bodies have no one-sided patch
};

/// The faces of each patch must be oriented alike, except those of one-sided patches. `sides` are the directed edges of
/// the mesh, grouped by edge.
Bodies findBodies(const TriangleMesh& mesh, const mesh::Patches& patches, std::span<const mesh::DirectedEdge> sides);

}  // namespace hpsdf::surface
