#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "field/build/refiner.h"
#include "field/cells/probes.h"

namespace hpsdf::detail {
namespace {

class MaxErrorPass {
 public:
  explicit MaxErrorPass(Refiner& refiner) : setup_(refiner.setup), state_(refiner.state), refiner_(refiner) {}

  void run() {
    constexpr std::size_t kRound = 256;
    std::vector<std::uint32_t>& pending = state_.pending;
    if (state_.stage != ConstructionState::Stage::probe) {
      for (std::uint32_t n = 0; n < state_.tree.nodes.size(); ++n)
        if (state_.tree.nodes[n].firstChild == 0) pending.push_back(n);
      // The order of the leaves must not depend on their numbers, which differ if several processes have made them.
      std::ranges::sort(pending, {}, [&](std::uint32_t n) {
        const BuildNode& node = state_.tree.nodes[n];
        return std::tuple(node.depth, node.cellIndex[2], node.cellIndex[1], node.cellIndex[0]);
      });
      state_.stage = ConstructionState::Stage::probe;
    }
    while (state_.processed < pending.size()) {
      refiner_.requireMemory();
      setup_.progress.update("probing the maximum error", double(state_.processed) / double(pending.size()));
      std::vector<Probed> probed = probeLeaves(std::min<std::size_t>(kRound, pending.size() - state_.processed));
      for (std::size_t i = 0; i < probed.size(); ++i) apply(pending[state_.processed + i], std::move(probed[i]));
      state_.processed += probed.size();
      refiner_.observer.atWholeState();
    }
  }

 private:
  std::vector<Probed> probeLeaves(std::size_t count) const {
    std::vector<Probed> probed(count);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      probed[i] = probe(refiner_, state_.tree.nodes[state_.pending[state_.processed + i]]);
    });
    return probed;
  }

  /// Applies the refinement that was chosen for a leaf. Appends the refined leaf or its children to the leaves
  /// that are still to be probed.
  void apply(std::uint32_t leaf, Probed&& probed) {
    if (!probed.trial) {
      state_.measuredError = std::max(state_.measuredError, probed.worst);
      return;
    }
    const bool mayStep = refiner_.mayStep();
    if (mayStep) refiner_.apply(leaf, std::move(*probed.trial), probed.raises);
    if (!mayStep || state_.isFull || state_.tree.nodes[leaf].firstChild == 0) {
      state_.pending.push_back(leaf);  // probe the leaf again; if no step is left, only to measure its error
      return;
    }
    const std::uint32_t first = state_.tree.nodes[leaf].firstChild;
    for (std::uint32_t child = first; child < first + 8; ++child) state_.pending.push_back(child);
  }

  const ConstructionSetup& setup_;
  ConstructionState& state_;
  Refiner& refiner_;
};

}  // namespace

Probed probe(const Refiner& refiner, const BuildNode& leaf) {
  Probed probed;
  if (leaf.fit.outsideBand || leaf.fit.isFinal) return probed;
  const double most = refiner.setup.options.maxError;
  const std::optional<Refinement> found = refiner.allowed(leaf);
  const bool mayRefine = refiner.mayStep() && found;
  const Refinement allowed = found.value_or(Refinement::either);

  // Refine the leaf without probing it if its estimated RMS error exceeds half of the maximum error. Its greatest
  // error is then very probably too great.
  const bool isSurelyBad = leaf.fit.error.squared > most * most / 4 * leaf.fit.error.volume;
  if (mayRefine && isSurelyBad) {
    probed.trial = refiner.attempt(leaf, allowed);
    probed.raises = refiner.raises(leaf, *probed.trial);
    return probed;
  }

  // Compare the leaf's polynomial with the exact distance at the probes. A probe slightly outside the narrow band
  // counts too, because it represents the points around it that lie within the band.
  const Box box = refiner.state.tree.boxOf(leaf);
  const std::vector<double> exact = refiner.fitter.distances(box, probePoints());
  const double band = refiner.setup.options.band;
  const double farthest = band > 0 ? band + probeSpacing(box.sizes().norm()) : std::numeric_limits<double>::infinity();
  probed.worst = worstError(leaf.fit, exact, farthest);
  if (probed.worst <= most || !mayRefine) return probed;

  // Try the allowed refinements. Raise the degree if that makes the error small enough, else decide by the
  // criterion of the paper.
  probed.trial = refiner.attempt(leaf, allowed);
  const std::optional<Fit>& raised = probed.trial->raised;
  probed.raises = (raised && allowed != Refinement::octree && worstError(*raised, exact, farthest) <= most) ||
                  refiner.raises(leaf, *probed.trial);
  return probed;
}

void refineByProbes(Refiner& refiner) { MaxErrorPass(refiner).run(); }

}  // namespace hpsdf::detail
