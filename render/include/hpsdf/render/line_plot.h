#pragma once
// A plot of a field along a straight line, which shows jumps most clearly.

#include <span>

#include "hpsdf/detail/line.h"
#include "hpsdf/render/image.h"

namespace hpsdf::render {

/// Draws several charts over the distance along the line: f with the exact distance; the error f − exact on
/// a scale of its own; |∇f| with the slope of f along the line; and bands of the cells' degrees and depths.
/// Thin lines through all charts mark the borders of cells. `exact` holds the exact distance at each sample
/// of the line. If `exact` is empty, the jumps of f at cell borders are drawn instead of the error. A small
/// picture omits the lower charts. Throws `Error` if the size is out of range, 16 to 16384 pixels.
Image drawLine(const Field& field, const Line& line, std::span<const double> exact, int width, int height);

}  // namespace hpsdf::render
