#pragma once
// The octree while it grows, and its layout as the arrays of a field.

#include <array>
#include <cstdint>
#include <vector>

#include "field/cells/cell_fit.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf::detail {

struct BuildNode {
  std::uint32_t firstChild = 0;  ///< 0: a leaf
  std::uint32_t depth = 0;
  std::array<std::uint32_t, 3> cellIndex{};  ///< in cells of its depth, from the domain's lower corner
  /// The fit of a leaf. For an internal node it is the fit that the node would have as a leaf if pruning follows, and
  /// otherwise empty.
  Fit fit;
};

/// The base cells, x fastest, followed by groups of eight children.
struct BuildTree {
  Box domain;
  std::array<std::uint32_t, 3> grid{};
  std::vector<BuildNode> nodes;

  std::size_t baseCells() const { return std::size_t(grid[0]) * grid[1] * grid[2]; }
  Box boxOf(const BuildNode& node) const;

  /// Adds the base cells, without fits, to an empty tree.
  void addBaseCells();

  /// Sets depth and cell indices of the eight children of a node.
  void setChildIndices(std::uint32_t parent);

  /// Adds eight children with their fits to a leaf, whose own fit is replaced by `own`.
  void split(std::uint32_t leaf, std::array<Fit, 8>&& children, Fit own = {});
};

/// Lays out nodes and coefficients depth first, so that neighbours in space are neighbours in memory. The coefficients
/// stay in double. Destroys the tree.
FieldData layOut(BuildTree&& tree, FieldMetadata metadata);

/// Rounds coefficients from double to the given type, and sets `roundingRms` and `measuredError` of the metadata.
void roundCoefficients(CoefficientType type, FieldData& field);

}  // namespace hpsdf::detail
