#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// Throws `Error` for the first setting or domain that is out of range; for a base grid that memory cannot hold, too.
/// `build` does it first.
void checkBuild(const Box& domain, const BuildOptions& options);

/// Builds the field of Φ over `domain`. What Φ says of its source goes into the metadata; a box there gives L.
///
/// Throws `Error` for options or a domain out of range, a tree that would not fit into memory (what it would need), or
/// a Φ that returns a non-finite value; `Cancelled` when asked to stop.
Field build(const DistanceFunction& distance, const Box& domain, const BuildOptions& options = {},
            const Progress& progress = {});

/// The fields on the way, from one construction that goes no farther than it must: for each of `steps`, which may not
/// descend, `visit` gets the very field that `build` ends with when that is its `maxSteps`, and each is made only when
/// the one before has been visited. Throws as `build` does, `Error` for steps that descend, and what `visit` throws.
void buildStages(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                 std::span<const std::uint64_t> steps, const std::function<void(Field)>& visit,
                 const Progress& progress = {});

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
