#pragma once
// A mesh as it is, before any field: which way its faces look, and where it has defects.

#include <functional>
#include <memory>
#include <vector>

#include "hpsdf/mesh_report.h"
#include "hpsdf/render/bodies.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/view.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::render {

struct MeshPicture {
  OrbitCamera
      camera;  ///< around the middle of the mesh; distances in diagonals of a cube about it, as of a field's domain
  int width = 1280;
  int height = 720;
  int samples = 1;     ///< an axis and pixel, 1 to 8
  bool whole = false;  ///< from as near as shows all of the mesh, whatever the camera's distance
};

/// Makes a renderer of some meshes, as `makeCpuBodyRenderer` does.
using MakeBodyRenderer = std::function<std::unique_ptr<BodyRenderer>(std::vector<TriangleMesh>)>;

/// Clay where faces look at the eye, blue where they are seen from behind, pale red where they meet others; edges that
/// are open, shared by more than two faces or run against each other as lines, small defects in rings; dashed what is
/// hidden. Coordinates may be of any size, wherever the mesh is: `make` gets it near the origin and near 1 in size.
/// `defects`: of this mesh. Throws `Error` for a size, a camera or a mesh out of range.
Image drawMesh(const MakeBodyRenderer& make, const TriangleMesh& mesh, const MeshDefects& defects,
               const MeshPicture& picture);

}  // namespace hpsdf::render
