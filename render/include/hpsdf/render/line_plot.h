#pragma once
// A plot of a field along a straight line, which shows jumps most clearly.

#include <span>

#include "hpsdf/detail/line.h"
#include "hpsdf/render/image.h"

namespace hpsdf::render {

/// Draws charts over the distance along the line: f with the exact distance; the error f − exact on a scale of its own;
/// |∇f| with the slope along the line; and bands of the cells' degrees and depths. The borders of cells run through all
/// charts as thin lines. `exact` holds the exact distance at each sample of the line; where it is empty, the jumps of f
/// at the borders replace the error. A small picture leaves out the lower charts. Throws `Error` for a size out of
/// range, 16 to 16384 pixels.
Image drawLine(const Field& field, const Line& line, std::span<const double> exact, int width, int height);

}  // namespace hpsdf::render
