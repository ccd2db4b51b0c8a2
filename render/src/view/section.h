#pragma once
// Planes in the picture of a surface.

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Where the view's clipping plane cuts the solid (f below the offset), the buffers show the plane instead of what lies
/// behind it: its cells and values, the normal towards the eye. Nothing without a clipping plane.
void addSection(const Field& field, const SurfaceView& view, ViewBuffers& buffers);

/// The whole section of the domain with the plane that `plane` lies in, but for what the view's clipping plane removes,
/// before what lies behind it. Cells are those of a slice there.
void addPlane(const Field& field, const SurfaceView& view, const SliceView& plane, ViewBuffers& buffers);

/// Makes `shown` ready for more than a surface.
inline void prepareShown(ViewBuffers& buffers) { buffers.shown.resize(buffers.cell.size(), Shown::surface); }

}  // namespace hpsdf::render
