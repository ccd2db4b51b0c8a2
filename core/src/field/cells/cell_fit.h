#pragma once
// Fits of polynomials to the exact distance in single cells, and trial fits of a cell's possible refinements.

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "basis/projection.h"
#include "field/cells/surface_points.h"
#include "field/nearness.h"
#include "hpsdf/build_options.h"
#include "hpsdf/detail/exact_triangles.h"
#include "hpsdf/detail/triangle_search.h"
#include "hpsdf/distance_function.h"

namespace hpsdf::detail {

/// Throws `Error` if a distance is not finite. The message names the first such point.
void requireFinite(std::span<const Vector3> points, std::span<const double> distances);

/// Returns the exact distances at points that are given by local coordinates of a cell. Throws `Error` if a distance is
/// not finite, and `Cancelled` when `progress` says so.
std::vector<double> sampleCell(const DistanceFunction& distance, const Box& cell, std::span<const Vector3> local,
                               const Progress& progress);

/// The projection of a cell's samples onto the highest polynomial degree for which the samples suffice.
struct CachedProjection {
  std::vector<double> coefficients;
  int degree = 0;
  double meanSquare = 0;  ///< mean of Φ² over the cell, by quadrature of the samples; raised by `Estimator::checked`
};

/// A cell's polynomial and its error.
struct Fit {
  std::vector<double> coefficients;
  int degree = 0;
  std::uint32_t evaluations = 0;  ///< of the exact distance, for this cell alone; not stored in checkpoints
  CellError error;
  bool outsideBand = false;
  /// True if the fit's samples show that a polynomial of one degree more would leave little of its error. Such a cell
  /// is raised without a trial of its children.
  bool raisesAtOnce = false;
  bool isFinal = false;     ///< without error: an exact leaf, or a polynomial that equals Φ; never refined or pruned
  CachedProjection cached;  ///< projection of at least the fit's degree; kept for pruning
  /// For an exact leaf, whose degree is `kExactDegree`: its triangles, as `TriangleSearch::nearestTo` returns them, and
  /// the way in which their distance gets its sign.
  TriangleList list = {};
  LeafSign sign = {};

  bool isExact() const { return degree == kExactDegree; }
  /// Returns true for a leaf that another process holds (`fitElsewhere`).
  bool isElsewhere() const { return isFinal && coefficients.empty() && !isExact(); }
  /// Returns the value of the polynomial at a point in local coordinates of the cell.
  double valueAt(const Vector3& local) const;
};

/// Exact distances at points of a cell that are not among its samples, for `Estimator::checked`.
struct CheckPoints {
  std::vector<Vector3> local;  ///< the points, in local coordinates of the cell
  std::vector<double> distances;
};

/// The fits that result from the possible refinements of a cell: a higher degree, a split into eight children, or a fit
/// without error.
struct Trial {
  std::optional<Fit> raised;                   ///< fit of the cell, one degree higher
  std::optional<std::array<Fit, 8>> children;  ///< fits of the eight children, at the cell's degree
  std::optional<Fit> exact = {};               ///< fit without error; the other fits are then missing
  std::uint64_t evaluations = 0;               ///< of the exact distance, for all of these fits
};

enum class Refinement : std::uint8_t { degree, octree, either };

/// Samples the exact distance and fits polynomials to it. Thread-safe: cells are fitted in parallel.
class CellFitter {
 public:
  /// Makes a fitter that keeps references to the objects given. `nearness` may be changed between two fits. A cell
  /// counts as near the surface if the mean of the field in the cell is in magnitude at most `nearDistance` plus half
  /// of the cell's diagonal.
  CellFitter(const DistanceFunction& distance, const BuildOptions& options, const Nearness& nearness,
             double nearDistance, const Progress& progress);

  Fit fit(const Box& cell, int degree) const;

  /// Fits the allowed refinements of a cell whose fit is `current`.
  Trial attempt(const Box& cell, const Fit& current, Refinement allowed) const;

  /// Returns the exact distances at points that are given by local coordinates of a cell.
  std::vector<double> distances(const Box& cell, std::span<const Vector3> local) const;

  /// Number of evaluations of the exact distance so far.
  std::uint64_t evaluations() const { return evaluations_; }
  /// Does not count this number of evaluations, whose results are not used.
  void takeBack(std::uint64_t evaluations) const { evaluations_ -= evaluations; }
  /// Sets the number of evaluations so far, for a construction that continues from a file.
  void setEvaluations(std::uint64_t evaluations) { evaluations_ = evaluations; }

 private:
  /// The projection and the sampling orders for all cells of one degree p.
  struct Rules {
    std::unique_ptr<const basis::Projection>
        projection;  ///< onto degree p+1, which contains the projection onto degree p
    /// Order in which the points of a cell, followed by its check points, are sampled; empty: as listed.
    std::vector<std::uint32_t> orderOfOne;
    std::vector<std::uint32_t> orderOfEight;  ///< the same for the points of eight children, one after another
  };

  /// The samples of the exact distance in a cell or its eight children.
  struct Samples {
    std::vector<double> numbers;  ///< the samples that a projection takes, one cell after another
    CheckPoints check;            ///< check points of the whole cell; none unless the estimator is `checked`
    std::uint32_t evaluations = 0;
  };

  const Rules& rules(int degree) const;
  /// Samples the cell `whole`, or its eight children, for a projection. The check points are evaluated together with
  /// the samples, because points that lie close to each other share their search.
  Samples sample(const basis::Projection& projection, std::span<const Box> cells, const Box& whole,
                 std::span<const std::uint32_t> order) const;
  bool outsideBand(const Box& cell, const basis::Projection& projection, std::span<const double> samples) const;
  /// Makes a fit of the given degree by cutting off the higher degrees of a projection of samples.
  Fit makeFit(CachedProjection projected, int degree, const Box& cell, bool outsideBand,
              const CheckPoints& check) const;
  /// Returns the mean squared error of a fit that its errors at the check points, and at the centroids of triangles in
  /// the cell, suggest.
  double checkedError(const Fit& fit, const Box& cell, const CheckPoints& check) const;
  /// Returns `squared`, the mean squared error that samples and check points suggest. If it is too small to be
  /// believed, measures the error at many more points, counts these, and returns the greater of the two.
  double measuredIfDoubtful(Fit& fit, const Box& cell, double squared) const;
  double squaredError(const Fit& fit, double meanSquare) const;
  void rate(Fit& fit, double squared, const Box& cell) const;
  bool keepsProjections() const { return options_.criterion == Criterion::optimal; }
  /// Returns true if a projection of samples with gradients onto one degree more than a fit's promises to leave little
  /// of the fit's error.
  bool promisesRaise(const CachedProjection& projected, int degree) const;
  Fit raisedByOwnSamples(const Box& cell, const Fit& current) const;

  const DistanceFunction& distance_;
  const BuildOptions& options_;
  std::vector<Vector3> checkLattice_ = {};     ///< check points in local coordinates; only for `Estimator::checked`
  std::optional<SurfacePoints> surface_ = {};  ///< only for `Estimator::checked` and distances to triangles
  const Nearness& nearness_;
  double nearDistance_;
  const Progress& progress_;
  mutable std::atomic<std::uint64_t> evaluations_ = 0;
  mutable std::array<std::once_flag, kMaxDegree + 1> rulesMade_;
  mutable std::array<std::unique_ptr<const Rules>, kMaxDegree + 1> rules_;
};

}  // namespace hpsdf::detail
