#pragma once
// The settings of a field's construction, and of the checkpoint file from which an interrupted construction resumes.

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

/// The strategy by which the octree is refined. `hp` raises the polynomial degree of leaves or splits them. `h1` and
/// `h2` only split leaves, whose degree is always 1 or 2, and serve for comparison.
/// `hpx` refines like `hp`, but first makes leaves exact: wherever the surface may be within
/// `BuildOptions::exactWithin`, a leaf keeps the triangles that are nearest to its points (`ExactTriangles`) or, if
/// these lie in one plane, the linear polynomial of their distance. It needs a distance to triangles; for other
/// distances it equals `hp`. `automatic` chooses `hpx` for meshes with sharp edges or coarse facets, and `hp` for
/// smooth or very fine meshes, for distances without triangles and for constructions with a limit of bytes or steps.
enum class Strategy : std::uint8_t { hp, h1, h2, hpx, automatic };

constexpr bool isHp(Strategy strategy) { return strategy != Strategy::h1 && strategy != Strategy::h2; }

/// The method that estimates the squared L2 error of a cell, before the error is weighted by its distance from the
/// surface.
enum class Estimator : std::uint8_t {
  embedded,  ///< squared L2 norm of the polynomial's terms of highest degree (ε_e; paper, eq. 6)
  residual,  ///< ∫Φ² − ∫f²: the part of the sampled Φ that the polynomial f does not represent
  /// As `residual`, but at least what (f − Φ)² is at points that are not samples: at a lattice of 27 points, of which a
  /// cell shares corners with its siblings, and at the centroids of the surface's triangles, where Φ is known. It sees
  /// most kinks of Φ between the samples of a cell, for about 5 % more evaluations of Φ in each trial. Where a large
  /// cell of degree 2 would have an error near zero, it is compared with Φ at up to 4096 more points before that is
  /// believed.
  checked,
};

/// The criterion by which the polynomial degrees and the depths of the octree's leaves are chosen.
enum class Criterion : std::uint8_t {
  paper,    ///< takes the refinement that reduces the error more per coefficient (paper, eqs. 7 to 9)
  optimal,  ///< refines by the paper's criterion beyond the target error, then undoes the least useful refinements
};

/// The formula of the weight κ(s) that multiplies the error of a cell, where s is the cell's mean distance from the
/// surface, d the length of the domain's diagonal, and θ the exponent `BuildOptions::nearness`.
enum class NearnessKind : std::uint8_t {
  polynomial,   ///< (1 − s/d)^θ with the distance s and the domain's diagonal d (paper, eq. 10)
  exponential,  ///< exp(−θ s/d) with the distance s and the domain's diagonal d (Koschier et al. 2017)
};

/// Precision of the stored coefficients.
enum class CoefficientType : std::uint8_t {
  /// `quantized`, which takes the fewest bytes. Where that is not possible, `float32` if rounding changes the field by
  /// less than 1 % of the estimated RMS error and of a maximum error or tolerance that is asked for; else `float64`.
  automatic,
  float32,
  float64,
  /// Integers of few bits (`QuantizedCoefficients`). They change the field by about a tenth of the estimated RMS error
  /// over the domain, as RMS, which adds half a percent to this error; and at no point by more than 1 % of a maximum
  /// error or 5 % of a tolerance that is asked for, nor by more than floats do where `Strategy::hpx` makes the field
  /// exact. A limit of bytes may demand a greater change. The precision is `float32` instead where the field has no
  /// error to compare with, or where an integer would take more than 31 bits.
  quantized,
};

/// The samples of the signed distance Φ to which a polynomial of one degree more is fitted on trial in a cell
/// (p-trial).
enum class TrialSamples : std::uint8_t {
  children,  ///< samples in the eight child cells, which the trial split takes anyway; all coefficients are refitted
  /// Additional samples in the cell itself, from which only the coefficients of the highest degree are computed, as in
  /// the paper. The lower coefficients keep their errors: if `quadrature` is below 4, the error may be far above the
  /// estimate.
  own,
};

