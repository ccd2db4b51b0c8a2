#pragma once
// The file that keeps the state of a construction.

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "field/build/refiner.h"
#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"
#include "util/checked_file.h"

namespace hpsdf::detail {

class CheckpointFile {
 public:
  /// Throws `Error` where the file cannot be written.
  CheckpointFile(const Checkpoint& checkpoint, const DistanceFunction& distance, const Box& domain,
                 const BuildOptions& options);

  /// Returns a reader at the beginning of the stored state, if there is one. Throws `Error` if the state belongs to
  /// another construction.
  std::optional<CheckedReader> open() const;

  /// Tells whether enough time has passed since the construction began or the last state was kept.
  bool isDue() const;

  /// Writes the state. Errors go to `Checkpoint::failed` if there is one.
  void keep(const std::function<void(CheckedWriter&)>& writeState);

 private:
  using Clock = std::chrono::steady_clock;

  /// Digests in which a state must agree with the construction that continues it.
  struct Identity {
    std::string program;  ///< version of the program
    std::uint64_t surface = 0;
    std::uint64_t options = 0;   ///< digest of settings and domain
    std::uint64_t distance = 0;  ///< digest of the values of Φ at 4096 points
  };

  void waitFor(double seconds);

  const Checkpoint& checkpoint_;
  Identity identity_;
  Clock::time_point next_;
};

/// Writes the state, which stays as it is, and the number of evaluations of Φ.
void save(CheckedWriter& writer, ConstructionState& state, std::uint64_t evaluations);

/// Reads what `save` wrote into `state`, whose domain and grid are set already. Throws `Error` unless a construction
/// with these options could have left this state. Returns the number of evaluations of Φ.
std::uint64_t restore(CheckedReader& reader, ConstructionState& state, const BuildOptions& options,
                      const ByteBudget& budget);

}  // namespace hpsdf::detail
