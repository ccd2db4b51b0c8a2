#pragma once
// Exact leaves of a construction: which cells become exact, and the arrays that hold their triangles.

#include <cstdint>
#include <optional>

#include "field/cells/build_tree.h"
#include "hpsdf/detail/triangle_search.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {

/// Finds the cells in which a short list of triangles gives the distance exactly.
class ExactCells {
 public:
  /// Keeps a reference to the search. `within` is the distance from the surface up to which the field is exact, `most`
  /// the greatest number of triangles of a leaf that could be divided further. `blend` is the width of the field's
  /// blend zones in edges of a leaf; a leaf is exact in its blend zones too.
  ExactCells(const TriangleSearch& search, double within, std::size_t most, double blend)
      : search_(search), within_(within), most_(most), blend_(blend) {}

  /// Returns true if a point of the cell may be so close to the surface that the field must be exact there.
  bool mustBeExact(const Box& cell) const { return search_.comesWithin(cell, within_); }

  /// What becomes of a cell that must be exact.
  struct Outcome {
    std::optional<Fit> fit;  ///< without error: a list of triangles or, if these lie in one plane, a linear polynomial
    bool divides = false;    ///< there is no such fit, but there may be fits of the cell's parts
  };

  /// Makes a cell exact, if its list is not too long and determines the sign. If the cell cannot be divided further,
  /// the list may be much longer.
  Outcome makeExact(const Box& cell, bool isDivisible) const;

  const TriangleSearch& search() const { return search_; }

 private:
  const TriangleSearch& search_;
  double within_;
  std::size_t most_;
  double blend_;
};

/// Makes the leaves exact that may contain points close to the surface. Starts from the base cells of a tree without
/// fits, and divides cells whose lists are too long. Cells far from the surface remain without fits. Reports progress
/// and throws `Cancelled`.
void placeExactLeaves(BuildTree& tree, const ExactCells& cells, int maxDepth, const Progress& progress);

}  // namespace hpsdf::detail
