#pragma once

#include <span>

#include "contour/cells/implicit_surface.h"
#include "hpsdf/types.h"

namespace hpsdf::contouring {

/// Moves points along the gradient to the zero set, by Newton steps, until the magnitude of the function is at most
/// `accuracy`. A point with which that fails ends where the least magnitude was found. Sets `magnitudes` to those at
/// the points. Where `rooms` are given, one for each point, the points are kept in these boxes.
void projectOntoSurface(const ImplicitSurface& surface, double accuracy, std::span<Vector3> points,
                        std::span<double> magnitudes, std::span<const Box> rooms = {});

}  // namespace hpsdf::contouring
