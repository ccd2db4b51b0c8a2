#include "level_set_grid.h"

#include <tbb/parallel_for.h>

#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <vector>

#include "band_blocks.h"
#include "hpsdf/detail/threads.h"

namespace hpsdf::vdb {
namespace {

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;
static_assert(Leaf::DIM == kLeafSize);

constexpr std::size_t kLeavesBetweenReports = 1024;

openvdb::CoordBBox boxOf(const VoxelBlock& block) {
  return openvdb::CoordBBox::createCube(openvdb::Coord(block.first[0], block.first[1], block.first[2]),
                                        openvdb::Coord::ValueType(block.size));
}

/// Evaluates the field at the voxels of a leaf node.
std::array<double, Leaf::SIZE> valuesOf(const Field& field, const Leaf& leaf, double voxel) {
  std::array<Vector3, Leaf::SIZE> points;
  for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
    const openvdb::Coord index = leaf.offsetToGlobalCoord(n);
    points[n] = voxel * Vector3(index.x(), index.y(), index.z());
  }
  std::array<double, Leaf::SIZE> values;
  field.values(points, values);
  return values;
}

std::unique_ptr<Leaf> makeLeaf(const Field& field, const VoxelBlock& block, double voxel, float background) {
  auto leaf = std::make_unique<Leaf>(boxOf(block).min(), background, false);
  const auto values = valuesOf(field, *leaf, voxel);
  for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
    const auto value = static_cast<float>(values[n]);
    if (std::abs(value) < background)
      leaf->setValueOn(n, value);
    else
      leaf->setValueOff(n, value < 0 ? -background : background);
  }
  return leaf;
}

std::vector<std::unique_ptr<Leaf>> makeLeaves(const Field& field, const std::vector<VoxelBlock>& blocks, double voxel,
                                              float background, const Progress& progress) {
  std::vector<std::unique_ptr<Leaf>> leaves(blocks.size());
  for (std::size_t first = 0; first < blocks.size(); first += kLeavesBetweenReports) {
    progress.update("sampling", double(first) / double(blocks.size()));
    const std::size_t end = std::min(first + kLeavesBetweenReports, blocks.size());
    tbb::parallel_for(first, end, [&](std::size_t n) { leaves[n] = makeLeaf(field, blocks[n], voxel, background); });
  }
  return leaves;
}

/// Adds a leaf node to a tree. A leaf node without voxels in the band is not stored if it is all inside or all outside.
void addLeaf(std::unique_ptr<Leaf> leaf, Tree& tree) {
  const float background = tree.background();
  float value = 0;
  bool isActive = false;
  if (!leaf->isConstant(value, isActive) || isActive)
    tree.addLeaf(leaf.release());
  else if (value < 0)
    tree.sparseFill(leaf->getNodeBoundingBox(), -background, false);
}

void checkLevelSetOptions(const LevelSetOptions& options) {
  if (!(options.voxel > 0) || !std::isfinite(options.voxel))
    throw Error(ErrorKind::option, "voxel", "the size of a voxel must be a positive length");
  if (!(options.halfWidth >= 1) || !(options.halfWidth <= 1000))
    throw Error(ErrorKind::option, "band", "the width of the band must be between 1 and 1000 voxels");
}

openvdb::FloatGrid::Ptr makeGrid(const Field& field, const LevelSetOptions& options, const Progress& progress) {
  const double band = options.voxel * options.halfWidth;
  const auto background = static_cast<float>(band);
  const BandBlocks blocks = findBandBlocks(field, options.voxel, band, progress);
  auto leaves = makeLeaves(field, blocks.leaves, options.voxel, background, progress);
  const auto grid = openvdb::FloatGrid::create(background);
  for (const VoxelBlock& block : blocks.inside) grid->tree().sparseFill(boxOf(block), -background, false);
  for (auto& leaf : leaves) addLeaf(std::move(leaf), grid->tree());
  openvdb::tools::prune(grid->tree());
  return grid;
}

}  // namespace

openvdb::FloatGrid::Ptr makeLevelSet(const Field& field, const LevelSetOptions& options, const Progress& progress) {
  checkLevelSetOptions(options);
  openvdb::initialize();
  const auto grid = withThreads(options.threads, [&] { return makeGrid(field, options, progress); });
  grid->setName("surface");
  grid->setCreator("hpsdf");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(options.voxel));
  return grid;
}

LevelSetFigures figuresOf(const openvdb::FloatGrid& grid) {
  return {
      .activeVoxels = grid.activeVoxelCount(), .leafNodes = grid.tree().leafCount(), .memoryBytes = grid.memUsage()};
}

}  // namespace hpsdf::vdb
