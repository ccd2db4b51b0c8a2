#pragma once

#include <array>
#include <vector>

namespace hpsdf::grids {

/// Indices (i, j, k) of a point in a cell, each from 0 to the cell's order.
using PointIndex = std::array<int, 3>;

/// Returns the points of a voxel of VTK: its eight corners, with i fastest.
std::vector<PointIndex> voxelPoints();

/// Returns the points of a Lagrange hexahedron of VTK in the order of its files since version 2.2: the corners, the
/// points within the edges, within the faces, and within the cell. Source: "Modeling Arbitrary-order Lagrange Finite
/// Elements in the Visualization Toolkit", kitware.com.
std::vector<PointIndex> lagrangePoints(int order);

}  // namespace hpsdf::grids
