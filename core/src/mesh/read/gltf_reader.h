#pragma once

#include "hpsdf/triangle_mesh.h"
#include "mesh/scan/input.h"

namespace hpsdf::mesh {

/// Reads the triangles of a glTF 2.0 file, .gltf or .glb: of all meshes in the file's scene, as often as its nodes show
/// them, under the nodes' transforms. Quantized attributes, sparse accessors, strips and fans, meshes compressed by
/// Draco and instances (EXT_mesh_gpu_instancing) are read. Skins and morph targets are left out: a mesh stands as its
/// node places it. Throws `Error` for a file that is damaged, or that requires an extension that is not known.
TriangleMesh readGltf(Input& input);

}  // namespace hpsdf::mesh
