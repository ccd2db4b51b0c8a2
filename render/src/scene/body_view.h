#pragma once
// Parts of a view of bodies that both body renderers share.

#include "scene/body_meshes.h"

namespace hpsdf::render {

/// Throws `Error` for a camera or a size that `BodyRenderer::view` refuses.
void checkBodyView(const Camera& camera, int width, int height);

/// Depth of the farthest corner of a box, along `forward` from the eye; 1 where no corner lies in front of the
/// eye.
double farthestDepth(const Camera& camera, const Box& box);

/// The least visible depth, which `BodyRenderer::view` states, for bodies whose farthest depth is `farthest`.
double leastDepth(const Camera& camera, double farthest);

/// Buffers in which no pixel shows a body.
BodyBuffers emptyBodyBuffers(int width, int height);

/// The point of a body that a pixel sees.
struct BodyPoint {
  std::uint32_t body, triangle;
  double distance;  ///< along the pixel's ray from its start, world units
  Vector3 barycentric;
  bool fromBehind;  ///< whether the ray meets the side from which the triangle's corners run clockwise
};
void showBody(const BodyMeshes& meshes, std::span<const Body> bodies, const BodyPoint& point, std::size_t pixel,
              BodyBuffers& buffers);

/// Shows in `buffers` each body that is nearer than what the pixel shows.
void addBodies(const BodyBuffers& bodies, ViewBuffers& buffers);

/// The camera, with the start of its parallel rays moved back in front of the box; a perspective camera stays as
/// it is.
Camera startingBefore(const Box& box, const Camera& camera);

}  // namespace hpsdf::render