/// The kind of rule that selects the sample points in a cell.
enum class CubatureKind : std::uint8_t {
  compact,  ///< symmetric rules with about half as many points as `product`; above order 13, `product`
  product,  ///< the tensor product of Gauss rules (the paper)
  /// For degrees 2 to 5, and if Φ offers its gradient (`DistanceFunction::hasGradients`): 14 to 58 points at which Φ
  /// and its gradient are evaluated, whatever `BuildOptions::quadrature` says. Else `compact`, and also for
  /// `Estimator::embedded`, which would believe these fits too easily. A cell of degree 2 whose samples show that
  /// degree 3 leaves little of its error is raised without a trial of its children, except with `TrialSamples::own`.
  gradients,
};

/// Greatest allowed weight λ of weak continuity, a post-process that reduces the jumps of a field between leaves. With
/// this weight the field hardly changes; with a far greater weight the solver would divide by zero.
constexpr double kMaxContinuityWeight = 1e9;

/// Default width, relative to the edge of a leaf, of the zones in which neighbouring leaves are blended. With this
/// width, queries take at most twice as long on average, and the gradient is as accurate near the faces of leaves as
/// within leaves (docs/decisions.md).
constexpr double kDefaultBlend = 0.04;

/// Settings of weak continuity (Koschier et al. 2017), which reduces the jumps of a field f between leaves. It
/// minimises Σ_F w_F ∫_F jump² dA + λ‖f − f₀‖², where F runs over the faces between leaves, w_F is the edge length of
/// the smaller leaf at F, ‖·‖ is the L2 norm over the domain, and f₀ is the field as fitted leaf by leaf. Because w_F
/// is a length, both terms have the same unit, and the effect of λ depends neither on cell sizes nor on units.
struct WeakContinuity {
  /// λ, above 0 and at most `kMaxContinuityWeight`. A small λ reduces the jumps more, a large λ changes the field
  /// less. See docs/accuracy-continuity.md.
  double weight = 2.5;
  /// The conjugate gradient method ends when its residual has fallen to this fraction of the initial residual, 0 to 1.
  /// With the default, the jumps and the change of the field agree with those of the exact solution to three digits.
  double tolerance = 1e-3;
  int maxIterations = 5000;  ///< greatest number of iterations, 1 or more
};

/// Target RMS errors near the surface and far from the surface, in the field's own units. The construction
/// compares estimated errors with these targets.
struct NearFarError {
  double near = 0;          ///< error in cells that may contain points within `nearDistance` of the surface, above 0
  double far = 0;           ///< error in all other cells, at least `near`
  double nearDistance = 0;  ///< greatest distance that counts as near; 0: 1 % of L (see `BuildOptions::targetError`)
};

/// The error at which a construction ends: a single weighted error τ, separate errors near and far from the surface
/// (`NearFarError`), or no target. From `NearFarError`, the construction derives τ and the weight exponent θ; therefore
/// τ cannot be given in addition.
class ErrorTarget {
 public:
  /// Takes the target error τ, or 0 for no target. Without a target, the construction needs a maximum error, a
  /// limit of bytes or a limit of steps.
  ErrorTarget(double weighted) : asked_(weighted) {}  // NOLINT(google-explicit-constructor): a number is τ
  ErrorTarget(const NearFarError& byDistance) : asked_(byDistance) {}  // NOLINT(google-explicit-constructor)

  /// Returns the target error τ, or 0 if τ was not given.
  double weighted() const { return isByDistance() ? 0 : std::get<double>(asked_); }
  bool isByDistance() const { return std::holds_alternative<NearFarError>(asked_); }
  /// Returns the target errors near and far from the surface, or zeros if they were not given.
  NearFarError byDistance() const { return isByDistance() ? std::get<NearFarError>(asked_) : NearFarError{}; }
  bool isNone() const { return !isByDistance() && weighted() == 0; }

 private:
  std::variant<double, NearFarError> asked_;
};

/// The error |f − Φ| that a tolerance allows: the tolerance itself up to a distance from the surface, and beyond it 1 %
/// of the further distance in addition.
struct AllowedError {
  double tolerance = 0;
  double within = 0;

