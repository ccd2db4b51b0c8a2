#pragma once

#include <cstddef>
#include <filesystem>

#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "parts/face_list.h"

namespace hpsdf::parts {

/// The options by which a mesh is divided, as in `DistanceOnDiskOptions`.
struct PartOptions {
  InsideTest insideTest = InsideTest::automatic;
  std::size_t facesOfPart = 0;
};

/// Divides a mesh into parts and writes them into a new folder within `folder`, or finds them there. Returns the folder
/// of the parts. Throws as the constructors of `DistanceOnDisk` do.
std::filesystem::path makeParts(const FaceList& mesh, const std::filesystem::path& folder, const PartOptions& options,
                                const Progress& progress);

}  // namespace hpsdf::parts
