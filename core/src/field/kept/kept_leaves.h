#pragma once
// The leaves of a field that stay as they are when a part of its surface changes.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "field/cells/build_tree.h"
#include "field/precision/round_coefficients.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/field.h"

namespace hpsdf::detail {

/// Which leaves of an earlier field are kept.
struct KeptLeaves {
  const FieldData* before = nullptr;  ///< the earlier field
  std::vector<bool> isKept = {};      ///< for each of its nodes; false for internal nodes
  std::uint64_t leaves = 0;           ///< number of leaves of the earlier field
  std::uint64_t kept = 0;             ///< number of leaves that are kept
  double keptVolume = 0;              ///< their share of the domain's volume
  std::uint64_t evaluations = 0;      ///< evaluations of Φ that it took to find them
  /// Share of the kept leaves in the weighted error of the earlier field, by the embedded estimate (ε*_e; paper, eq.
  /// 6), which needs no more than the coefficients.
  double keptError = 0;

  /// Returns that no leaf of a field is kept.
  static KeptLeaves none(const FieldData& before);
};

/// The change of the surface that Φ measures.
struct ChangedSurface {
  const DistanceFunction& now;  ///< Φ after the change
  /// The distance to all triangles that the surface has only before or only after the change. Its sign does not matter.
  const DistanceFunction& toChange;
  double offset = 0;  ///< subtracted from distances: half of the thickness of a shell
  /// Evaluates, at many points, the difference of the winding numbers after and before the change. Empty if the nearest
  /// triangles alone decide about signs.
  std::function<void(std::span<const Vector3> points, std::span<double> out)> windingChange = {};
};

/// Finds the leaves that no changed triangle can reach. Let c be the centre of a cell together with its blend zones and
/// r half of its diagonal. For all points of the cell the nearest triangle, before and after the change, is an
/// unchanged one if the changed ones are farther from c than |Φ(c)| + 2r, with the unsigned distance |Φ|. Cells of all
/// depths are tried, the base cells first. As no changed triangle passes through such a cell, the winding numbers of
/// all its points change by the same number; if this is not 0, its leaves are not kept.
///
/// |Φ| must be the distance to the nearest triangle, less the offset. It is not beside holes that winding numbers
/// close.
KeptLeaves findKeptLeaves(const Field& before, const ChangedSurface& change, const Progress& progress);

/// Tells the fit of an exact leaf, if there is one. Called in parallel.
using ExactFit = std::function<std::optional<Fit>(const Box& cell)>;

/// Fills an empty tree with the cells of the earlier field. Kept leaves have their fits, which are final and without
/// error. A cell below which no leaf is kept becomes a leaf without a fit. A kept exact leaf for which `exactFit` finds
/// no list of triangles becomes a leaf without a fit, too, and no longer counts as kept.
void makeTree(KeptLeaves& kept, const ExactFit& exactFit, BuildTree& tree, const Progress& progress);

/// Returns the steps of the kept leaves' quantized coefficients, for a field whose octree has grown from the tree that
/// `makeTree` made. They are empty if the earlier field is not quantized.
KeptSteps keptSteps(const KeptLeaves& kept, const FieldData& field);

}  // namespace hpsdf::detail
