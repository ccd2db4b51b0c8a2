#pragma once
// The file that keeps the state of a construction; see construction_state.h for its contents.

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"
#include "util/checked_file.h"

namespace hpsdf::detail {

class CheckpointFile {
 public:
  /// Throws `Error` where the file cannot be written.
  CheckpointFile(const Checkpoint& checkpoint, const DistanceFunction& distance, const Box& domain,
                 const BuildOptions& options);

  /// A reader at the beginning of the state, if there is one. Throws `Error` for the state of another construction.
  std::optional<detail::CheckedReader> open() const;

  /// Tells whether enough time has passed since the construction began or the last state was kept.
  bool isDue() const;

  /// Writes the state. Errors go to `Checkpoint::failed` if there is one.
  void keep(const std::function<void(detail::CheckedWriter&)>& writeState);

 private:
  using Clock = std::chrono::steady_clock;

  /// Digests in which a state must agree with the construction that continues it.
  struct Identity {
    std::string program;  ///< version of the program
    std::uint64_t surface = 0;
    std::uint64_t options = 0;   ///< of settings and domain
    std::uint64_t distance = 0;  ///< of values of Φ at 4096 points
  };

  void waitFor(double seconds);

  const Checkpoint& checkpoint_;
  Identity identity_;
  Clock::time_point next_;
};

}  // namespace hpsdf::detail
