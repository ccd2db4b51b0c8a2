#pragma once
// The octree of a construction, and its conversion to the arrays of a field.

#include <array>
#include <cstdint>
#include <vector>

#include "field/cells/cell_fit.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/detail/triangle_search.h"

namespace hpsdf::detail {

/// The place of a cell in an octree.
struct CellPlace {
  std::uint32_t depth = 0;
  std::array<std::uint32_t, 3> index{};  ///< position, in cells of this depth, from the domain's lower corner

  CellPlace child(std::uint32_t number) const {
    CellPlace place{depth + 1, {}};
    for (int axis = 0; axis < 3; ++axis) place.index[axis] = 2 * index[axis] + (number >> axis & 1);
    return place;
  }
};

struct BuildNode {
  std::uint32_t firstChild = 0;  ///< 0 for a leaf
  std::uint32_t depth = 0;
  std::array<std::uint32_t, 3> cellIndex{};  ///< position, in cells of its depth, from the domain's lower corner
  /// The polynomial of a leaf with its error. If pruning follows, an internal node also has the polynomial and the
  /// error that it would have as a leaf. Otherwise the fit of an internal node is empty.
  Fit fit;
};

/// Throws `Error` if an octree of so many nodes cannot have eight more, because nodes have numbers of 32 bits.
void requireRoomForChildren(std::size_t nodes);

/// The octree of a construction. Its array of nodes holds the base cells, x fastest, followed by groups of
/// eight children.
struct BuildTree {
  Box domain;
  std::array<std::uint32_t, 3> grid{};
  std::vector<BuildNode> nodes;

  std::size_t baseCells() const { return std::size_t(grid[0]) * grid[1] * grid[2]; }
  Box boxOf(const CellPlace& place) const;
  Box boxOf(const BuildNode& node) const { return boxOf({node.depth, node.cellIndex}); }

  /// Adds the base cells, without fits, to an empty tree.
  void addBaseCells();

  /// Sets the depths and the cell indices of the eight children of `parent`.
  void setChildIndices(std::uint32_t parent);

  /// Splits a leaf: adds eight children with the fits `children`, and replaces the leaf's own fit by `own`. Throws
  /// `Error` as `requireRoomForChildren` does.
  void split(std::uint32_t leaf, std::array<Fit, 8>&& children, Fit own = {});
};

/// The memory that exact leaves take besides their nodes, in bytes.
struct ExactSize {
  double inField = 0;  ///< in the finished field: lists, triangles and vertices
  double inTree = 0;   ///< in the octree of the construction
};

/// Returns the bytes that the list of an exact leaf takes during the construction.
double bytesOf(const TriangleList& list);

/// Computes the memory of the exact leaves of a tree. In the finished field, the vertices have the precision of
/// coefficients of type `type`.
ExactSize exactSize(const BuildTree& tree, const TriangleSearch* search, CoefficientType type);

/// Copies the nodes and coefficients into the arrays of a field, depth first, so that neighbours in space are
/// neighbours in memory. The coefficients remain double. Frees the memory of a temporary tree as it goes on.
/// `search` provides the triangles of exact leaves; it may be nullptr if there are none. A leaf that another process
/// holds becomes an exact leaf without triangles; a tree with such leaves has no other exact ones.
FieldData layOut(const BuildTree& tree, FieldMetadata metadata, const TriangleSearch* search);
FieldData layOut(BuildTree&& tree, FieldMetadata metadata, const TriangleSearch* search);

}  // namespace hpsdf::detail
