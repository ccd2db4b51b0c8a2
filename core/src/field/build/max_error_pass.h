#pragma once
// The pass for the maximum error, after the growth by errors of cells.

#include <cstdint>
#include <vector>

#include "field/build/refiner.h"

namespace hpsdf::detail {

/// Probes every leaf and refines it while its greatest error exceeds `BuildOptions::maxError`. The greatest error that
/// the limits leave goes into the state.
class MaxErrorPass {
 public:
  MaxErrorPass(const ConstructionSetup& setup, const CellFitter& fitter, ConstructionState& state, Refiner& refiner,
               const GrowthObserver& observer)
      : setup_(setup), fitter_(fitter), state_(state), refiner_(refiner), observer_(observer) {}

  void run();

 private:
  /// The result of probing one leaf: its greatest error or, where that is too great, a trial of its refinements.
  struct Candidate {
    double worst = 0;  ///< |f − Φ|, see `worstError`
    std::optional<Trial> trial;
    bool raises = false;
  };

  std::vector<Candidate> evaluateCandidates(std::size_t count) const;
  Candidate evaluateCandidate(const BuildNode& leaf) const;
  void apply(std::uint32_t leaf, Candidate&& candidate);

  const ConstructionSetup& setup_;
  const CellFitter& fitter_;
  ConstructionState& state_;
  Refiner& refiner_;
  const GrowthObserver& observer_;
};

}  // namespace hpsdf::detail
