#pragma once
// Pictures of bodies that are triangle meshes. Many rigid bodies may share one mesh. The vertices of a mesh
// may also move, like those of cloth.

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

/// Returns the colour of the body with this index. The colours of consecutive indices differ, and no colour is close to
/// the clay colour of a field's surface (`surfaceColor`).
Color bodyColor(std::size_t index);

/// The clay colour of a field's surface in pictures without a colour scale.
Color surfaceColor();

/// A rigid body: a mesh with a position and an orientation in the world.
struct Body {
  std::uint32_t mesh = 0;  ///< index in the list of meshes from which the renderer was made
  Eigen::Isometry3d worldFromBody = Eigen::Isometry3d::Identity();
  Color color = bodyColor(0);
};

/// The body that each pixel of a view shows, in rows from top to bottom. `distance` is measured as in `ViewBuffers`, so
/// that bodies and a field's surface can hide each other. For a pixel that shows no body, `body` is kNoBody and the
/// other buffers are 0.
struct BodyBuffers {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> body;      ///< index of the body in the list of drawn bodies
  std::vector<std::uint32_t> triangle;  ///< index of the triangle in the body's mesh
  /// The unit normal at the visible point. It is flipped if the eye sees the back of the triangle, because meshes may
  /// be open or wrongly oriented. Where the mesh is smooth, the normal is interpolated between the triangle's corners.
  /// An interpolated normal may point slightly away from the eye at a silhouette.
  std::vector<Eigen::Vector3f> normal;
  std::vector<float> distance;  ///< distance along the ray from its start to the body, world units

  bool hit(std::size_t pixel) const { return body[pixel] != kNoBody; }
};

/// Renders views of bodies into buffers. Each body refers to a mesh in a fixed list. Not thread-safe: use one renderer
/// for each thread.
class BodyRenderer {
 public:
  virtual ~BodyRenderer();

  /// Renders bodies. In a perspective view, nothing is visible at depths below 1e-5 of the farthest body's
  /// depth. With parallel rays, nothing is visible in front of the plane in which the rays start. The
  /// camera's forward, right and up vectors must be perpendicular. Throws `Error` if the view has more than
  /// 64 Mi pixels, before memory is allocated, and for invalid bodies as `bounds` does.
  virtual BodyBuffers view(const Camera& camera, std::span<const Body> bodies, int width, int height) = 0;

  /// Replaces the vertex positions of a mesh, in world units; the mesh keeps its triangles. Throws `Error`,
  /// and leaves the mesh unchanged, if the number of vertices differs, if coordinates are not finite, or if
  /// no mesh has this index.
  virtual void moveVertices(std::size_t mesh, std::span<const Vector3> vertices) = 0;

  /// Returns a box that contains all bodies, in world units; the box is empty if there are no bodies. Throws
  /// `Error` if there are more than 2^24 bodies. Throws `Error`, which names the body, if a body's mesh does
  /// not exist or if its transform is not finite or not rigid.
  virtual Box bounds(std::span<const Body> bodies) const = 0;

  /// Returns the name of the rendering device, as `Renderer::description` does.
  virtual std::string description() const = 0;
};

/// Makes the reference renderer, which intersects the ray of each pixel with the triangles in double
/// precision, without OpenGL. Throws `Error`, which names the mesh, if a mesh has no triangles, has
/// coordinates that are not finite or beyond 1e15, or has vertex indices out of range. Throws `Error` if
/// all meshes together have more than 2^26 triangles.
std::unique_ptr<BodyRenderer> makeCpuBodyRenderer(std::vector<TriangleMesh> meshes);

/// Makes a renderer that uses OpenGL. Each mesh is uploaded once, and each body is an instance of its mesh. OpenGL
/// determines which triangle a pixel shows, after rounding the corners to about 1/256 of a pixel. Distance and normal
/// are then computed in double precision. Throws `Error` as `makeCpuBodyRenderer` does, and if no device offers OpenGL
/// 4.5.
std::unique_ptr<BodyRenderer> makeGlBodyRenderer(std::vector<TriangleMesh> meshes,
                                                 GlChoice choice = GlChoice::automatic);

}  // namespace hpsdf::render
