#pragma once
// Sections of the field with planes in the picture of a surface.

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Shows the section of the solid (where f is below the offset) with the view's clipping plane. It replaces
/// what the buffers show behind it. Pixels get the section's cells and values, and the plane's normal towards
/// the eye. Does nothing without a clipping plane.
void addSection(const Field& field, const SurfaceView& view, ViewBuffers& buffers);

/// Shows the section of the domain with the plane of the slice `plane`, in pixels where the section is nearer
/// to the eye than what the buffers show. Leaves out the part that the view's clipping plane removes. Each
/// pixel shows the cell that a slice has at that point.
void addPlane(const Field& field, const SurfaceView& view, const SliceView& plane, ViewBuffers& buffers);

/// The axis that a direction is parallel to, or −1.
int axisAlong(const Vector3& direction);

/// Sets all buffers of a pixel except the field's value. The pixel shows a cell, at a distance along its ray,
/// on a plane. The plane's normal is turned towards the eye.
void showCell(const Cell& cell, Shown shown, double distance, const Vector3& normal, const Vector3& ray,
              std::size_t pixel, ViewBuffers& buffers);

/// Fills the buffer `shown` if it is empty because the buffers show only a surface. Other parts of the scene
/// can then be added.
inline void prepareShown(ViewBuffers& buffers) { buffers.shown.resize(buffers.cell.size(), Shown::surface); }

}  // namespace hpsdf::render
