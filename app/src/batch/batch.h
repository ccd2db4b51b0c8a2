#pragma once

#include "language/registry.h"
#include "session/session.h"

namespace hpsdf::app {

/// `build --batch`: the fields of all meshes of a list, into a folder, beside any number of other processes at the same
/// work (docs/batch.md). A line of JSON for each goes to the console's `out` as soon as it is done, in one write.
/// Returns when all are there, whoever built them.
///
/// Throws `Error` for a list, a folder or options that are of no use, before anything is built; `Failed` at the end
/// where some meshes failed; `CancelledPartway`.
void buildBatch(const Console& console, const Arguments& arguments);

}  // namespace hpsdf::app
