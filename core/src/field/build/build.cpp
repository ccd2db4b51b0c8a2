#include "hpsdf/build.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <span>
#include <utility>

#include "field/build/checkpoint_file.h"
#include "field/build/finishing.h"
#include "field/build/growth.h"
#include "field/build/limits.h"
#include "field/build/max_error_pass.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

using namespace detail;

/// Beyond the goal where pruning follows.
ErrorGoal growthGoal(const BuildOptions& options, const ErrorGoal& goal) {
  return options.criterion == Criterion::optimal ? goal.times(kGrowth) : goal;
}

double nearDistance(const BuildOptions& options, double referenceLength) {
  const double asked = options.targetError.byDistance().nearDistance;
  return asked > 0 ? asked : 0.01 * referenceLength;
}

/// One construction: the stages of Algorithm 1, one after the other, on one state.
class Construction {
 public:
  Construction(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
               const Progress& progress)
      : budget_(options),
        setup_{.distance = distance,
               .options = options,
               .progress = progress,
               .referenceLength = referenceLength(distance.source(), domain),
               .goal = errorGoal(options, referenceLength(distance.source(), domain)),
               .growthGoal = growthGoal(options, errorGoal(options, referenceLength(distance.source(), domain))),
               .budget = budget_},
        fitter_(distance, options, state_.nearness, nearDistance(options, setup_.referenceLength), progress),
        refiner_(setup_, fitter_, state_, observer_),
        finishing_(setup_, fitter_) {
    state_.nearness = Nearness(options, domain);
    state_.tree.domain = domain;
    state_.tree.grid = options.grid;
    refiner_.requireMemory();  // for Φ, before anything is built
  }

  /// Keeps the state in a file from now on. Continues from the state that it holds and returns true if there is one.
  bool resume(CheckpointFile& file) {
    observer_.atWholeState = [this, &file] {
      if (!file.isDue()) return;
      file.keep([this](detail::CheckedWriter& writer) { save(writer, state_, fitter_.evaluations()); });
    };
    std::optional<detail::CheckedReader> reader = file.open();
    if (reader) fitter_.setEvaluations(restore(*reader, state_, setup_.options, budget_));
    return reader.has_value();
  }

  std::uint64_t steps() const { return state_.steps; }

  void grow(const std::function<void(std::uint64_t)>& afterStep = {}) {
    observer_.afterStep = afterStep;
    Growth(setup_, fitter_, state_, refiner_, observer_).run();
    if (setup_.options.maxError > 0) MaxErrorPass(setup_, fitter_, state_, refiner_, observer_).run();
  }

  /// The field of the present state, from a copy of its tree.
  Field snapshot() { return Field(finishing_.finish(BuildTree(state_.tree), state_)); }
  /// The field of the final state.
  FieldData finish() { return finishing_.finish(std::move(state_.tree), state_); }

 private:
  ConstructionState state_;
  ByteBudget budget_;
  ConstructionSetup setup_;
  CellFitter fitter_;
  GrowthObserver observer_{.afterStep = {}, .atWholeState = [] {}};
  Refiner refiner_;
  Finishing finishing_;
};

}  // namespace

void checkBuild(const Box& domain, const BuildOptions& options) { checkOptions(domain, options); }

Field build(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
            const Progress& progress) {
  checkOptions(domain, options);
  return Field(withThreads(options.threads, [&] {
    Construction construction(distance, domain, options, progress);
    construction.grow();
    return construction.finish();
  }));
}

Field buildResumably(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                     const Checkpoint& checkpoint, const Progress& progress) {
  checkOptions(domain, options);
  return Field(withThreads(options.threads, [&] {
    CheckpointFile file(checkpoint, distance, domain, options);
    Construction construction(distance, domain, options, progress);
    if (construction.resume(file) && checkpoint.resumed) checkpoint.resumed(construction.steps());
    construction.grow();
    return construction.finish();
  }));
}

void buildStages(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                 std::span<const std::uint64_t> steps, const std::function<void(Field)>& visit,
                 const Progress& progress) {
  if (!std::ranges::is_sorted(steps)) throw Error("stages of a construction: expected steps that do not descend");
  if (steps.empty()) return;
  BuildOptions limited = options;
  limited.maxSteps = std::min(options.maxSteps.value_or(steps.back()), steps.back());
  checkOptions(domain, limited);
  withThreads(options.threads, [&] {
    Construction construction(distance, domain, limited, progress);
    std::size_t stage = 0;
    const auto visitNext = [&] {
      visit(construction.snapshot());
      ++stage;
    };
    construction.grow([&](std::uint64_t taken) {
      while (stage < steps.size() && steps[stage] == taken) visitNext();
    });
    while (stage < steps.size()) visitNext();  // the construction ended before the remaining stages
  });
}

}  // namespace hpsdf
