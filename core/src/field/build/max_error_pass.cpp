#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "field/build/refiner.h"
#include "field/query/evaluate.h"

namespace hpsdf::detail {
namespace {

constexpr int kAcross = 8;

/// The points at which the error of a cell is measured: a lattice of 8 × 8 × 8 points between opposite corners of
/// the cell.
struct Probes {
  std::vector<std::array<int, 3>> index;  ///< position in the lattice
  std::vector<Vector3> local;             ///< the points in local coordinates
};

/// Returns the lattice of probes, in blocks of eight neighbours. Exact distances are fastest for eight
/// neighbouring points at a time.
const Probes& probes() {
  static const Probes all = [] {
    constexpr int kBlocks = kAcross / 2;  // number of blocks of eight neighbours along an axis
    Probes made;
    for (int block = 0; block < kBlocks * kBlocks * kBlocks; ++block)
      for (int corner = 0; corner < 8; ++corner) {
        const std::array<int, 3> index = {2 * (block % kBlocks) + (corner & 1),
                                          2 * (block / kBlocks % kBlocks) + (corner >> 1 & 1),
                                          2 * (block / kBlocks / kBlocks) + (corner >> 2)};
        made.index.push_back(index);
        made.local.push_back(2.0 / (kAcross - 1) * Vector3(index[0], index[1], index[2]) - Vector3::Ones());
      }
    return made;
  }();
  return all;
}

/// Estimates the greatest error |f − Φ| of the fit f to the exact distance Φ in a cell: the greatest error at the probe
/// points, plus half of the greatest difference between the errors f − Φ at two neighbouring probes. It assumes that
/// errors rise no faster between probes than from probe to probe. `exact` holds Φ at the probes. Probes with |Φ| above
/// `farthest` do not count.
double worstError(const Fit& fit, std::span<const double> exact, double farthest) {
  constexpr std::array<int, 3> kStride = {1, kAcross, kAcross * kAcross};
  std::array<double, kAcross * kAcross * kAcross> errors;
  const auto place = [&](std::size_t i) {
    const auto& [x, y, z] = probes().index[i];
    return x * kStride[0] + y * kStride[1] + z * kStride[2];
  };
  double worst = 0, step = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const Vector3& local = probes().local[i];
    double& error = errors[place(i)];
    error = query::evaluate(fit.coefficients.data(), fit.degree, {local.x(), local.y(), local.z()}) - exact[i];
    if (std::abs(exact[i]) > farthest) error = std::numeric_limits<double>::quiet_NaN();
    worst = std::fmax(worst, std::abs(error));  // fmax ignores the NaN of probes that do not count
  }
  for (std::size_t i = 0; i < exact.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (probes().index[i][axis] > 0)
        step = std::fmax(step, std::abs(errors[place(i)] - errors[place(i) - kStride[axis]]));
  return worst + step / 2;
}

/// Returns the greatest distance from a point of a cell to its closest probe. `cellDiagonal` is the length of
/// the cell's diagonal.
double probeSpacing(double cellDiagonal) { return cellDiagonal / (2 * (kAcross - 1)); }

class MaxErrorPass {
 public:
  explicit MaxErrorPass(Refiner& refiner)
      : setup_(refiner.setup), fitter_(refiner.fitter), state_(refiner.state), refiner_(refiner) {}

  void run() {
    constexpr std::size_t kRound = 256;
    std::vector<std::uint32_t>& pending = state_.pending;
    if (state_.stage != ConstructionState::Stage::probe) {
      for (std::uint32_t n = 0; n < state_.tree.nodes.size(); ++n)
        if (state_.tree.nodes[n].firstChild == 0) pending.push_back(n);
      state_.stage = ConstructionState::Stage::probe;
    }
    while (state_.processed < pending.size()) {
      refiner_.requireMemory();
      setup_.progress.update("probing the maximum error", double(state_.processed) / double(pending.size()));
      std::vector<Candidate> candidates =
          evaluateCandidates(std::min<std::size_t>(kRound, pending.size() - state_.processed));
      for (std::size_t i = 0; i < candidates.size(); ++i)
        apply(pending[state_.processed + i], std::move(candidates[i]));
      state_.processed += candidates.size();
      refiner_.observer.atWholeState();
    }
    refiner_.sumTotals();
  }

