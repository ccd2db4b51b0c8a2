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

/// Estimates a cell's squared error, before nearness weighs it.
enum class Estimator : std::uint8_t {
  embedded,  ///< ε_e: the norm of the top-degree coefficients (paper, eq. 6)
  residual,  ///< ∫Φ² − ∫f²: the part of the samples that the fit does not represent
};

/// Chooses degrees and depths of the leaves.
enum class Criterion : std::uint8_t {
  paper,    ///< the greater gain for each coefficient (paper, eqs. 7 to 9)
  optimal,  ///< the paper's criterion beyond the target, then pruning: refinements that save little error are undone
};

/// κ(s) of the mean distance s, where d is the domain's diagonal.
enum class NearnessKind : std::uint8_t {
  polynomial,   ///< (1 − s/d)^θ (paper, eq. 10)
  exponential,  ///< exp(−θ s/d) (Koschier et al. 2017)
};

/// Precision of the stored coefficients. `automatic` is float32 where rounding is less than 1 % of the estimated RMS
/// error, and of the maximum error if one is asked for.
enum class CoefficientType : std::uint8_t { automatic, float32, float64 };

/// Samples of the p-trial.
enum class TrialSamples : std::uint8_t {
  children,  ///< the children's samples, a finer quadrature of the same cell: refits all coefficients, costs no Φ
  /// A quadrature of its own, which appends the new degree only (the paper). Errors of the first fit stay: with
  /// `quadrature` below 4 the error may exceed the estimate by far.
  own,
};

/// Rule by which a cell is sampled.
enum class CubatureKind : std::uint8_t {
  compact,  ///< few points for the same order, where such rules are known (orders up to 13); elsewhere `product`
  product,  ///< the tensor product of Gauss rules (the paper)
};

/// Greatest λ of weak continuity; a field hardly changes there, and far beyond it the solver would divide by zero.
constexpr double kMaxContinuityWeight = 1e9;

/// The default blend width: queries take at most twice as long on average, and the gradient's error near faces stays
/// that of the leaves (docs/decisions.md).
constexpr double kDefaultBlend = 0.04;

/// Settings of weak continuity, which minimises Σ_F w_F ∫_F jump² dA + λ‖f − f₀‖² (Koschier et al. 2017): F runs over
/// the interfaces, w_F is the smaller cell's edge across F, ‖·‖ the L2 norm over the domain, f₀ the leaves' own fits.
/// Since w_F is a length both terms have one unit and λ has none: it trades alike at every cell size and in any unit.
struct WeakContinuity {
  /// λ, above 0, up to `kMaxContinuityWeight`: small for little jump, great for little change. See
  /// docs/accuracy-continuity.md.
  double weight = 2.5;
  /// Ratio of the final to the initial residual of the conjugate gradients, 0 to 1. With the default, jumps and change
  /// agree with those of the solution to three digits.
  double tolerance = 1e-3;
  int maxIterations = 5000;  ///< 1 or more
};

/// RMS errors asked for by distance from the surface, in the field's own units, by the estimator.
struct NearFarError {
  double near = 0;          ///< over the cells that may hold points within `nearDistance` of the surface, above 0
  double far = 0;           ///< over all other cells, at least `near`
  double nearDistance = 0;  ///< 0: a hundredth of L, see `BuildOptions::targetError`
};

/// The error at which a construction ends: τ, or errors by distance, or none. τ and errors by distance exclude each
/// other, since θ and τ follow from the latter.
class ErrorTarget {
 public:
  /// τ; 0 for no target. A construction without target needs another end: a maximum error, bytes or steps.
  ErrorTarget(double weighted) : asked_(weighted) {}  // NOLINT(google-explicit-constructor): a number is τ
  ErrorTarget(const NearFarError& byDistance) : asked_(byDistance) {}  // NOLINT(google-explicit-constructor)

  /// τ; 0 where there is none.
  double weighted() const { return isByDistance() ? 0 : std::get<double>(asked_); }
  bool isByDistance() const { return std::holds_alternative<NearFarError>(asked_); }
  /// Zeros where no errors by distance are asked for.
  NearFarError byDistance() const { return isByDistance() ? std::get<NearFarError>(asked_) : NearFarError{}; }
  bool isNone() const { return !isByDistance() && weighted() == 0; }

 private:
  std::variant<double, NearFarError> asked_;
};

