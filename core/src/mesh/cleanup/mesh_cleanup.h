#pragma once

#include "hpsdf/mesh_report.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::mesh {

/// `cleaned` of mesh_file.h.
ImportedMesh cleanMesh(TriangleMesh mesh);

}  // namespace hpsdf::mesh
