#pragma once
// The light that reaches the points of a surface and of the ground below it, measured by queries of the field. Both
// renderers' pictures use it, since it reads the field and the buffers alone.

#include <optional>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// The light at each sample of a view, 0 to 1. Samples that show neither the surface nor the ground have 1.
struct FieldLight {
  std::vector<float> open;  ///< share of the ambient light that reaches the point; empty if it was not measured
  std::vector<float> lit;   ///< share of the key light that reaches the point; empty likewise
};

/// The solid that casts shadows: f < offset, without the part that a clipping plane removes.
struct ShadowCaster {
  const Field& field;
  SurfaceView view;
  UpAxis up = UpAxis::y;
  bool onGround = false;     ///< if true, the solid stands on a plane, on which its shadow falls
  bool amongBodies = false;  ///< if true, the ambient light is not measured: the field does not know what bodies take
};

/// Measures the light at the samples of `buffers`, which hold samples × samples for each pixel. Samples of a pixel that
/// show an even piece of a surface are measured together. `toKey` is the unit vector towards the key light.
///
/// The ambient light is lessened where the field, at a few points along the normal, is lower than the distance to the
/// surface's own point, as in a fold (Evans, "Fast Approximations for Global Illumination on Dynamic Scenes", 2006).
/// The key light is followed towards the lamp by sphere tracing; the lowest ratio of field to length gives the shadow's
/// soft border (Quilez, "Soft shadows in raymarched SDFs", 2010).
FieldLight fieldLight(const ShadowCaster& caster, const ViewBuffers& buffers, int samples, const Vector3& toKey);

}  // namespace hpsdf::render