/// Settings of the construction (paper, Algorithm 1). The defaults are ours; `paperOptions` are the paper's.
struct BuildOptions {
  /// τ at the paper's scale, where the longest side of the mesh's box is 2, or errors by distance. Internally
  /// τ·(L/2)^5, where L is that side in the mesh's own units, so that the same τ gives the same cells in any unit. For
  /// a callable without box, L is the domain's longest edge over 1.1.
  ErrorTarget targetError = 1e-6;
  std::array<std::uint32_t, 3> grid = {6, 6, 6};  ///< base cells along x, y, z
  double nearness = 4;                            ///< θ, 0 to 1000; 0 weighs all cells alike
  NearnessKind nearnessKind = NearnessKind::polynomial;
  /// Greatest |f − Φ|, in the field's own units; 0: not asked for. Once the target is reached, every cell (within the
  /// band, if there is one) is probed on a lattice of 512 points and refined where the greatest error, plus half of
  /// the greatest step between neighbouring points, exceeds it. It is no proof: for that see `safe_distance.h`. Blend
  /// zones are not probed as such. The error that remains at the limits of degree, depth, steps and bytes, and by
  /// rounding, is `FieldMetadata::measuredError`.
  double maxError = 0;
  /// Greatest number of bytes of the field in memory; the best such field is built that the other settings allow. With
  /// `maxError` the construction ends where that is reached, if bytes allow. Automatic coefficients become float.
  std::optional<std::uint64_t> maxBytes = {};
  Estimator estimator = Estimator::embedded;
  Criterion criterion = Criterion::paper;
  int maxDegree = 30;  ///< p_max, 1 to 30
  int maxDepth = 10;   ///< l_max, 0 to 20
  Strategy strategy = Strategy::hp;
  int quadrature = 3;  ///< order of the quadrature as a multiple of p, 2 to 8; the paper's is 4
  CubatureKind cubature = CubatureKind::compact;
  TrialSamples trialSamples = TrialSamples::children;
  /// Width of the narrow band in the field's own units; 0: none. Cells wholly farther from the surface are not refined
  /// and do not count towards ε.
  double band = 0;
  /// Greatest number of steps, each of which raises one leaf's degree or splits one leaf. 0: the base cells alone;
  /// nothing: no limit.
  std::optional<std::uint64_t> maxSteps = {};
  bool enrich = false;  ///< finally fits every leaf anew, one degree higher where `maxDegree` allows
  /// λ of weak continuity (`continuity.h`), which is applied at the end, before rounding; nothing: the leaves keep
  /// their own fits.
  std::optional<double> continuityWeight = {};
  double blend = 0;     ///< exact continuity: `FieldData::blend` of the finished field, 0 to `kMaxBlend`
  bool bounds = false;  ///< keeps proven bounds of each leaf's error and slope, see `safe_distance.h`
  CoefficientType coefficients = CoefficientType::automatic;
  /// Bytes that the growing octree and Φ (`DistanceFunction::bytes`) may take, by a generous estimate; nothing:
  /// `allowedMemory`, which is also the most. `build` throws when more are needed, or as soon as the decay of the error
  /// shows that half as much again will be. Weak continuity's solver takes about 50 bytes a coefficient on top.
  std::optional<std::uint64_t> memoryLimit = {};
  int threads = 0;  ///< greatest number of threads, up to 1024; 0: all of the machine. The result is the same.
};

/// All settings of the paper except τ and base grid.
BuildOptions paperOptions();

enum class DomainShape : std::uint8_t { cube, box };

/// The surface's box enlarged about its centre to (1 + margin) times its size, or the cube with its longest side.
/// Throws `Error` for an empty surface and a margin of -1 or less.
Box domainAround(const Box& surface, DomainShape shape = DomainShape::cube, double margin = 0.1);
Box domainAround(const TriangleMesh& mesh, DomainShape shape = DomainShape::cube, double margin = 0.1);

/// Where and how often a construction keeps its state, so that another process can continue it when this one is killed.
struct Checkpoint {
  /// The state's file. It is written under a temporary name and renamed, so that it is whole at any moment, and it is
  /// read where it exists.
  std::filesystem::path file;
  double seconds = 5;  ///< least time between two states, 0 to 1e9
  /// Greatest part of the time that goes into keeping the state, above 0 up to 1: where writing takes long, states are
  /// kept less often. 1: no such limit.
  double share = 0.02;
  /// Text that decides about Φ besides its `Source`; a state with another text is refused.
  std::string about = {};
  /// Called when a state was found, with the steps that it had taken.
  std::function<void(std::uint64_t steps)> resumed = {};
  /// Called when a state cannot be kept, for instance on a full disk. The construction continues, the older state
  /// stays, and the next is tried when it is due. Empty: such an `Error` ends the construction.
  std::function<void(const Error&)> failed = {};
};

}  // namespace hpsdf
