#pragma once

#include <vector>

#include "registry.h"

namespace hpsdf::app {

/// What weak continuity costs at several weights, without and with one degree more first: of the meshes `mesh`, built
/// as the parameters of `build` say. Throws `Error` naming the mesh, `Cancelled` after Ctrl-C.
void runContinuityStudy(Session& session, const Arguments& arguments);

/// What it needs beside `mesh`, `output` and the parameters of `build`: points, seed, weights.
std::vector<Parameter> continuityStudyParameters();

}  // namespace hpsdf::app
