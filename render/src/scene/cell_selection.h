#pragma once

#include <array>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/shown_cells.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// The leaves of the chosen degrees and depths, in the order of the octree.
std::vector<Cell> chosenCells(const Field& field, const ShownCells& choice);

/// The part of a box that the view's clipping plane leaves; empty where the plane leaves nothing or only a face.
Box clipped(Box box, const SurfaceView& view);

/// The corners of a box; bit k of a corner's index is set where its coordinate along axis k is the greater one.
std::array<Vector3, 8> cornersOf(const Box& box);

}  // namespace hpsdf::render
