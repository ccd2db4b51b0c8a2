#pragma once

#include "language/registry.h"
#include "session/session.h"

namespace hpsdf::app {

/// Throws `Error` if the arguments of `build --batch` contradict each other.
void checkBatch(const Arguments& arguments);

/// Builds the fields of all meshes of a list, or of one part of it, into a folder, as `build --batch` does
/// (docs/batch.md). For each finished mesh, one line of JSON is written to the console's `out`, and a record into the
/// folder. Several processes may work on different parts at once.
///
/// Throws `Error` before any field is built if the list, the folder, the script or the options cannot be used. Throws
/// `Failed` at the end if some meshes failed. Throws `CancelledPartway` if the work is cancelled.
void buildBatch(Session& session, const Arguments& arguments);

}  // namespace hpsdf::app
