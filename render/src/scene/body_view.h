#pragma once
// Functions for views of bodies, used by both the CPU and the OpenGL renderer of bodies.

#include "scene/body_meshes.h"

namespace hpsdf::render {

/// Throws `Error` if the camera or the size is invalid, as `BodyRenderer::view` states.
void checkBodyView(const Camera& camera, int width, int height);

/// Depth of the farthest corner of a box: its distance from the eye along `forward`. Returns 1 if no corner
/// lies in front of the eye.
double farthestDepth(const Camera& camera, const Box& box);

/// The depth below which a view of bodies shows nothing (see `BodyRenderer::view`). `farthest` is the greatest depth of
/// the bodies.
double leastDepth(const Camera& camera, double farthest);

/// Buffers in which no pixel shows a body.
BodyBuffers emptyBodyBuffers(int width, int height);

/// The point of a body that a pixel sees.
struct BodyPoint {
  std::uint32_t body, triangle;
  double distance;  ///< distance along the pixel's ray from its start, world units
  Vector3 barycentric;
  bool fromBehind;  ///< whether the ray meets the triangle's back, the side from which the corners run clockwise
};
void showBody(const BodyMeshes& meshes, std::span<const Body> bodies, const BodyPoint& point, std::size_t pixel,
              BodyBuffers& buffers);

/// Copies each pixel of `bodies` to `buffers` where the body is nearer to the eye than the point that `buffers` show.
void addBodies(const BodyBuffers& bodies, ViewBuffers& buffers);

/// Returns the camera with the start of its parallel rays moved back in front of the box. A perspective camera
/// is returned unchanged.
Camera startingBefore(const Box& box, const Camera& camera);

}  // namespace hpsdf::render
