#pragma once
// The state of a construction: all that must be kept so that another process can continue it.

#include <cstdint>
#include <vector>

#include "field/build/byte_budget.h"
#include "field/cells/build_tree.h"
#include "field/nearness.h"
#include "util/checked_file.h"

namespace hpsdf::detail {

struct ConstructionState {
  /// The stage that comes next; all earlier stages are done.
  enum class Stage : std::uint8_t { fitBaseCells, refine, probe };

  Stage stage = Stage::fitBaseCells;
  std::uint64_t fittedBaseCells = 0;
  std::uint64_t steps = 0;  ///< leaves raised or split so far
  Nearness nearness;
  ErrorTotals totals;           ///< running sums, updated with each step
  double lastSum = 0;           ///< weighted total when the totals were last summed exactly
  double measuredError = 0;     ///< greatest error that the max-error pass has left
  bool isFull = false;          ///< a refinement would exceed the limit of bytes
  std::uint64_t processed = 0;  ///< number of entries of `pending` that the max-error pass has finished
  BuildTree tree;
  std::vector<std::uint32_t> deferred;  ///< leaves whose kind, near or far, was exact enough when their turn came
  std::vector<std::uint32_t> pending;   ///< leaves of the max-error pass, in the order of their turns
  std::size_t coefficients = 0;         ///< that the finished field keeps of all leaves; derived, not stored
};

/// Writes the state and the number of evaluations of Φ.
void save(detail::CheckedWriter& writer, const ConstructionState& state, std::uint64_t evaluations);

/// Reads them into a state that has its domain and grid, and checks that a construction with these options could have
/// left them. Throws `Error` otherwise. Returns the number of evaluations of Φ.
std::uint64_t restore(detail::CheckedReader& reader, ConstructionState& state, const BuildOptions& options,
                      const ByteBudget& budget);

}  // namespace hpsdf::detail
