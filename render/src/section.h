#pragma once

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Where the view's clipping plane cuts the solid (f below the offset), the buffers show the plane instead of what lies
/// behind it: its cells and values, the normal towards the eye. Nothing without a clipping plane.
void addSection(const Field& field, const SurfaceView& view, ViewBuffers& buffers);

}  // namespace hpsdf::render
