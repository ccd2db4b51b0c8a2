#pragma once
// What a construction is asked for, and how it keeps its state.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "hpsdf/error.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

enum class Strategy : std::uint8_t { hp, h1, h2 };

/// What stands for a cell's squared error, before nearness weighs it.
enum class Estimator : std::uint8_t {
  embedded,  ///< ε_e: what the top degree adds (paper, eq. 6)
  residual,  ///< ∫Φ² − ∫f²: what the fit leaves of the samples that it was made from
};

/// How degrees and depths of the leaves are chosen.
enum class Criterion : std::uint8_t {
  paper,    ///< the gain a coefficient (paper, eqs. 7 to 9)
  optimal,  ///< the paper's, somewhat beyond the target, and then back: what saves most bytes for its error is undone
};

/// κ(s) of the mean distance s, d being the domain's diagonal.
enum class NearnessKind : std::uint8_t {
  polynomial,   ///< (1 − s/d)^θ (paper, eq. 10)
  exponential,  ///< exp(−θ s/d) (Koschier et al. 2017)
};

/// How coefficients are kept. `automatic`: float32 where rounding is less than 1 % of the estimated RMS error and of a
/// maximum error that is asked for.
enum class CoefficientType : std::uint8_t { automatic, float32, float64 };

/// Where the p-trial takes its samples.
enum class TrialSamples : std::uint8_t {
  children,  ///< the children's samples, a finer quadrature of the same cell: refits all coefficients, costs no Φ
  /// A quadrature of its own, appending the new degree only (the paper). What the first fit got wrong stays: with
  /// `quadrature` below 4 the error may exceed the estimate by far.
  own,
};

/// Where the samples of a cell stand.
enum class CubatureKind : std::uint8_t {
  compact,  ///< few points for the same order, where such rules are known (orders up to 13); elsewhere `product`
  product,  ///< the tensor product of Gauss rules (the paper)
};

/// λ beyond which a field hardly changes; far beyond it the solver would divide by zero.
constexpr double kMaxContinuityWeight = 1e9;

/// Settings of weak continuity, which makes Σ_F w_F ∫_F jump² dA + λ‖f − f₀‖² least (Koschier et al. 2017): F the
/// interfaces, w_F the smaller cell's edge across F, ‖·‖ the L2 norm over the domain, f₀ the leaves' own fits. With w_F
/// a length both terms have one unit, and λ has none: the same λ trades alike at every size of cell and in any unit.
struct WeakContinuity {
  /// λ, above 0, up to `kMaxContinuityWeight`: small for little jump, great for little change. See
  /// docs/accuracy-continuity.md.
  double weight = 2.5;
  /// Of the conjugate gradients: residual at the end over the one at the start, 0 to 1. At the default the jumps and
  /// the change are those of the solution to three digits.
  double tolerance = 1e-3;
  int maxIterations = 5000;  ///< 1 or more
};

