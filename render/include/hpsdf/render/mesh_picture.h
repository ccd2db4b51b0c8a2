#pragma once
// A picture of a mesh alone, without a field: the orientation of its faces and its defects.

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
  /// The camera orbits the centre of the mesh. Its distances are in diagonals of a cube around the mesh, as they are
  /// in diagonals of the domain in the picture of a field.
  OrbitCamera camera;
  int width = 1280;
  int height = 720;
  int samples = 1;     ///< samples per pixel along each axis, 1 to 8
  bool whole = false;  ///< replaces the camera's distance by the nearest one that shows the whole mesh
};

/// Makes a renderer of some meshes, as `makeCpuBodyRenderer` does.
using MakeBodyRenderer = std::function<std::unique_ptr<BodyRenderer>(std::vector<TriangleMesh>)>;

/// Draws front faces in the colour of clay, back faces blue and faces that cross others pale red. Boundary,
/// non-manifold and inconsistent edges are lines, and a ring surrounds defects that are small in the picture; hidden
/// parts are dashed. The mesh may lie anywhere and have any size: `make` receives it near the origin with a size
/// near 1. `defects` are those of this mesh. Throws `Error` for a size, a camera or a mesh out of range.
Image drawMesh(const MakeBodyRenderer& make, const TriangleMesh& mesh, const MeshDefects& defects,
               const MeshPicture& picture);

}  // namespace hpsdf::render
