#pragma once
// The file that keeps the state of a construction; what the state is, the construction knows.

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "field/build/build_tree.h"
#include "hpsdf/build_options.h"
#include "util/checked_file.h"

namespace hpsdf {

class CheckpointFile {
 public:
  /// Throws `Error` where the file cannot be written.
  CheckpointFile(const Checkpoint& checkpoint, const DistanceFunction& distance, const Box& domain,
                 const BuildOptions& options);

  /// At the state, where there is one; throws `Error` for that of another construction.
  std::optional<CheckedReader> open() const;

  /// Whether enough time has gone by since the construction began or the last state was kept.
  bool isDue() const;

  void keep(const std::function<void(CheckedWriter&)>& writeState);

 private:
  using Clock = std::chrono::steady_clock;

  /// What a state must have in common with the construction that takes it up.
  struct Identity {
    std::string program;  ///< its version
    std::uint64_t surface = 0;
    std::uint64_t options = 0;   ///< and domain
    std::uint64_t distance = 0;  ///< Φ by its values at some places
  };

  void waitFor(double seconds);

  const Checkpoint& checkpoint_;
  Identity identity_;
  Clock::time_point next_;
};

/// The tree with all fits.
void treeItems(CheckedWriter& writer, const BuildTree& tree);

/// Into a tree that has its domain and grid; `fitted`: so many base cells have a fit. Throws `Error` for one that a
/// construction with these options cannot have.
void treeItems(CheckedReader& reader, BuildTree& tree, std::uint64_t fitted, const BuildOptions& options);

/// Nodes.
void listItems(CheckedWriter& writer, const std::vector<std::uint32_t>& nodes);
void listItems(CheckedReader& reader, std::vector<std::uint32_t>& nodes);

}  // namespace hpsdf
