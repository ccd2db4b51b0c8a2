#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/field.h"
#include "hpsdf/range.h"

namespace hpsdf::vdb {

/// A cube of voxels: its first voxel along each axis, a multiple of `size`, and the number of voxels along an edge.
struct VoxelBlock {
  std::array<std::int32_t, 3> first;
  std::int32_t size;
};

constexpr std::int32_t kLeafSize = 8;  ///< voxels along an edge of a leaf node of OpenVDB

/// Blocks of voxels that together cover the part of a field that a level set stores.
struct BandBlocks {
  std::vector<VoxelBlock> leaves;  ///< blocks of the size of a leaf node that may hold a part of the band
  std::vector<VoxelBlock> inside;  ///< blocks of any size that are certainly inside of the solid and hold no part of it
};

/// Finds the blocks, by dividing blocks for which the range of the field meets the band. All other voxels are outside.
/// Throws `Error` if there are more voxels along an axis than a grid can number, or if the leaf nodes would not fit
/// into memory.
BandBlocks findBandBlocks(const Field& field, double voxel, double band, const Progress& progress);

}  // namespace hpsdf::vdb
