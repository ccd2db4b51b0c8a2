#pragma once
// The outline of the exact surface in the picture of a plane.

#include "hpsdf/distance_function.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/view.h"

namespace hpsdf::app {

/// Draws, in the colour of exact leaves, the curve in which the plane of `view` meets the surface: the pixels beside
/// which the sign of `exact` changes.
void drawExactOutline(render::Image& image, const render::SliceView& view, const DistanceFunction& exact);

}  // namespace hpsdf::app
