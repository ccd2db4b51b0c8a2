#pragma once
// Seeks the octree that takes the fewest bytes within a tolerance.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "field/build/limits.h"
#include "field/cells/build_tree.h"
#include "field/cells/exact_leaves.h"
#include "field/tolerance/tolerance_fit.h"

namespace hpsdf::detail {

/// A cell of an octree within a tolerance: a leaf, or a cell with eight children.
struct CheapCell {
  Fit fit;                ///< as a leaf; empty if the cell has children
  double bytes = 0;       ///< of the leaf, or of all descendants, in the finished field
  double ratio = 0;       ///< error of the cell's best polynomial over the allowed error
  double leafRatio = 0;   ///< error of the leaf over the allowed error, 0 for an exact leaf
  bool jumps = false;     ///< a jump of the distance was found; none is sought where the parent's error is very great
  bool isMissed = false;  ///< the leaf is a polynomial that misses the tolerance, in a cell that is not divided further
  std::unique_ptr<std::array<CheapCell, 8>> children = {};
};

/// A leaf that was considered for a cell.
struct LeafTrial {
  int degree = 0;    ///< `kExactDegree` for a list of triangles
  double bytes = 0;  ///< infinite if there is no such leaf, because its list would be too long or would have no sign
  double ratio = 0;  ///< error over the allowed error, 0 without error
  std::size_t triangles = 0;  ///< length of the list
  bool isRejected = false;    ///< its error is too great, or not proven to be small enough
};

/// Seeks the octree of a cell that takes the fewest bytes within a tolerance. A leaf is a polynomial of low degree or,
/// if the distance is measured to triangles, an exact leaf. A cell is divided if its children take fewer bytes.
/// Thread-safe.
class LeastBytes {
 public:
  /// Keeps references to its arguments. `tree` gives the boxes of cells. `exact` is empty if there can be no exact
  /// leaves. A cell of depth `maxDepth` is not divided.
  /// `requireRoom` is called with the number of cells from time to time; it throws where they do not fit into memory.
  LeastBytes(const BuildTree& tree, const ToleranceFitter& fitter, const std::optional<ExactCells>& exact,
             std::uint32_t maxDepth, const ByteBudget& budget, std::function<void(std::uint64_t)> requireRoom)
      : tree_(tree),
        fitter_(fitter),
        exact_(exact),
        maxDepth_(maxDepth),
        budget_(budget),
        requireRoom_(std::move(requireRoom)) {}

  /// Makes a leaf of a cell, and seeks the one that takes the fewest bytes. Returns true if the cell's children might
  /// take fewer bytes, or if there is no such leaf. `ratioAbove` is the error ratio of the parent, 0 if there is none.
  /// Appends the leaves that were considered to `trials`, if that is given.
  bool makeLeaf(CheapCell& cell, const CellPlace& place, double ratioAbove,
                std::vector<LeafTrial>* trials = nullptr) const;
  /// Gives a cell eight children without fits.
  static void divide(CheapCell& cell) { cell.children = std::make_unique<std::array<CheapCell, 8>>(); }
  /// Decides between the leaf of a cell and its children, which are settled, and removes the other.
  void settle(CheapCell& cell) const;
  /// Makes the octree of a cell: all of the above, down to its leaves.
  void solve(CheapCell& cell, const CellPlace& place, double ratioAbove) const;

  /// Returns the bytes that a leaf with a polynomial takes.
  double polynomialBytes(std::span<const double> coefficients, int degree) const;

  /// Number of cells that were looked at so far.
  std::uint64_t cells() const { return cells_; }

 private:
  void consider(CheapCell& cell, Fit&& fit, double bytes, double ratio, std::vector<LeafTrial>* trials) const;
  double polynomialBytes(const Fit& fit) const { return polynomialBytes(fit.coefficients, fit.degree); }
  double exactBytes(const Fit& fit, const Box& box) const;
  void makeSmallestLeaf(CheapCell& cell, const Box& box, ToleranceFit&& polynomial,
                        std::vector<LeafTrial>* trials) const;

  const BuildTree& tree_;
  const ToleranceFitter& fitter_;
  const std::optional<ExactCells>& exact_;
  std::uint32_t maxDepth_;
  const ByteBudget& budget_;
  std::function<void(std::uint64_t)> requireRoom_;
  mutable std::atomic<std::uint64_t> cells_ = 0;
};

}  // namespace hpsdf::detail