 private:
  /// The result of probing one leaf: its greatest error and, if that error is too great, the fits of its possible
  /// refinements.
  struct Candidate {
    double worst = 0;  ///< greatest error, from `worstError`
    std::optional<Trial> trial;
    bool raises = false;
  };

  std::vector<Candidate> evaluateCandidates(std::size_t count) const {
    std::vector<Candidate> candidates(count);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      candidates[i] = evaluateCandidate(state_.tree.nodes[state_.pending[state_.processed + i]]);
    });
    return candidates;
  }

  /// Applies the refinement that was chosen for a leaf. Appends the refined leaf or its children to the leaves
  /// that are still to be probed.
  void apply(std::uint32_t leaf, Candidate&& candidate) {
    if (!candidate.trial) {
      state_.measuredError = std::max(state_.measuredError, candidate.worst);
      return;
    }
    const bool mayStep = refiner_.mayStep();
    if (mayStep) refiner_.apply(leaf, std::move(*candidate.trial), candidate.raises);
    if (!mayStep || state_.isFull || candidate.raises) {
      state_.pending.push_back(leaf);  // probe the leaf again; if no step is left, only to measure its error
      return;
    }
    const std::uint32_t first = state_.tree.nodes[leaf].firstChild;
    for (std::uint32_t child = first; child < first + 8; ++child) state_.pending.push_back(child);
  }

  Candidate evaluateCandidate(const BuildNode& leaf) const {
    Candidate candidate;
    if (leaf.fit.outsideBand || leaf.fit.isFinal) return candidate;
    const double most = setup_.options.maxError;
    const std::optional<Refinement> found = refiner_.allowed(leaf);
    const bool mayRefine = refiner_.mayStep() && found;
    const Refinement allowed = found.value_or(Refinement::either);

    // Refine the leaf without probing it if its estimated RMS error exceeds half of the maximum error. Its greatest
    // error is then very probably too great.
    const bool isSurelyBad = leaf.fit.error.squared > most * most / 4 * leaf.fit.error.volume;
    if (mayRefine && isSurelyBad) {
      candidate.trial = refiner_.attempt(leaf, allowed);
      candidate.raises = prefersDegree(leaf.fit, *candidate.trial);
      return candidate;
    }

    // Compare the leaf's polynomial with the exact distance at the probes. A probe slightly outside the narrow band
    // counts too, because it represents the points around it that lie within the band.
    const Box box = state_.tree.boxOf(leaf);
    const std::vector<double> exact = fitter_.distances(box, probes().local);
    const double band = setup_.options.band;
    const double farthest =
        band > 0 ? band + probeSpacing(box.sizes().norm()) : std::numeric_limits<double>::infinity();
    candidate.worst = worstError(leaf.fit, exact, farthest);
    if (candidate.worst <= most || !mayRefine) return candidate;

    // Try the allowed refinements. Raise the degree if that makes the error small enough, else decide by the
    // criterion of the paper.
    candidate.trial = refiner_.attempt(leaf, allowed);
    const std::optional<Fit>& raised = candidate.trial->raised;
    candidate.raises =
        (raised && worstError(*raised, exact, farthest) <= most) || prefersDegree(leaf.fit, *candidate.trial);
    return candidate;
  }

  const ConstructionSetup& setup_;
  const CellFitter& fitter_;
  ConstructionState& state_;
  Refiner& refiner_;
};

}  // namespace

void refineByProbes(Refiner& refiner) { MaxErrorPass(refiner).run(); }

}  // namespace hpsdf::detail
