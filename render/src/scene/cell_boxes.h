#pragma once
// Cells of the octree in a picture of a surface: their selection by degree and depth, and their drawing as boxes.

#include <array>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/shown_cells.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// The leaves of the chosen degrees and depths, in the order of the octree.
std::vector<Cell> chosenCells(const Field& field, const ShownCells& choice, double offset);

/// The part of a box that the view's clipping plane does not remove; empty if at most a face of the box remains.
Box clipped(Box box, const SurfaceView& view);

/// The corners of a box; bit k of a corner's index is set if its coordinate along axis k is the greater one.
std::array<Vector3, 8> cornersOf(const Box& box);

/// The edge length of a drawn box as a share of its cell's edge length, below 1 to leave gaps between boxes.
constexpr double kBoxShare = 0.8;

/// Draws each cell as a solid box about the cell's centre. A box is shown in pixels where it is nearer to the eye than
/// the point that the buffers show. Such a pixel gets the field's value at the point where its ray enters the box, and
/// the outward normal of the box there. A clipping plane cuts boxes. A box that contains the eye is left out.
void addBoxes(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells, ViewBuffers& buffers);

}  // namespace hpsdf::render