  double at(double distance) const {
    constexpr double kShareBeyond = 0.01;
    const double beyond = (distance < 0 ? -distance : distance) - within;
    return beyond > 0 ? tolerance + kShareBeyond * beyond : tolerance;
  }
};

/// Settings of a field's construction (paper, Algorithm 1). The defaults differ from the settings of the paper, which
/// `paperOptions` returns.
struct BuildOptions {
  /// The target error: τ, or errors near and far from the surface. The target τ is reached when the estimated integral
  /// of the weighted squared error falls to τ·(L/2)^5, where L is the longest side of the mesh's box. Thus the same τ
  /// gives the same cells in any unit; in the paper, L is 2. If the box of the surface is unknown, L is the domain's
  /// longest edge divided by 1.1.
  ErrorTarget targetError = 1e-6;
  std::array<std::uint32_t, 3> grid = {6, 6, 6};  ///< number of base cells, the roots of the octree, along x, y, z
  double nearness = 4;                            ///< exponent θ in `NearnessKind`, up to 1000; 0: no weighting
  NearnessKind nearnessKind = NearnessKind::polynomial;
  /// Greatest allowed error |f − Φ| of the field f, in the field's own units; 0: no such limit. Once the target error
  /// is reached, the error of every cell (of the band, if there is a band) is probed on a lattice of 512 points. A cell
  /// is refined if its greatest probed error, plus half of the greatest difference between the errors at two
  /// neighbouring points, exceeds the limit. This is no proof; for proven bounds see `safe_distance.h`. Cells are
  /// probed without blending. The remaining error is stored in `FieldMetadata::measuredError`; rounding and the limits
  /// of degree, depth, steps and bytes can keep it above the limit.
  double maxError = 0;
  /// Greatest allowed error |f − Φ| within `within` of the surface, in the field's own units; 0: no tolerance. Beyond
  /// it the allowed error grows (`AllowedError`), so that the sign is right wherever |Φ| exceeds the tolerance. The
  /// construction then seeks the octree, the polynomials and the exact leaves that take the fewest bytes, in place of
  /// Algorithm 1. Of the other settings only the grid, blending, bounds, coefficients, memory and threads have an
  /// effect. Errors are checked at 1241 points or more of each cell; see `certified` for a proof.
  /// Where the distance jumps, the tolerance cannot be kept; `FieldMetadata::measuredError` is greater then.
  double tolerance = 0;
  double within = 0;  ///< distance from the surface up to which `tolerance` holds; 0: 5 % of L (see `targetError`)
  /// With `tolerance`: takes only polynomials whose errors are proven not to exceed the allowed error at any point of
  /// their cell (see `safe_distance.h`). For closed surfaces alone. Excludes blending.
  bool certified = false;
  /// Greatest number of bytes of the field in memory. The construction builds the best field within this limit that the
  /// other settings allow. If `maxError` is set too, the construction ends as soon as this error is reached. With a
  /// limit of bytes, `CoefficientType::automatic` never chooses float64.
  std::optional<std::uint64_t> maxBytes = {};
  Estimator estimator = Estimator::checked;
  Criterion criterion = Criterion::paper;
  int maxDegree = 30;  ///< highest polynomial degree p of a leaf, 1 to 30
  int maxDepth = 10;   ///< greatest number of levels below a base cell, 0 to 20
  Strategy strategy = Strategy::automatic;
  /// For `Strategy::hpx`: greatest distance from the surface up to which the field is exact, as a share of L (see
  /// `targetError`), 0 to 1.
  double exactWithin = 0.012;
  /// For `Strategy::hpx`: greatest error, as a share of L, of a polynomial that stands for the triangles of a leaf
  /// close to the surface, 0 to 1. It is estimated from 512 points in the leaf, as for `maxError`. With 0, all leaves
  /// close to the surface have triangles or are linear.
  double exactTolerance = 0;
  /// For `Strategy::hpx`: number of triangles above which an exact leaf is divided, 1 to 4096. Up to twice as many stay
  /// together where dividing would hardly shorten the list. A leaf of the greatest depth may have more.
  int exactTriangles = 64;
  int quadrature = 3;  ///< order of the quadrature as a multiple of the degree p, 2 to 8; the paper uses 4
  CubatureKind cubature = CubatureKind::gradients;
  TrialSamples trialSamples = TrialSamples::children;
  /// Width of the narrow band around the surface, in the field's own units; 0: no band. Cells that lie wholly
  /// outside the band are not refined and do not count towards the estimated error ε.
  double band = 0;
  /// Greatest number of steps, each of which raises the degree of one leaf or splits one leaf. With 0 steps the field
  /// consists of the base cells. With std::nullopt there is no limit.
  std::optional<std::uint64_t> maxSteps = {};
  bool enrich = false;  ///< refits every leaf at the end, one degree higher where `maxDegree` allows it
  /// Weight λ of weak continuity (`continuity.h`), which is applied at the end of the construction, before the
  /// coefficients are rounded. With std::nullopt, weak continuity is not applied.
  std::optional<double> continuityWeight = {};
  double blend = 0;     ///< width of the zones in which neighbouring leaves are blended (`FieldData::blend`); 0: none
  bool bounds = false;  ///< stores proven bounds of each leaf's error and gradient, see `safe_distance.h`
  CoefficientType coefficients = CoefficientType::automatic;
  /// Limit, in bytes, of the memory for the octree and for Φ (`DistanceFunction::bytes`). With std::nullopt the limit
  /// is `allowedMemory`, which is also the greatest possible limit. During the construction, a generous estimate of
  /// this memory is compared with the limit. `build` throws when the estimate exceeds the limit, or earlier, when the
  /// decay of the error predicts that it will exceed 1.5 times the limit. The estimate leaves out the solver of weak
  /// continuity, which takes about 50 bytes per coefficient.
  std::optional<std::uint64_t> memoryLimit = {};
  int threads = 0;  ///< greatest number of threads, up to 1024; 0: all of the machine. It does not affect the result.
};

