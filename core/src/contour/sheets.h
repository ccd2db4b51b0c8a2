#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "contour/cells/contour_octree.h"
#include "contour/cells/crossed_edges.h"
#include "util/grouping.h"

namespace hpsdf::contouring {

/// A face of a leaf: the axis normal to it, and whether it is the upper one of the two.
struct CellFace {
  int axis;
  bool upper;
};

/// Two crossed edges of a face between two leaves that a sheet of the surface connects across the face. The face is a
/// whole face of the smaller leaf.
struct Link {
  std::array<std::uint32_t, 2> edges;  ///< the lower one first
  std::array<std::int32_t, 2> cells;   ///< the one whose face this is first
  CellFace face;
  bool isOnly;  ///< no other link runs through the face
};

/// Returns the flat box of a link's face, without a thousandth of its edge at the boundary.
Box boxOf(const ContourOctree& octree, const Link& link);

/// The sheets of the surface in the leaves of an octree. A sheet passes through one leaf. It meets the boundary of the
/// leaf in a closed loop, which crosses edges and runs through faces from edge to edge. Each sheet becomes one vertex
/// of the mesh, each crossed edge a polygon between the vertices of the leaves around it (Schaefer et al. 2007).
///
/// If more than two edges of a face are crossed, the sheets cut off those corners of the face that are inside. Both
/// leaves at the face agree on that, so that the mesh has no cracks.
class Sheets {
 public:
  Sheets(const ContourOctree& octree, std::span<const CrossedEdge> edges);

  std::size_t size() const { return cells_.size(); }

  /// Returns the leaf that a sheet passes through.
  std::int32_t cellOf(std::uint32_t sheet) const { return cells_[sheet]; }

  /// Returns the edges that a sheet crosses, in ascending order.
  std::span<const std::uint32_t> edgesOf(std::uint32_t sheet) const { return edges_[sheet]; }

  /// Returns the sheet that crosses an edge in leaf number `place` of the leaves around it, which must be in the
  /// octree.
  std::uint32_t sheetAt(std::uint32_t edge, std::size_t place) const { return around_[edge][place]; }

  std::span<const Link> links() const { return links_; }

  /// Returns the number of the link of an edge through the face between two leaves.
  std::uint32_t linkOf(std::uint32_t edge, std::int32_t one, std::int32_t other) const;

 private:
  std::vector<std::int32_t> cells_;                   ///< by sheet
  detail::Grouping edges_;                            ///< of sheets
  std::vector<std::array<std::uint32_t, 4>> around_;  ///< by edge: the sheets in the leaves around it
  std::vector<Link> links_;
  detail::Grouping linksOfEdge_;
};

}  // namespace hpsdf::contouring
