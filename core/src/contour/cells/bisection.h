#pragma once

#include "contour/cells/implicit_surface.h"
#include "hpsdf/types.h"

namespace hpsdf::contouring {

/// Moves a point onto the zero set, by bisection towards the nearest corner of its room where the function has the
/// other sign, until the magnitude of the function is at most `accuracy`. Returns the point unchanged if that is so
/// already, or if there is no such corner. The room may be flat. It serves where steps along the gradient run back and
/// forth beside a sharp edge.
Vector3 bisected(const ImplicitSurface& surface, const Box& room, const Vector3& point, double accuracy);

}  // namespace hpsdf::contouring
