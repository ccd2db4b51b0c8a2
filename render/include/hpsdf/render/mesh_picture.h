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
  /// The camera, which orbits the centre of the mesh by default. `camera.distance` is in diagonals of a cube around
  /// the mesh.
  OrbitCamera camera;
  int width = 1280;
  int height = 720;
  int samples = 1;     ///< samples per pixel along each axis, 1 to 8
  bool whole = false;  ///< replaces the camera's distance by the least distance that shows the whole mesh
};

/// A function that makes a renderer for bodies with the given meshes, for example `makeCpuBodyRenderer`.
using MakeBodyRenderer = std::function<std::unique_ptr<BodyRenderer>(std::vector<TriangleMesh>)>;

/// Draws a mesh and its defects. Front faces are clay-coloured, back faces blue, and faces that cross other faces pale
/// red. Boundary, non-manifold and inconsistent edges are drawn as lines, dashed where hidden. A ring surrounds each
/// defect that is small in the picture. `defects` are the defects of `mesh`. The mesh may have any position and size,
/// because `make` receives a copy that is moved near the origin and scaled to a size near 1. Throws `Error` if a size,
/// the camera or the mesh is out of range.
Image drawMesh(const MakeBodyRenderer& make, const TriangleMesh& mesh, const MeshDefects& defects,
               const MeshPicture& picture);

/// A function that draws a bare view, `width` × `height` pixels, from a camera.
using DrawView = std::function<Image(const OrbitCamera& camera, int width, int height)>;

/// Returns a function that draws views of a mesh in the way in which bare pictures show the surface of a field over
/// `domain`: clay-coloured, and with the camera relative to this domain. Thus the mesh can stand for its field while
/// that is built. The mesh is passed to `make` once, moved and scaled as for `drawMesh`. Throws `Error` as `make` does;
/// the returned function throws `Error` if a size or the camera is out of range.
DrawView meshView(const MakeBodyRenderer& make, const TriangleMesh& mesh, const Box& domain);

}  // namespace hpsdf::render
