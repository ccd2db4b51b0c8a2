#pragma once
// The file in which the state of an unfinished construction is saved.

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
  /// Prepares the checkpoint file of a construction. Throws `Error` if the file cannot be written.
  CheckpointFile(const Checkpoint& checkpoint, const DistanceFunction& distance, const Box& domain,
                 const BuildOptions& options);

  /// Returns a reader at the beginning of the saved state, or std::nullopt if no state is saved. Throws `Error`
  /// if the state belongs to another construction.
  std::optional<CheckedReader> open() const;

  /// Returns true if it is time to save again: if enough time has passed since the construction began or last
  /// saved its state.
  bool isDue() const;

  /// Saves the state to the file by a call of `writeState`. Reports errors to `Checkpoint::failed` if that callback is
  /// set.
  void keep(const std::function<void(CheckedWriter&)>& writeState);

 private:
  using Clock = std::chrono::steady_clock;

  /// Digests of a construction's inputs. A saved state may only be continued by a construction with equal
  /// digests.
  struct Identity {
    std::string program;  ///< version of the program
    std::uint64_t surface = 0;
    std::uint64_t options = 0;   ///< digest of settings and domain
    std::uint64_t distance = 0;  ///< digest of the exact distances at 4096 points
  };

  void waitFor(double seconds);

  const Checkpoint& checkpoint_;
  Identity identity_;
  Clock::time_point next_;
};

/// Returns a digest of the surface, the settings and the domain of a construction.
std::uint64_t digestOfInputs(const Source& source, const BuildOptions& options, const Box& domain);

/// Writes the numbers of a construction state that are not part of its octree, and the number of evaluations of the
/// exact distance, to a message; and reads them.
void write(MessageWriter& message, ConstructionState& state, std::uint64_t evaluations);
std::uint64_t read(const Message& message, ConstructionState& state);

/// Writes the construction state and the number of evaluations of the exact distance. Does not change the state,
/// which is non-const only because the same functions also read it.
void save(CheckedWriter& writer, ConstructionState& state, std::uint64_t evaluations);

/// Reads the construction state that `save` wrote, and returns the number of evaluations of the exact distance.
/// The domain and the grid of `state` must already be set. What is derived from the octree is left out
/// (`Refiner::countAll`). Throws `Error` unless a construction with this
/// setup could have saved this state.
std::uint64_t restore(CheckedReader& reader, ConstructionState& state, const ConstructionSetup& setup);

}  // namespace hpsdf::detail
