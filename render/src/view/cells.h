#pragma once
// The octree's cells in the picture of a surface: as solid boxes, or as lines along their edges.

#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/picture.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Boxes have this share of a cell's extent, about its centre, so that one can look between them.
constexpr double kBoxShare = 0.8;

/// The leaves of the chosen degrees and depths, in the order of the octree.
std::vector<Cell> chosenCells(const Field& field, const ShownCells& choice);

/// Shows shrunk cells before what lies behind them: the first face that a pixel's ray enters, f there, the normal
/// outwards. What a clipping plane removes of a box is cut off; boxes that hold the eye are left out.
void addBoxes(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells, ViewBuffers& buffers);

/// How strongly each pixel of the buffers is covered by the cells' edges, 0 to 1, lines of `lineWidth` pixels; hidden
/// where something in the buffers is nearer. Lines fade with their distance, and those of cells that are small in the
/// picture altogether. A clipping plane cuts cells.
std::vector<float> cellLines(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells,
                             const ViewBuffers& buffers, double lineWidth);

}  // namespace hpsdf::render
