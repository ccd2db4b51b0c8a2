#pragma once

#include "language/registry.h"
#include "session/session.h"

namespace hpsdf::app {

/// Builds the fields of all meshes of a list into a folder, as `build --batch` does (docs/batch.md). Any
/// number of processes may share the list and the folder. For each finished mesh this process writes one line
/// of JSON to the console's `out`. The function returns when all fields exist, whichever process built them.
///
/// Throws `Error` before any field is built if the list, the folder or the options cannot be used. Throws
/// `Failed` at the end if some meshes failed. Throws `CancelledPartway` if the work is cancelled.
void buildBatch(const Console& console, const Arguments& arguments);

}  // namespace hpsdf::app
