#pragma once
// Sections of the field with planes in the picture of a surface.

#include "hpsdf/field.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Shows the section of the solid (f below the offset) with the view's clipping plane, in place of what lies behind it:
/// the section's cells and values, and the plane's normal towards the eye. Does nothing without a clipping plane.
void addSection(const Field& field, const SurfaceView& view, ViewBuffers& buffers);

/// Shows the section of the domain with the plane of `plane` where it is the nearest thing to the eye, except the part
/// that the view's clipping plane removes. Each pixel shows the cell that a slice has at that point.
void addPlane(const Field& field, const SurfaceView& view, const SliceView& plane, ViewBuffers& buffers);

/// The axis that a direction is parallel to, or −1.
int axisAlong(const Vector3& direction);

/// Shows a cell in a pixel, except for f: at a distance along the pixel's ray, on a plane whose normal is turned to the
/// eye.
void showCell(const Cell& cell, Shown shown, double distance, const Vector3& normal, const Vector3& ray,
              std::size_t pixel, ViewBuffers& buffers);

/// Fills `shown` for buffers that show a surface alone, so that other parts of the scene can be added.
inline void prepareShown(ViewBuffers& buffers) { buffers.shown.resize(buffers.cell.size(), Shown::surface); }

}  // namespace hpsdf::render
