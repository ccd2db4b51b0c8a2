#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"

namespace hpsdf {

/// Checks the arguments of `build`, which calls this function first. Throws `Error` (of the kind `option`) for the
/// first setting that is out of range and for a domain that is empty, flat or not finite, and `MemoryLimitError` for a
/// base grid that does not fit into memory.
void checkBuild(const Box& domain, const BuildOptions& options);

/// A function that is offered the field of a construction while this grows, for instance to show it. It may call
/// `fieldSoFar` to make a field of the present state, or decline: a field takes time and memory, which is not counted
/// in `BuildOptions::memoryLimit`. The field has rounded coefficients. It is not pruned, enriched or made weakly
/// continuous, and has no bounds.
using OfferField = std::function<void(const std::function<Field()>& fieldSoFar)>;

/// Builds a field that approximates the signed distance Φ over `domain`. The field's metadata stores the description of
/// Φ (`DistanceFunction::source`). If this description contains the surface's bounding box, the longest side of the box
/// is the length L that scales the target error (see `BuildOptions::targetError`).
///
/// If `offer` is not empty, it is called after each round of refinement steps; it does not affect the result. While
/// memory is short, and by a construction within a tolerance, it is not called.
///
/// Throws `Error` for options or a domain out of range, for an octree that would not fit into memory (the message says
/// how much memory it would need), and if Φ returns a value that is not finite. Throws `Cancelled` when `progress` says
/// so, and rethrows exceptions of `offer`.
Field build(const DistanceFunction& distance, const Box& domain, const BuildOptions& options = {},
            const Progress& progress = {}, const OfferField& offer = {});

/// Builds several fields in one construction: one for each number in `steps`, which must be in non-descending order.
/// For each number, `visit` receives the field that `build` returns with this number as `maxSteps`. The construction
/// continues only after `visit` has returned. Throws as `build` does. Also throws `Error` if `steps` descend, and
/// rethrows exceptions of `visit`.
void buildStages(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                 std::span<const std::uint64_t> steps, const std::function<void(Field)>& visit,
                 const Progress& progress = {});

/// Builds the same field as `build`, bit for bit, but resumes an interrupted construction from `checkpoint.file` if
/// this file exists. The result does not depend on when earlier processes were stopped or on how many threads they
/// used. The file holds the octree while it is refined; the stages after refinement, such as pruning, are repeated. The
/// caller should remove the file once the field is saved.
///
/// Throws as `build` does. Also throws `Error`, before anything is built, if the file cannot be written, is damaged, or
/// was begun by another version of the program or with another Φ, domain or options (`threads` and `memoryLimit` may
/// differ). Two Φ count as the same if their sources and their values at 4096 points agree.
Field buildResumably(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                     const Checkpoint& checkpoint, const Progress& progress = {});

}  // namespace hpsdf