/// Settings of the construction (paper, Algorithm 1). The defaults are ours; `paperOptions` are the paper's.
struct BuildOptions {
  /// τ at the paper's scale, where the longest side of the mesh's box is 2. Internally τ·(L/2)^5, L that side in the
  /// mesh's own units, so that the same τ gives the same cells in any unit. Of a callable: L = longest edge/1.1.
  /// 0: none; then another end must be given.
  double targetError = 1e-6;
  std::array<std::uint32_t, 3> grid = {6, 6, 6};  ///< base cells an axis
  double nearness = 4;                            ///< θ; 0 weighs all cells alike
  NearnessKind nearnessKind = NearnessKind::polynomial;
  /// RMS errors asked for in the field's own units, in place of τ and θ: over the cells that may hold points within
  /// `nearDistance` of the surface, and over all others. The construction ends where the estimate says that both are
  /// reached; θ follows from their ratio, by exponential nearness. Both or none; far ≥ near.
  double nearError = 0, farError = 0;
  double nearDistance = 0;  ///< in the field's own units; 0: a hundredth of L
  /// |f − Φ| that is to be exceeded nowhere, in the field's own units; 0: not asked for. Once the target is reached,
  /// every cell (within the band, if there is one) is looked at on a lattice of 512 places from corner to corner, and
  /// refined on where the worst place and half of the greatest step between neighbours together are more. No proof:
  /// for that see `safe_distance.h`; zones of blended leaves are not looked at as such. What is left at the limits of
  /// degree, depth, steps and bytes, and by rounding, stands in `FieldMetadata::measuredError`.
  double maxError = 0;
  /// The field as queries need it takes at most so many bytes; the best such field is built that the other settings
  /// allow. With `maxError` it ends where that is reached, if bytes allow. Coefficients that are left to choose become
  /// float.
  std::optional<std::uint64_t> maxBytes = {};
  Estimator estimator = Estimator::embedded;
  Criterion criterion = Criterion::paper;
  int maxDegree = 30;  ///< p_max, 1 to 30
  int maxDepth = 10;   ///< l_max, 0 to 20
  Strategy strategy = Strategy::hp;
  int quadrature = 3;  ///< order of the quadrature as a multiple of p, 2 to 8; the paper's is 4
  CubatureKind cubature = CubatureKind::compact;
  TrialSamples trialSamples = TrialSamples::children;
  /// Width in world units: cells wholly farther from the surface are not refined and do not count towards ε. 0: none.
  double band = 0;
  /// The construction ends after so many steps, each of which raises one leaf's degree or splits one, if the target has
  /// not been reached before. 0: the base cells alone; nothing: no limit.
  std::optional<std::uint64_t> maxSteps = {};
  bool enrich = false;  ///< at the end fits every leaf anew, one degree higher where `maxDegree` allows
  /// λ of weak continuity (`continuity.h`), by which the leaves' fits give way to each other at the end, before they
  /// are rounded; nothing: they stay as they are.
  std::optional<double> continuityWeight = {};
  double blend = 0;     ///< exact continuity: `FieldData::blend` of the finished field, 0 to `kMaxBlend`
  bool bounds = false;  ///< for each leaf keeps what is certain of its error, see `safe_distance.h`
  CoefficientType coefficients = CoefficientType::automatic;
  /// Bytes that the growing octree and Φ (`DistanceFunction::bytes`) may take, by a generous estimate; nothing:
  /// `allowedMemory`, which is also the most. `build` throws when more are needed, and before, where the way in which
  /// the error falls says that half as much again will be. Weak continuity's solver comes on top, some 50 bytes a
  /// coefficient.
  std::optional<std::uint64_t> memoryLimit = {};
  int threads = 0;  ///< at most; 0: all that the machine offers. The result does not depend on it.
};

/// The paper's settings but τ and base grid.
BuildOptions paperOptions();

enum class DomainShape : std::uint8_t { cube, box };

/// The mesh's box enlarged about its centre to (1 + margin) times its size; as a cube, of the longest side.
Box domainAround(const Box& surface, DomainShape shape = DomainShape::cube, double margin = 0.1);
Box domainAround(const TriangleMesh& mesh, DomainShape shape = DomainShape::cube, double margin = 0.1);

/// Where and how often a construction keeps its state, so that another process can take it up when this one is killed.
struct Checkpoint {
  /// Written under a temporary name and renamed, so that it is whole at any moment; read where it is there already.
  std::filesystem::path file;
  double seconds = 5;  ///< at least so long between two
  /// The part of the time that may go into keeping the state, above 0 up to 1: where writing takes long, it is done
  /// less often. 1: no such limit.
  double share = 0.02;
  /// What decides about Φ beside its `Source`; one made with another is refused.
  std::string about = {};
  /// Called when a state was found, with the steps that it had taken.
  std::function<void(std::uint64_t steps)> resumed = {};
  /// Called when a state cannot be kept, for want of space or the like: the construction goes on, the state kept before
  /// stays, and the next is tried when it is due. Empty: such an `Error` ends the construction.
  std::function<void(const Error&)> failed = {};
};

}  // namespace hpsdf
