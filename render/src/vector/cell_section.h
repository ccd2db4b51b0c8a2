#pragma once
// The section of a field's octree with a plane, as exact lines instead of pixels.

#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/vector_picture.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// The cells of the octree that a plane cuts, and the lines between them.
struct CellSection {
  struct Part {
    Cell cell;
    Eigen::AlignedBox2d extent;  ///< in the picture, pixels
  };
  /// A straight line between two cells, or between a cell and the outside of the domain. At its ends, but nowhere
  /// between them, other cells may begin.
  struct Edge {
    int from, to;   ///< numbers of points
    int low, high;  ///< indices of the parts on both sides; -1 for none
    int line;       ///< edges with the same number lie on one straight line and are sorted along it
  };

  std::vector<Eigen::Vector2d> points;  ///< pixels from the upper left corner of the view
  std::vector<Part> parts;
  std::vector<Edge> edges;

  bool isBorder(const Edge& edge) const { return edge.low < 0 || edge.high < 0; }
};

/// Cuts the cells that a view of width × height pixels shows. Where the plane runs along faces of cells, it cuts the
/// cells that hold the points of the plane (`Field::cellAt`).
CellSection cellSection(const Field& field, const SliceView& view, int width, int height);

}  // namespace hpsdf::render
