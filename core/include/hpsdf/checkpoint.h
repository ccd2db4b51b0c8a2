#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "hpsdf/build.h"
#include "hpsdf/error.h"

namespace hpsdf {

/// Where and how often a construction keeps its state, so that another process can take it up when this one is killed.
struct Checkpoint {
  /// Written under a temporary name and renamed, so that it is whole at any moment; read where it is there already.
  std::filesystem::path file;
  double seconds = 5;  ///< at least so long between two
  /// The part of the time that may go into keeping the state, above 0 up to 1: where writing takes long, it is done
  /// less often. 1: no such limit.
  double share = 0.02;
  /// What decides about Φ beside its `Source`; one made with another is refused.
  std::string about = {};
  /// Called when a state was found, with the steps that it had taken.
  std::function<void(std::uint64_t steps)> resumed = {};
  /// Called when a state cannot be kept, for want of space or the like: the construction goes on, the state kept before
  /// stays, and the next is tried when it is due. Empty: such an `Error` ends the construction.
  std::function<void(const Error&)> failed = {};
};

/// `build` that goes on from `checkpoint.file` where that is there: the same field, to the bit, as `build` gives in one
/// go, whenever the processes before were stopped, and whatever the threads of any of them. The growing tree is kept;
/// what is done to it at the end is done again. The file stays: remove it when the field is where it shall be.
///
/// Throws as `build` does; `Error`, before anything is built, for a file that was begun with another Φ, domain or
/// options (`threads` and `memoryLimit` may differ), or by another version of the program, for a damaged one, and for
/// one that cannot be written. One Φ is told from another by its source and its values at 4096 places.
Field buildResumably(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                     const Checkpoint& checkpoint, const Progress& progress = {});

}  // namespace hpsdf
