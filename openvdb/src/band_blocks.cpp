#include "band_blocks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "hpsdf/detail/memory.h"

namespace hpsdf::vdb {
namespace {

constexpr std::int32_t kRootSize = 4096;      ///< voxels along an edge of the largest nodes of OpenVDB's trees
constexpr double kMostVoxels = 1 << 30;       ///< greatest index of a voxel; OpenVDB's indices have 32 bits
constexpr double kBytesOfLeaf = 2 * 4 * 512;  ///< memory of a leaf node, and of its part of the file
constexpr std::size_t kBlocksOfTask = 64;

using Index = std::array<std::int32_t, 3>;

enum class Side : std::uint8_t { outside, inside, band };

/// Returns the box outside of which a level set has no voxels inside or in the band: the domain, enlarged by as much as
/// the solid reaches beyond the boundary of the domain, where the field is continued.
Box boxOfLevelSet(const Field& field, const RangeIndex& index, double band) {
  double deepest = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (const bool upper : {false, true}) {
      Box wall = field.domain();
      (upper ? wall.min() : wall.max())[axis] = (upper ? wall.max() : wall.min())[axis];
      deepest = std::min(deepest, index.range(wall).value.min);
    }
  const Vector3 reach = Vector3::Constant(band - deepest);
  return Box(field.domain().min() - reach, field.domain().max() + reach);
}

/// Returns the largest nodes that meet a box, which is in units of voxels.
std::vector<VoxelBlock> rootBlocks(const Box& box) {
  std::vector<VoxelBlock> blocks;
  const auto firstOf = [](double x) { return std::int32_t(std::floor(x / kRootSize)); };
  for (std::int32_t x = firstOf(box.min().x()); x <= firstOf(box.max().x()); ++x)
    for (std::int32_t y = firstOf(box.min().y()); y <= firstOf(box.max().y()); ++y)
      for (std::int32_t z = firstOf(box.min().z()); z <= firstOf(box.max().z()); ++z)
        blocks.push_back({{x * kRootSize, y * kRootSize, z * kRootSize}, kRootSize});
  return blocks;
}

/// Finds the blocks of a level set, size by size.
class BlockSearch {
 public:
  BlockSearch(const Field& field, double voxel, double band)
      : index_(field), voxel_(voxel), band_(band), box_(boxOfLevelSet(field, index_, band)) {
    if (!box_.sizes().allFinite())
      throw Error(ErrorKind::option, "voxel",
                  "the band of such voxels exceeds the range of numbers; give smaller voxels");
    const double longest = std::max(box_.min().cwiseAbs().maxCoeff(), box_.max().cwiseAbs().maxCoeff()) / voxel;
    if (!(longest < kMostVoxels))
      throw Error(ErrorKind::option, "voxel",
                  "the domain has more than " + std::to_string(1 << 30) + " voxels along an axis; give larger voxels");
  }

  BandBlocks find(const Progress& progress) {
    const Box inVoxels(box_.min() / voxel_, box_.max() / voxel_);
    requireRoots(inVoxels);
    std::vector<VoxelBlock> blocks = rootBlocks(inVoxels);
    for (std::int32_t size = kRootSize;; size /= 2) {
      progress.throwIfCancelled();
      blocks = meetingBand(blocks);
      requireLeaves(blocks.size(), size, inVoxels.sizes().maxCoeff());
      if (size == kLeafSize) break;
      blocks = divided(blocks);
    }
    found_.leaves = std::move(blocks);
    return std::move(found_);
  }

 private:
  Side sideOf(const VoxelBlock& block) const {
    const Vector3 first = voxel_ * Vector3(block.first[0], block.first[1], block.first[2]);
    const Box points(first, first + Vector3::Constant(voxel_ * (block.size - 1)));
    if (!points.intersects(box_)) return Side::outside;
    const Interval range = index_.range(points).value;
    return range.min >= band_ ? Side::outside : range.max <= -band_ ? Side::inside : Side::band;
  }

  /// Returns the blocks that may hold a part of the band, in the same order, and keeps those that are inside.
  std::vector<VoxelBlock> meetingBand(const std::vector<VoxelBlock>& blocks) {
    std::vector<Side> sides(blocks.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), kBlocksOfTask), [&](const auto& range) {
      for (std::size_t n = range.begin(); n < range.end(); ++n) sides[n] = sideOf(blocks[n]);
    });
    std::vector<VoxelBlock> meeting;
    for (std::size_t n = 0; n < blocks.size(); ++n) {
      if (sides[n] == Side::band) meeting.push_back(blocks[n]);
      if (sides[n] == Side::inside) found_.inside.push_back(blocks[n]);
    }
    return meeting;
  }

  static std::vector<VoxelBlock> divided(const std::vector<VoxelBlock>& blocks) {
    std::vector<VoxelBlock> parts;
    parts.reserve(8 * blocks.size());
    for (const VoxelBlock& block : blocks)
      for (int child = 0; child < 8; ++child) {
        const std::int32_t half = block.size / 2;
        Index first = block.first;
        for (int axis = 0; axis < 3; ++axis) first[axis] += (child >> axis & 1) * half;
        parts.push_back({first, half});
      }
    return parts;
  }

  void requireRoots(const Box& inVoxels) const {
    const Vector3 roots = (inVoxels.sizes() / kRootSize).array().ceil() + 1;
    requireMemory("a level set with voxels of " + text(voxel_), roots.prod() * 8 * sizeof(VoxelBlock), kAdvice);
  }

  /// Throws `Error` if the leaf nodes in `count` blocks of this size need too much memory. A surface that passes
  /// through a block of n leaf nodes along an edge meets n² of them or more. Blocks may have been kept although no
  /// surface passes through, or only a small part of it, so that a quarter of that number is taken.
  void requireLeaves(std::size_t count, std::int32_t size, double longest) const {
    const double along = std::max(1.0, std::min(double(size), longest) / kLeafSize);
    const double leaves = size == kLeafSize ? double(count) : double(count) * along * along / 4;
    requireMemory("a level set with voxels of " + text(voxel_), leaves * kBytesOfLeaf, kAdvice);
  }

  static std::string text(double number) {
    std::string digits(32, '\0');
    digits.resize(std::size_t(std::snprintf(digits.data(), digits.size(), "%g", number)));
    return digits;
  }

  static constexpr const char* kAdvice = "give larger voxels";

  RangeIndex index_;
  double voxel_;
  double band_;
  Box box_;
  BandBlocks found_;
};

}  // namespace

BandBlocks findBandBlocks(const Field& field, double voxel, double band, const Progress& progress) {
  return BlockSearch(field, voxel, band).find(progress);
}

}  // namespace hpsdf::vdb
