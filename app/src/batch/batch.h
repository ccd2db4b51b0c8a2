#pragma once

#include <string>
#include <vector>

#include "batch/batch_list.h"
#include "language/registry.h"
#include "session/session.h"

namespace hpsdf::app {

/// Reads a list of meshes from a file or, for "-", from the console's input. Throws `Error` that names the list if it
/// cannot be read, has a zero byte or names no mesh.
std::vector<BatchMesh> readBatchList(const Console& console, const std::string& list);

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
