#pragma once
// Exact leaves of a construction: which cells become exact, and the arrays that hold their triangles.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

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
  /// Triangles count as lying in one plane if their corners do up to `planeTolerance` and to the rounding to float.
  ExactCells(const TriangleSearch& search, double within, std::size_t most, double blend,
             double planeTolerance = std::numeric_limits<double>::infinity())
      : search_(search), within_(within), most_(most), blend_(blend), planeTolerance_(planeTolerance) {}

  /// Returns true if a point of the cell may be so close to the surface that the field must be exact there.
  bool mustBeExact(const Box& cell) const { return search_.comesWithin(cell, within_); }

  /// The result of making a cell exact.
  struct Outcome {
    std::optional<Fit> fit;  ///< without error: a list of triangles or, if these lie in one plane, a linear polynomial
    bool divides = false;    ///< there is no such fit, but there may be fits of the cell's parts
  };

  /// Makes a cell exact, if its list is not too long and determines the sign. The list may be twice as long if dividing
  /// the cell would hardly shorten it, and much longer if the cell cannot be divided further.
  Outcome makeExact(const Box& cell, bool isDivisible) const;

  /// Returns true if the triangles that can be nearest to points of the cell all face about the same way, so that the
  /// cell holds no part of a slot, rib or sharp edge, nor of a surface halfway between two others.
  bool isSmooth(const Box& cell) const;

  /// Makes a cell exact that need not be exact, if its list is not longer than `mostTriangles`. A cell that is refined
  /// is worth a list of any length that leaves near the surface may have: the list takes fewer bytes than the seven
  /// polynomials that a split adds. A cell that is not fitted yet is worth a short list, which takes fewer bytes than
  /// its polynomial.
  std::optional<Fit> fitOfFarCell(const Box& cell, std::size_t mostTriangles) const;
  std::optional<Fit> fitOfRefinedCell(const Box& cell) const { return fitOfFarCell(cell, most_); }
  std::optional<Fit> fitOfFirstCell(const Box& cell) const { return fitOfFarCell(cell, std::min(most_, kShort)); }

  const TriangleSearch& search() const { return search_; }

 private:
  /// Number of triangles in a list that takes at most as many bytes as a quadratic polynomial.
  static constexpr std::size_t kShort = 12;
  /// A cell that could be divided may have a list so many times as long as `most` where dividing hardly shortens it.
  static constexpr std::size_t kLongerFactor = 2;

  std::optional<Fit> fitFrom(const Box& cell, const Box& box, TriangleList list) const;

  const TriangleSearch& search_;
  double within_;
  std::size_t most_;
  double blend_;
  double planeTolerance_;
};

/// Tries to make a polynomial that stands for the triangles of a cell.
using SmoothFit = std::function<std::optional<Fit>(const Box& cell)>;

/// Decides what becomes of a cell that has no fit yet: it gets a fit without error, is divided or, far from the
/// surface, remains without a fit.
ExactCells::Outcome chooseExact(const Box& cell, const ExactCells& cells, const SmoothFit& smoothFit, bool isDivisible);

/// The size of an octree with exact leaves, counted or estimated.
struct ExactEstimate {
  double nodes = 0;
  double listBytes = 0;     ///< memory of the lists of exact leaves during the construction
  double overestimate = 1;  ///< the numbers may be so many times too great
};

/// Samples are off by a factor of 3 at times, where much detail lies in a small part of the mesh.
inline constexpr double kOverestimateBySamples = 5;

/// Makes the leaves exact that may contain points close to the surface, or takes the polynomial from `smoothFit` where
/// there is one. Starts from the leaves of a tree whose fits are not final, such as its base cells, and divides cells
/// whose lists are too long. Cells far from the surface remain without fits. Reports progress and throws `Cancelled`.
/// Calls `afterDepth` with the size so far whenever these cells, or the children of those that were divided, are done.
void placeExactLeaves(BuildTree& tree, const ExactCells& cells, const SmoothFit& smoothFit, int maxDepth,
                      const Progress& progress, const std::function<void(const ExactEstimate&)>& afterDepth);

/// Estimates what `placeExactLeaves` makes without a `smoothFit` from a tree of base cells, by Knuth's method for the
/// size of a search tree: of the cells of each depth that would be split, only a stratified random sample is split. The
/// time hardly depends on the size of the octree. Ends as soon as there are more than `mostNodes` nodes; the estimate
/// is then that of the levels so far. The result does not depend on the number of threads.
ExactEstimate estimateExactLeaves(BuildTree&& baseCells, const ExactCells& cells, int maxDepth, double mostNodes,
                                  const Progress& progress);

}  // namespace hpsdf::detail
