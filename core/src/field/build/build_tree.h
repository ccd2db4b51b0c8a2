#pragma once
// The octree while it grows, and its freezing into the arrays of a Field.

#include <array>
#include <cstdint>
#include <vector>

#include "field/build/cell_fit.h"
#include "hpsdf/detail/field_data.h"

namespace hpsdf {

struct BuildNode {
  std::uint32_t firstChild = 0;  ///< 0: a leaf
  std::uint32_t depth = 0;
  std::array<std::uint32_t, 3> place{};  ///< in cells of its depth, counted from the domain's lower corner
  Fit fit;  ///< of a leaf; of an internal node what it would be as one, where refinements may be taken back, else empty
};

/// Base cells first, x fastest, then groups of eight children.
struct BuildTree {
  Box domain;
  std::array<std::uint32_t, 3> grid{};
  std::vector<BuildNode> nodes;

  std::size_t baseCells() const { return std::size_t(grid[0]) * grid[1] * grid[2]; }
  Box boxOf(const BuildNode& node) const;

  /// Of an empty tree; without fits.
  void addBaseCells();

  /// Says where the eight children of a node are.
  void placeChildren(std::uint32_t parent);

  /// Puts eight children, which take over their fits, below a leaf, whose own fit is replaced.
  void split(std::uint32_t leaf, std::array<Fit, 8>&& children, Fit own = {});
};

/// Lays nodes and coefficients, which stay in double, out depth first, so that neighbours in space are neighbours in
/// memory. Takes the tree apart.
FieldData layOut(BuildTree&& tree, FieldMetadata metadata);

/// Rounds the coefficients, which are in double, as asked, and completes the metadata (roundingRms, measuredError).
void keepAs(CoefficientType type, FieldData& field);

}  // namespace hpsdf
