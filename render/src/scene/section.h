#pragma once
// Sections of the field with planes in the picture of a surface.

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Shows the section of the solid (where f is below the offset) with the view's clipping plane, in front of everything
/// else. The pixels of the section get its cells and values, and the plane's normal towards the eye. Does nothing
/// without a clipping plane.
void addSection(const Field& field, const SurfaceView& view, ViewBuffers& buffers);

/// Shows the section of the domain with the plane of the slice `plane`, in pixels where this section is nearer to the
/// eye than the point that the buffers show. Omits the part that the view's clipping plane removes. Each point of
/// the section shows the same cell as in a picture of the slice.
void addPlane(const Field& field, const SurfaceView& view, const SliceView& plane, ViewBuffers& buffers);

/// Returns the number of the axis that a direction is parallel to, or −1 if there is none.
int axisAlong(const Vector3& direction);

/// Makes a pixel show a cell on a plane, at a distance along the pixel's ray. Sets all buffers of the pixel except the
/// field's value. The plane's normal is turned towards the eye.
void showCell(const Cell& cell, Shown shown, double distance, const Vector3& normal, const Vector3& ray,
              std::size_t pixel, ViewBuffers& buffers);

/// Fills the buffer `shown` with `Shown::surface` if it is empty. Other parts of the scene can then be added.
inline void prepareShown(ViewBuffers& buffers) { buffers.shown.resize(buffers.cell.size(), Shown::surface); }

}  // namespace hpsdf::render
