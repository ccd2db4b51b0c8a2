#pragma once
// The lighting of the surface, of cell boxes and of bodies in a camera's picture.

#include <functional>
#include <vector>

#include "coloring/field_light.h"
#include "hpsdf/render/view.h"
#include "image/color.h"

namespace hpsdf::render {

/// The materials and the light of a view of a surface.
struct SurfaceLook {
  std::function<LinearColor(std::size_t)> color = {};  ///< unlit colour of a sample; if empty, plain materials
  std::vector<LinearColor> bodies = {};                ///< colour of each body
  FieldLight light = {};  ///< light measured by the field; without it, what a sample's neighbours hide is estimated
  double lightTilt = 0;   ///< angle in radians by which the lamps are turned about the camera's right axis
};

/// Returns the angle by which lamps are turned so that they shine from above, as on a photographer's set, when the
/// camera looks down. A camera that looks up or only slightly down takes the lamps with it.
double lightTiltOf(double elevationDegrees);

/// Returns the unit vector towards the key light in world coordinates.
Vector3 directionToKey(const Camera& camera, double lightTilt);

/// Returns a function that computes the lit colour of sample (x, y), which must show the surface, a box or a body.
/// The returned function keeps references to `buffers` and `look`.
std::function<LinearColor(int x, int y)> surfaceShader(const ViewBuffers& buffers, const Camera& camera,
                                                       const SurfaceLook& look);

}  // namespace hpsdf::render
