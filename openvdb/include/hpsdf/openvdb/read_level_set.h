#pragma once
// Level sets of OpenVDB as signed distances from which fields can be built.

#include <filesystem>

#include "hpsdf/error.h"
#include "hpsdf/input/grid_distance.h"

namespace hpsdf::vdb {

/// Reads the first grid of floats or doubles of the class level set from an OpenVDB file (`.vdb`) as a signed distance
/// in world units.
///
/// In the band, that is where voxels are active, the distance is interpolated tricubically. A level set knows nothing
/// beyond but the sign; there the distance is that to a mesh of its surface, which OpenVDB makes, so that a field does
/// not spend leaves on the step at the end of the band. Two layers of voxels around the band get these distances too,
/// so that the interpolation in the band has samples on all sides.
///
/// `threads` is the greatest number of threads (0: all); the distance does not depend on it. Throws `Error` (of the
/// kind `file`) if the file cannot be read, is no OpenVDB file, is damaged or ends too early, or has no such grid, and
/// if the grid has no surface or a transform that rotates or shears. Throws `Cancelled` when `progress` says so.
GridDistance loadVdb(const std::filesystem::path& file, int threads = 0, const Progress& progress = {});

}  // namespace hpsdf::vdb
