#pragma once
// The history of one leaf: the decisions by which the construction of a field arrived at it.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// The part of a construction to which a step belongs.
enum class CellStage : std::uint8_t {
  exactLeaves,  ///< leaves near the surface become exact, before anything else is fitted (`Strategy::hpx`)
  refinement,   ///< the leaf with the greatest error is refined (paper, Algorithm 1)
  maxError,     ///< leaves that exceed `BuildOptions::maxError` at probe points are refined
  pruning,      ///< refinements are undone where that saves most bytes (`Criterion::optimal`)
  enrichment,   ///< all degrees are raised by one (`BuildOptions::enrich`)
  tolerance,    ///< the leaf or the children that take the fewest bytes are sought (`BuildOptions::tolerance`)
};

enum class CellChoice : std::uint8_t {
  raise,   ///< the degree of the cell was raised by one
  divide,  ///< the cell was divided into eight children
  keep,    ///< the cell remained as it was; it is the leaf of the field
};

/// A choice that the construction had for a cell.
struct CellAlternative {
  /// Algorithm 1: bytes of coefficients and nodes that the refinement adds. Within a tolerance: bytes of the leaf, or
  /// of all descendants.
  double bytes = 0;
  /// Algorithm 1: weighted error ε of the cell that remains, at the scale of the target error τ. Within a tolerance:
  /// the greatest error that was found over the allowed error.
  double error = 0;
  /// Algorithm 1: the reduction of ε per byte of added coefficients (μ and ν; paper, eqs. 7 and 8), by which the
  /// construction decides, unless one degree more suffices for `BuildOptions::maxError`. It is missing for exact leaves
  /// and within a tolerance, where no gains are compared.
  std::optional<double> gain = {};
  /// Within a tolerance: the polynomial's error is too great or, if that is certified, not proven to be small enough.
  bool isRejected = false;
  bool isUnproven = false;  ///< rejected although its error is small enough, because there is no proof for it
};

/// One decision of the construction, about the cell that held the point at that time.
struct CellStep {
  CellStage stage = CellStage::refinement;
  CellChoice choice = CellChoice::keep;
  int depth = 0;
  Box box = {};
  /// Degree of the cell's leaf before the step, `kExactDegree` for an exact leaf. It is missing if the cell had none.
  std::optional<int> degree = {};
  /// RMS error of that leaf over the cell as the construction estimated it; missing within a tolerance.
  std::optional<double> estimatedRms = {};
  /// RMS and greatest error of that leaf at 1000 random points of the cell.
  std::optional<double> measuredRms = {}, measuredMax = {};
  double weighted = 0;          ///< weighted error ε of that leaf, at the scale of the target error τ
  bool isOutsideBand = false;   ///< the cell lies outside the narrow band (`BuildOptions::band`)
  bool isMissed = false;        ///< no leaf within the tolerance was found, and the cell is not divided further
  bool isWithoutError = false;  ///< the leaf is exact, or the plane in which all nearest triangles lie
  std::size_t triangles = 0;    ///< triangles in the list of an exact leaf
  bool listIsTooLong = false;   ///< more triangles can be nearest to points of the cell than a list may have
  /// The alternatives that the construction compared: the degree that is one higher (within a tolerance: the polynomial
  /// of the lowest degree that is within it, or the closest one), eight children, and an exact leaf.
  std::optional<CellAlternative> degreeTrial = {}, octreeTrial = {}, exactTrial = {};
  std::optional<int> trialDegree = {};  ///< degree of `degreeTrial`
};

/// The history of the leaf that holds a point.
struct CellHistory {
  Cell cell;                         ///< the leaf of the field
  std::vector<CellStep> steps = {};  ///< from the base cell to the leaf
  /// The replayed construction arrived at a leaf with the box and the degree of `cell` and, unless the field is weakly
  /// continuous, with the same polynomial or as many triangles.
  bool agrees = false;
  /// Further refinement was forbidden: by the limits of degree and depth.
  bool isAtLimit = false;
};

/// Repeats the construction of `field` for the one leaf that holds x: the decisions about a cell do not depend on other
/// cells. When a refinement ends does depend on them; the replay therefore ends at the leaf of the field. `distance`
/// must be the Φ from which the field was made. Throws `Error` if x lies outside the domain or is not finite, and for a
/// field that was changed after it was built within a tolerance or whose stored settings are out of range. Throws
/// `Cancelled` when `progress` says so.
CellHistory cellHistory(const Field& field, const DistanceFunction& distance, const Vector3& x,
                        const Progress& progress = {});

}  // namespace hpsdf
