#include "field/build/max_error_pass.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "field/cells/max_error_probe.h"

namespace hpsdf::detail {

void MaxErrorPass::run() {
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
    for (std::size_t i = 0; i < candidates.size(); ++i) apply(pending[state_.processed + i], std::move(candidates[i]));
    state_.processed += candidates.size();
    observer_.atWholeState();
  }
  refiner_.sumTotals();
}

std::vector<MaxErrorPass::Candidate> MaxErrorPass::evaluateCandidates(std::size_t count) const {
  std::vector<Candidate> candidates(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    candidates[i] = evaluateCandidate(state_.tree.nodes[state_.pending[state_.processed + i]]);
  });
  return candidates;
}

/// Applies the candidate's refinement and lets the new leaves wait for their turn.
void MaxErrorPass::apply(std::uint32_t leaf, Candidate&& candidate) {
  if (!candidate.trial) {
    state_.measuredError = std::max(state_.measuredError, candidate.worst);
    return;
  }
  const bool mayStep = refiner_.mayStep();
  if (mayStep) refiner_.apply(leaf, std::move(*candidate.trial), candidate.raises);
  if (!mayStep || state_.isFull || candidate.raises) {
    state_.pending.push_back(leaf);  // without a step it is only measured
    return;
  }
  const std::uint32_t first = state_.tree.nodes[leaf].firstChild;
  for (std::uint32_t child = first; child < first + 8; ++child) state_.pending.push_back(child);
}

MaxErrorPass::Candidate MaxErrorPass::evaluateCandidate(const BuildNode& leaf) const {
  Candidate candidate;
  if (leaf.fit.outsideBand) return candidate;
  const double most = setup_.options.maxError;
  const std::optional<Refinement> found = refiner_.allowed(leaf);
  const bool mayRefine = refiner_.mayStep() && found;
  const Refinement allowed = found.value_or(Refinement::either);

  // An RMS error above half the maximum makes probing superfluous.
  const bool isSurelyBad = leaf.fit.error.squared > most * most / 4 * leaf.fit.error.volume;
  if (mayRefine && isSurelyBad) {
    candidate.trial = refiner_.attempt(leaf, allowed);
    candidate.raises =
        candidate.trial->raised && (!candidate.trial->children || prefersDegree(leaf.fit, *candidate.trial));
    return candidate;
  }

  // Probe the leaf. A probe outside of the band stands for the points around it that are within.
  const Box box = state_.tree.boxOf(leaf);
  const std::vector<double> exact = fitter_.distances(box, maxErrorProbes());
  const double band = setup_.options.band;
  const double farthest = band > 0 ? band + probeSpacing(box.sizes().norm()) : std::numeric_limits<double>::infinity();
  candidate.worst = worstError(leaf.fit, exact, farthest);
  if (candidate.worst <= most || !mayRefine) return candidate;

  // Raise the degree where that is enough, else decide by the paper's criterion.
  candidate.trial = refiner_.attempt(leaf, allowed);
  candidate.raises = candidate.trial->raised &&
                     (!candidate.trial->children || worstError(*candidate.trial->raised, exact, farthest) <= most ||
                      prefersDegree(leaf.fit, *candidate.trial));
  return candidate;
}

}  // namespace hpsdf::detail
