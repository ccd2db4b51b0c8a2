#pragma once
// A field along a segment, as curves: the clearest view of a jump.

#include <span>

#include "hpsdf/detail/line.h"
#include "hpsdf/render/image.h"

namespace hpsdf::render {

/// Draws curves over the distance along the line: f and the exact distance; the error f − exact on a scale of its own;
/// |∇f| and the slope along the line; and bands of the cells' degrees and depths. The borders of cells run through all
/// of them as thin lines. `exact` holds the exact distance at each of the line's samples, or nothing where it is not
/// known: then the jumps of f at the borders take the error's place. What a small picture has no room for is left out,
/// from the bottom upwards. Throws `Error` for a size out of range, 16 to 16384 pixels.
Image drawLine(const Field& field, const Line& line, std::span<const double> exact, int width, int height);

}  // namespace hpsdf::render
