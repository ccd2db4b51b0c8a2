#pragma once
// Pictures of triangle meshes: rigid bodies, many of which may share a mesh, and meshes whose vertices move, as cloth
// does.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hpsdf/render/image.h"
#include "hpsdf/render/renderer.h"
#include "hpsdf/render/view.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::render {

/// The colour of the body with this index. Colours of consecutive indices differ, and none is near `surfaceColor`.
Color bodyColor(std::size_t index);

/// The clay colour of a field's surface in pictures without a colour scale.
Color surfaceColor();

/// A mesh with a position and an orientation in the world.
struct Body {
  std::uint32_t mesh = 0;  ///< index of the mesh among those of the renderer
  Eigen::Isometry3d worldFromBody = Eigen::Isometry3d::Identity();
  Color color = bodyColor(0);
};

/// The bodies that the pixels of a view see, rows top to bottom. Distances can be compared with those of
/// `ViewBuffers`, so that the nearer of a body and the surface hides the other. A pixel without a body has `body`
/// kNoBody and 0 in the other buffers.
struct BodyBuffers {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> body;      ///< index of the body among those drawn
  std::vector<std::uint32_t> triangle;  ///< index of the triangle in the body's mesh
  /// The unit normal of the side of the triangle that faces the eye: meshes may be open or have the wrong orientation.
  /// The normal is interpolated where the mesh is smooth, so that it may point slightly away from the eye at a
  /// silhouette.
  std::vector<Eigen::Vector3f> normal;
  std::vector<float> distance;  ///< distance along the ray from its start to the body, world units

  bool hit(std::size_t pixel) const { return body[pixel] != kNoBody; }
};

/// Fills the buffers of bodies of a fixed list of meshes. Not thread-safe: use one renderer for each thread.
class BodyRenderer {
 public:
  virtual ~BodyRenderer();

  /// Renders bodies. In perspective, nothing is seen at depths below 1e-5 of the farthest body's depth; with
  /// parallel rays, nothing in front of the plane in which the rays start. Requires that the camera's forward, right
  /// and up vectors are at right angles. Throws `Error` for a view of more than 64 Mi pixels, before memory is
  /// taken, and for bodies as `bounds` does.
  virtual BodyBuffers view(const Camera& camera, std::span<const Body> bodies, int width, int height) = 0;

  /// Moves the vertices of a mesh, world units; its triangles stay. Throws `Error`, and leaves the mesh as it is, for
  /// another number of vertices, for coordinates that are not finite or for an index of no mesh.
  virtual void moveVertices(std::size_t mesh, std::span<const Vector3> vertices) = 0;

  /// A box that holds the bodies, world units; empty for no bodies. Throws `Error` for more than 2^24 bodies, and for a
  /// body whose mesh does not exist or whose transform is not finite or not rigid, naming the body.
  virtual Box bounds(std::span<const Body> bodies) const = 0;

  /// The name of the device, as in `Renderer::description`.
  virtual std::string description() const = 0;
};

/// The reference renderer: intersects the ray of each pixel with the triangles in double precision, without
/// OpenGL. Throws `Error`, naming the mesh, for a mesh without triangles, with coordinates that are not finite or
/// beyond 1e15, or with indices of no vertex; throws `Error` for more than 2^26 triangles in all.
std::unique_ptr<BodyRenderer> makeCpuBodyRenderer(std::vector<TriangleMesh> meshes);

/// Renders with OpenGL: each mesh is uploaded once, and each body is an instance of its mesh. OpenGL decides which
/// triangle a pixel sees, with corners rounded to about 1/256 of a pixel; distance and normal are computed from that
/// triangle in double precision. Throws as `makeCpuBodyRenderer` does, and when no device offers OpenGL 4.5.
std::unique_ptr<BodyRenderer> makeGlBodyRenderer(std::vector<TriangleMesh> meshes,
                                                 GlChoice choice = GlChoice::automatic);

}  // namespace hpsdf::render
