#pragma once
// Triangle meshes beside a field's surface: rigid bodies, many of few meshes, and meshes whose vertices move, as cloth.

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

/// A colour for the body of this index: neighbours differ, and none is near the clay of a field's surface.
Color bodyColor(std::size_t index);

/// The clay of a field's surface where colours mean nothing, for bodies that are to look like one.
Color surfaceColor();

/// A mesh somewhere in the world.
struct Body {
  std::uint32_t mesh = 0;  ///< index among those of the renderer
  Eigen::Isometry3d worldFromBody = Eigen::Isometry3d::Identity();
  Color color = bodyColor(0);
};

/// What the pixels of a view see of bodies, rows top to bottom, in the conventions of `ViewBuffers`: along a pixel's
/// ray the nearer of the two is what the pixel shows. Where there is no body, `body` is kNoBody and the rest 0.
struct BodyBuffers {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> body;      ///< index among those drawn
  std::vector<std::uint32_t> triangle;  ///< index in its mesh
  /// Unit, of the side that one sees: meshes may be open, or closed and turned inside out. Interpolated where the mesh
  /// is smooth, so that at a silhouette it may turn a little away from the eye.
  std::vector<Eigen::Vector3f> normal;
  std::vector<float> distance;  ///< from where the ray starts, world units

  bool hit(std::size_t pixel) const { return body[pixel] != kNoBody; }
};

/// Fills the buffers of bodies of some meshes. Not thread-safe; one renderer a thread.
class BodyRenderer {
 public:
  virtual ~BodyRenderer() = default;

  /// In perspective what is nearer to the plane of the eye than 1e-5 of the farthest body is not seen; of parallel
  /// rays, what lies before the plane where they start. The camera's forward, right and up are at right angles. Throws
  /// `Error` for a view of more than 64 Mi pixels, before memory is taken, and for bodies as `bounds` does.
  virtual BodyBuffers view(const Camera& camera, std::span<const Body> bodies, int width, int height) = 0;

  /// Gives a mesh other vertices; as many as it has, its triangles stay. Throws `Error` for another number, for
  /// coordinates that are not finite or for a mesh that is not there; the mesh then is what it was.
  virtual void moveVertices(std::size_t mesh, std::span<const Vector3> vertices) = 0;

  /// A box that holds these bodies, world units; empty without any. Throws `Error` for more than 2^24 bodies, for one
  /// whose mesh is not there, and for a transform that is not finite or not rigid, naming it.
  virtual Box bounds(std::span<const Body> bodies) const = 0;

  /// What does the work, as of a `Renderer`.
  virtual std::string description() const = 0;
};

/// The oracle: each pixel's ray against the triangles in double precision, without OpenGL. Throws `Error` for a mesh
/// without triangles, with coordinates that are not finite (or beyond 1e15) or with a triangle of vertices that are not
/// there, and for more than 2^26 triangles in all, naming the mesh.
std::unique_ptr<BodyRenderer> makeCpuBodyRenderer(std::vector<TriangleMesh> meshes);

/// OpenGL, as of a field: each mesh is uploaded once, and each body is an instance. Which triangle a pixel sees is
/// OpenGL's, with corners rounded to some 1/256 of a pixel; distance and normal follow from it in double precision.
/// Throws as above, and when no device serves.
std::unique_ptr<BodyRenderer> makeGlBodyRenderer(std::vector<TriangleMesh> meshes,
                                                 GlChoice choice = GlChoice::automatic);

}  // namespace hpsdf::render
