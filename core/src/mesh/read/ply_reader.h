#pragma once

#include "hpsdf/triangle_mesh.h"
#include "mesh/scan/input.h"

namespace hpsdf::mesh {

/// Reads a PLY file: text or binary data of either byte order, with any elements and properties in any order. Of the
/// element `vertex` the properties x, y and z count, of `face` the list `vertex_indices` or `vertex_index`, of
/// `tristrips` the list `vertex_indices`, in which a negative number ends a strip. Throws `Error` that names the line
/// or the element for a file that is damaged, and for one that holds less or more than its header promises. Source:
/// Turk, The PLY Polygon File Format (1994), and files of MeshLab, VTK and the Stanford repository.
TriangleMesh readPly(Input& input);

}  // namespace hpsdf::mesh
