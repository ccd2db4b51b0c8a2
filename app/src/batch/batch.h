#pragma once

#include "language/registry.h"
#include "session/session.h"

namespace hpsdf::app {

/// Builds the fields of all meshes of a list into a folder, as `build --batch` does (docs/batch.md). Any number of
/// processes may share the list and the folder. Each finished mesh adds one line of JSON to the console's `out`, in one
/// write. The function returns when all fields exist, whichever process built them.
///
/// Throws `Error` before anything is built where list, folder or options cannot be used, `Failed` at the end where some
/// meshes failed, and `CancelledPartway`.
void buildBatch(const Console& console, const Arguments& arguments);

}  // namespace hpsdf::app
