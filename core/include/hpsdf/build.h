#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// Throws `Error` for the first setting that is out of range, for a domain out of range, and for a base grid that
/// does not fit into memory. `build` calls this first.
void checkBuild(const Box& domain, const BuildOptions& options);

/// Builds the field of Φ over `domain`. The metadata stores Φ's source; the source's box, if it has one, gives L.
///
/// Throws `Error` for options or a domain out of range, for a tree that would not fit into memory (the message says
/// how much it would need), and for a Φ that returns a value that is not finite. Throws `Cancelled` when asked to
/// stop.
Field build(const DistanceFunction& distance, const Box& domain, const BuildOptions& options = {},
            const Progress& progress = {});

/// Builds the fields for several numbers of steps in one construction. The numbers in `steps` must not descend. For
/// each of them, `visit` gets the same field that `build` returns with this number as `maxSteps`. A field is made
/// only after `visit` has returned for the one before. Throws as `build` does, `Error` if `steps` descend, and what
/// `visit` throws.
void buildStages(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                 std::span<const std::uint64_t> steps, const std::function<void(Field)>& visit,
                 const Progress& progress = {});

/// Builds the same field as `build`, bit for bit, but continues from the state in `checkpoint.file` if there is one.
/// The result depends neither on when earlier processes were stopped nor on their numbers of threads. The state holds
/// the growing tree; the final stages are repeated. The file remains: remove it once the field is saved.
///
/// Throws as `build` does. Throws `Error`, before anything is built, if the file cannot be written, is damaged, or
/// was begun by another version of the program or with another Φ, domain or options (`threads` and `memoryLimit` may
/// differ). Φ counts as the same if its source and its values at 4096 points agree.
Field buildResumably(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                     const Checkpoint& checkpoint, const Progress& progress = {});

}  // namespace hpsdf