/// Returns the error that the tolerance of these options allows on a surface whose longest side is `referenceLength`.
AllowedError allowedError(const BuildOptions& options, double referenceLength);

/// Returns the settings of the paper, except the target error τ and the base grid, which have their defaults.
BuildOptions paperOptions();

enum class DomainShape : std::uint8_t { cube, box };

/// Returns the surface's box, enlarged about its centre by the factor 1 + margin; or, for `DomainShape::cube`,
/// the cube with the same centre whose edge is the longest side of the enlarged box. Throws `Error` for an
/// empty surface and for a margin of -1 or less.
Box domainAround(const Box& surface, DomainShape shape = DomainShape::cube, double margin = 0.1);
Box domainAround(const TriangleMesh& mesh, DomainShape shape = DomainShape::cube, double margin = 0.1);

/// The settings of a checkpoint file, in which a construction saves its state at intervals. If the process is killed,
/// another process can continue the construction from this file.
struct Checkpoint {
  /// The checkpoint file. It is written under a temporary name and then renamed, so that the file is complete at any
  /// moment. If the file exists, the construction continues from its state.
  std::filesystem::path file;
  double seconds = 5;  ///< least time in seconds between two writes of the state, 0 to 1e9
  /// Greatest fraction of the construction time that may be spent on writing the state, above 0 up to 1. If
  /// writing takes long, the state is written less often. 1: no limit.
  double share = 0.02;
  /// Text that identifies Φ in addition to its `Source`. A state that was written with another text is refused.
  std::string about = {};
  /// Called when a construction continues from a stored state, with the number of steps that this state has done.
  std::function<void(std::uint64_t steps)> resumed = {};
  /// Called when the state cannot be written, for instance because the disk is full. The construction continues,
  /// the file keeps the older state, and the next state is written when it is due. If this callable is empty, the
  /// `Error` ends the construction.
  std::function<void(const Error&)> failed = {};
};

}  // namespace hpsdf
