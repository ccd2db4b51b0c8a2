#pragma once
// The settings of a construction, and how it keeps its state.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <variant>

#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// hp refines degree and depth; h1 and h2 are octrees of one degree, for comparison.
enum class Strategy : std::uint8_t { hp, h1, h2 };

/// The estimate of a cell's squared error, before it is weighted by nearness.
enum class Estimator : std::uint8_t {
  embedded,  ///< ε_e: the norm of the top-degree coefficients (paper, eq. 6)
  residual,  ///< ∫Φ² − ∫f²: the part of the samples that the fit does not represent
};

/// The criterion by which the degrees and depths of the leaves are chosen.
enum class Criterion : std::uint8_t {
  paper,    ///< the refinement that reduces the error more for each coefficient (paper, eqs. 7 to 9)
  optimal,  ///< the paper's criterion beyond the target, then pruning of refinements that reduce the error little
};

/// The weight κ(s) of a cell with mean distance s from the surface, where d is the length of the domain's diagonal.
enum class NearnessKind : std::uint8_t {
  polynomial,   ///< (1 − s/d)^θ (paper, eq. 10)
  exponential,  ///< exp(−θ s/d) (Koschier et al. 2017)
};

/// Precision of the stored coefficients. `automatic` chooses float32 if the change by rounding is less than 1 % of
/// the estimated RMS error and, if a maximum error is asked for, less than 1 % of that too.
enum class CoefficientType : std::uint8_t { automatic, float32, float64 };

/// The samples to which the p-trial, the tentative fit of one degree more, is fitted.
enum class TrialSamples : std::uint8_t {
  children,  ///< the children's samples: a finer quadrature that refits all coefficients without evaluating Φ again
  /// Samples of a separate quadrature, which yield the coefficients of the new degree only (the paper). Errors of the
  /// first fit remain: if `quadrature` is below 4, the error may be far above the estimate.
  own,
};

/// The quadrature rule whose points sample a cell.
enum class CubatureKind : std::uint8_t {
  compact,  ///< rules with few points for their order, which are known up to order 13; `product` for higher orders
  product,  ///< the tensor product of Gauss rules (the paper)
};

/// The greatest λ of weak continuity. With so large a weight a field hardly changes; far above it the solver would
/// divide by zero.
constexpr double kMaxContinuityWeight = 1e9;

/// The default blend width. With it, queries take at most twice as long on average, and the gradient is as accurate
/// near faces as it is within leaves (docs/decisions.md).
constexpr double kDefaultBlend = 0.04;

/// Settings of weak continuity, which minimises Σ_F w_F ∫_F jump² dA + λ‖f − f₀‖² (Koschier et al. 2017): F runs over
/// the interfaces, w_F is the smaller cell's edge across F, ‖·‖ the L2 norm over the domain, f₀ the leaves' own fits.
/// Because w_F is a length, both terms have the same unit; the effect of λ depends neither on cell sizes nor on
/// units.
struct WeakContinuity {
  /// λ, above 0 and at most `kMaxContinuityWeight`. A small λ reduces the jumps more, a large λ changes the field
  /// less. See docs/accuracy-continuity.md.
  double weight = 2.5;
  /// Final residual of the conjugate gradients relative to the initial one, 0 to 1. With the default, jumps and
  /// change agree with those of the exact solution to three digits.
  double tolerance = 1e-3;
  int maxIterations = 5000;  ///< 1 or more
};

/// Target RMS errors near the surface and far from it, in the field's own units. Estimated errors are compared with
/// them.
struct NearFarError {
  double near = 0;          ///< over the cells that may hold points within `nearDistance` of the surface, above 0
  double far = 0;           ///< over all other cells, at least `near`
  double nearDistance = 0;  ///< 0: a hundredth of L, see `BuildOptions::targetError`
};

/// The error at which a construction ends: τ, or errors by distance (`NearFarError`), or none. τ cannot be given
/// together with errors by distance, because these determine θ and τ.
class ErrorTarget {
 public:
  /// Takes τ, or 0 for no target. Without a target, the construction needs a maximum error or a limit of bytes or
  /// steps.
  ErrorTarget(double weighted) : asked_(weighted) {}  // NOLINT(google-explicit-constructor): a number is τ
  ErrorTarget(const NearFarError& byDistance) : asked_(byDistance) {}  // NOLINT(google-explicit-constructor)

  /// Returns τ, or 0 if there is none.
  double weighted() const { return isByDistance() ? 0 : std::get<double>(asked_); }
  bool isByDistance() const { return std::holds_alternative<NearFarError>(asked_); }
  /// Returns the errors by distance, or zeros if none are asked for.
  NearFarError byDistance() const { return isByDistance() ? std::get<NearFarError>(asked_) : NearFarError{}; }
  bool isNone() const { return !isByDistance() && weighted() == 0; }

 private:
  std::variant<double, NearFarError> asked_;
};

/// Settings of the construction (paper, Algorithm 1). `paperOptions` returns those of the paper; the defaults differ.
struct BuildOptions {
  /// τ, or errors by distance. τ is given at the paper's scale, at which the longest side of the mesh's box is 2. The
  /// construction uses τ·(L/2)^5, where L is that side in the mesh's own units, so that the same τ gives the same
  /// cells in any unit. For a callable without a box, L is the domain's longest edge divided by 1.1.
  ErrorTarget targetError = 1e-6;
  std::array<std::uint32_t, 3> grid = {6, 6, 6};  ///< base cells along x, y, z
  double nearness = 4;                            ///< θ, 0 to 1000; 0 weighs all cells alike
  NearnessKind nearnessKind = NearnessKind::polynomial;
  /// Greatest |f − Φ|, in the field's own units; 0 if not asked for. Once the target error is reached, every cell (of
  /// the band, if there is one) is probed on a lattice of 512 points. It is refined if the greatest error at them,
  /// plus half of the greatest step between neighbouring points, exceeds this limit. That is no proof; for proven
  /// bounds see `safe_distance.h`. Cells are probed without blending. `FieldMetadata::measuredError` holds the error
  /// that remains because of rounding and of the limits of degree, depth, steps and bytes.
  double maxError = 0;
  /// Greatest number of bytes of the field in memory. The construction builds the best field within this limit that
  /// the other settings allow. With `maxError` it ends once that is reached, if the bytes suffice. Automatic
  /// coefficients become float.
  std::optional<std::uint64_t> maxBytes = {};
  Estimator estimator = Estimator::embedded;
  Criterion criterion = Criterion::paper;
  int maxDegree = 30;  ///< p_max, 1 to 30
  int maxDepth = 10;   ///< l_max, 0 to 20
  Strategy strategy = Strategy::hp;
  int quadrature = 3;  ///< order of the quadrature as a multiple of p, 2 to 8; the paper's is 4
  CubatureKind cubature = CubatureKind::compact;
  TrialSamples trialSamples = TrialSamples::children;
  /// Width of the narrow band in the field's own units; 0: none. Cells that lie wholly outside the band are not
  /// refined and do not count towards ε.
  double band = 0;
  /// Greatest number of steps, each of which raises one leaf's degree or splits one leaf. With 0 the field consists
  /// of the base cells; nothing means no limit.
  std::optional<std::uint64_t> maxSteps = {};
  bool enrich = false;  ///< refits every leaf at the end, one degree higher where `maxDegree` allows it
  /// λ of weak continuity (`continuity.h`), which is applied at the end, before rounding; nothing: the leaves keep
  /// their own fits.
  std::optional<double> continuityWeight = {};
  double blend = 0;     ///< exact continuity: the width of the blend zones (`FieldData::blend`), 0 to `kMaxBlend`
  bool bounds = false;  ///< keeps proven bounds of each leaf's error and slope, see `safe_distance.h`
  CoefficientType coefficients = CoefficientType::automatic;
  /// Limit in bytes of the memory of the growing octree and Φ (`DistanceFunction::bytes`), by a generous estimate.
  /// Nothing: `allowedMemory`, which is also the greatest possible limit. `build` throws when the estimate exceeds
  /// the limit, or earlier, when the decay of the error shows that the limit will be exceeded by half. The solver of
  /// weak continuity takes about 50 bytes per coefficient in addition.
  std::optional<std::uint64_t> memoryLimit = {};
  int threads = 0;  ///< greatest number of threads, up to 1024; 0: all of the machine. The result is the same.
};

/// Returns the settings of the paper, except τ and the base grid.
BuildOptions paperOptions();

enum class DomainShape : std::uint8_t { cube, box };

/// Returns the surface's box enlarged about its centre by the factor 1 + margin, or the cube around it whose edge is
/// the enlarged box's longest side. Throws `Error` for an empty surface and a margin of -1 or less.
Box domainAround(const Box& surface, DomainShape shape = DomainShape::cube, double margin = 0.1);
Box domainAround(const TriangleMesh& mesh, DomainShape shape = DomainShape::cube, double margin = 0.1);

/// Where and how often a construction keeps its state, so that another process can continue it when this one is killed.
struct Checkpoint {
  /// The state's file. It is written under a temporary name and then renamed, so that it is complete at any moment.
  /// If it exists, the construction continues from it.
  std::filesystem::path file;
  double seconds = 5;  ///< least time between two writes of the state, 0 to 1e9
  /// Greatest fraction of the time that is spent on writing the state, above 0 up to 1. If writing takes long, the
  /// state is written less often. 1: no such limit.
  double share = 0.02;
  /// Text that identifies Φ in addition to its `Source`; a state with another text is refused.
  std::string about = {};
  /// Called when a state was found, with the number of its steps.
  std::function<void(std::uint64_t steps)> resumed = {};
  /// Called when the state cannot be written, for instance on a full disk. The construction continues, the file keeps
  /// the older state, and the next write is tried when it is due. If this is empty, the `Error` ends the
  /// construction.
  std::function<void(const Error&)> failed = {};
};

}  // namespace hpsdf
