#include "hpsdf/openvdb/read_level_set.h"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Morphology.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/exact_distance.h"

namespace hpsdf::vdb {
namespace {

namespace fs = std::filesystem;

constexpr int kLayersAroundBand = 2;  ///< as far as the stencil of the interpolation reaches

using Grid = openvdb::FloatGrid;
using Leaf = Grid::TreeType::LeafNodeType;
constexpr std::int32_t kLeafEdge = SampledBlocks::kSize;
static_assert(Leaf::DIM == kLeafEdge);

[[noreturn]] void refuseFile(const fs::path& file, const std::string& problem) {
  throw Error(ErrorKind::file, file.string(), problem);
}

/// Throws `Error` unless the file can be opened: reading a pipe, for instance, would wait without end.
void requireRegularFile(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) refuseFile(file, "no such file; check the path");
  if (fs::is_directory(status)) refuseFile(file, "a directory, not a file; name a file in it");
  if (!fs::is_regular_file(status)) refuseFile(file, "not a regular file; name one");
}

/// Throws `Error` if the file cannot be read or does not begin as OpenVDB files do.
void requireVdbFile(const fs::path& file, std::ifstream& stream) {
  if (!stream) refuseFile(file, "cannot be read; check its permissions");
  constexpr char kMagic[8] = {' ', 'B', 'D', 'V', 0, 0, 0, 0};
  char begin[8] = {};
  stream.read(begin, sizeof(begin));
  if (!stream || !std::equal(begin, begin + sizeof(begin), kMagic))
    refuseFile(file, "this is no OpenVDB file: it does not begin as such files do");
  stream.seekg(0);
}

/// Reads all grids of a file. A file that ends too early makes the stream throw.
openvdb::GridPtrVecPtr readGrids(const fs::path& file) {
  requireRegularFile(file);
  std::ifstream stream(file, std::ios::binary);
  requireVdbFile(file, stream);
  stream.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
  try {
    return openvdb::io::Stream(stream, /*delayLoad=*/false).getGrids();
  } catch (const std::exception&) {
    refuseFile(file, "the OpenVDB file is damaged or ends too early, or a newer version of OpenVDB wrote it");
  }
}

/// Returns the grid as floats if it is a level set of floats or doubles, and otherwise null.
Grid::Ptr asLevelSet(const openvdb::GridBase::Ptr& grid) {
  if (grid->getGridClass() != openvdb::GRID_LEVEL_SET) return nullptr;
  if (auto floats = openvdb::gridPtrCast<Grid>(grid)) return floats;
  if (const auto doubles = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid)) return std::make_shared<Grid>(*doubles);
  return nullptr;
}

void requireSampleMemory(double blocks) {
  requireMemory("the samples of the level set", blocks * 2 * sizeof(SampledBlocks::Block),
                "take a level set with larger voxels");
}

/// Throws `Error` for a grid whose active voxels do not fit into memory. Active tiles, of which a level set has none,
/// hold up to 4096³ voxels each in a few bytes of a file.
void requireVoxelMemory(const Grid& grid) {
  const double voxels = double(grid.tree().activeVoxelCount()) - double(grid.tree().activeLeafVoxelCount());
  requireSampleMemory(voxels / Leaf::NUM_VALUES + double(grid.tree().leafCount()));
}

/// Throws `Error` for a grid with a value that is not finite.
void requireFiniteValues(const Grid& grid, const fs::path& file) {
  if (!std::isfinite(grid.background())) refuseFile(file, "the background of the level set is not a finite number");
  for (auto value = grid.cbeginValueAll(); value; ++value)
    if (!std::isfinite(*value))
      refuseFile(file, "the level set has a value that is not a finite number; repair it or write it again");
}

Grid::Ptr levelSetOf(const fs::path& file) {
  const openvdb::GridPtrVecPtr grids = readGrids(file);
  for (const openvdb::GridBase::Ptr& grid : *grids)
    if (Grid::Ptr found = asLevelSet(grid)) {
      requireVoxelMemory(*found);
      requireFiniteValues(*found, file);
      return found;
    }
  refuseFile(file, "the file holds no level set of floats or doubles");
}

/// Returns the world positions of the voxel 0 and the edges of voxels. Throws `Error` if the axes of the grid are not
/// those of the world.
std::pair<Vector3, Vector3> originAndSpacing(const Grid& grid, const fs::path& file) {
  const openvdb::math::Transform& transform = grid.transform();
  const auto at = [&](double x, double y, double z) {
    const openvdb::Vec3d p = transform.indexToWorld(openvdb::Vec3d(x, y, z));
    return Vector3(p.x(), p.y(), p.z());
  };
  const Vector3 origin = at(0, 0, 0);
  const std::array<Vector3, 3> edges = {at(1, 0, 0) - origin, at(0, 1, 0) - origin, at(0, 0, 1) - origin};
  Vector3 spacing;
  for (int axis = 0; axis < 3; ++axis) {
    spacing[axis] = edges[axis][axis];
    const double rest = (edges[axis] - spacing[axis] * Vector3::Unit(axis)).norm();
    if (!transform.isLinear() || !(spacing[axis] > 0) || rest > 1e-9 * spacing[axis])
      refuseFile(file, "the grid is rotated, sheared or tapered; expected one along the axes");
  }
  if (!origin.allFinite() || !spacing.allFinite()) refuseFile(file, "the transform of the grid is not finite");
  return {origin, spacing};
}

/// Throws `Error` for a grid so far from the origin, or with so great coordinates, that rounding spoils its voxels.
void requireUsablePlacement(const Grid& grid, const Vector3& origin, const Vector3& spacing, const fs::path& file) {
  constexpr double kLeastShare = 0x1p-40;  // of the coordinates; less is a few thousand times their rounding
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (box.empty()) refuseFile(file, "the level set has no surface");
  for (const openvdb::Coord& corner : {box.min(), box.max()}) {
    const Vector3 at = origin + Vector3(corner.x(), corner.y(), corner.z()).cwiseProduct(spacing);
    const double farthest = at.cwiseAbs().maxCoeff();
    if (!(farthest <= kLargestCoordinate) || spacing.minCoeff() < kLeastShare * farthest)
      refuseFile(file, "the grid is so far from the origin, compared with its voxels, that rounding spoils them");
  }
}

/// Returns a mesh of the level set's surface, with triangles that face outward. OpenVDB makes it in single precision;
/// therefore it is made in units of voxels, from a corner of the level set.
TriangleMesh surfaceMesh(Grid& grid, const Vector3& origin, const Vector3& spacing, const std::string& name) {
  const openvdb::Coord first = grid.evalActiveVoxelBoundingBox().min();
  const Grid::Ptr inVoxels = grid.copy();  // shares the voxels
  inVoxels->setTransform(openvdb::math::Transform::createLinearTransform());
  inVoxels->transform().postTranslate(-first.asVec3d());
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*inVoxels, points, quads);
  TriangleMesh mesh;
  mesh.name = name;
  const Vector3 corner = origin + Vector3(first.x(), first.y(), first.z()).cwiseProduct(spacing);
  for (const openvdb::Vec3s& p : points)
    mesh.vertices.push_back(corner + Vector3(p.x(), p.y(), p.z()).cwiseProduct(spacing));
  for (const openvdb::Vec4I& q : quads) {
    mesh.triangles.push_back({q[0], q[2], q[1]});
    mesh.triangles.push_back({q[0], q[3], q[2]});
  }
  if (signedVolume(mesh) < 0)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

/// Copies a leaf node. Voxels that were active in the level set keep their values, those around them get the distance
/// `beyond`, and the others none.
SampledBlocks::Block blockOf(const Leaf& leaf, const Grid& levelSet, const Vector3& origin, const Vector3& spacing,
                             const DistanceFunction& beyond) {
  SampledBlocks::Block block;
  const openvdb::Coord first = leaf.origin();
  block.index = {first.x() >> 3, first.y() >> 3, first.z() >> 3};
  block.values.fill(std::numeric_limits<double>::quiet_NaN());
  const Grid::ConstAccessor accessor = levelSet.getConstAccessor();
  std::vector<std::size_t> places;
  std::vector<Vector3> points;
  for (auto voxel = leaf.cbeginValueOn(); voxel; ++voxel) {
    const openvdb::Coord index = voxel.getCoord(), local = index - first;
    const auto place = std::size_t((local.z() * kLeafEdge + local.y()) * kLeafEdge + local.x());
    float value = 0;
    if (accessor.probeValue(index, value)) {
      block.values[place] = value;
    } else {
      places.push_back(place);
      points.push_back(origin + Vector3(index.x(), index.y(), index.z()).cwiseProduct(spacing));
    }
  }
  std::vector<double> values(points.size());
  beyond(points, values);
  for (std::size_t n = 0; n < places.size(); ++n) block.values[places[n]] = values[n];
  return block;
}

SampledBlocks samplesOf(const Grid& levelSet, const Vector3& origin, const Vector3& spacing,
                        const DistanceFunction& beyond) {
  // Only which voxels are active in the copy matters: those of the band and the layers around it.
  Grid::TreeType widened(levelSet.tree());
  openvdb::tools::dilateActiveValues(widened, kLayersAroundBand, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::EXPAND_TILES);
  widened.voxelizeActiveTiles();
  std::vector<const Leaf*> leaves;
  for (auto leaf = widened.cbeginLeaf(); leaf; ++leaf) leaves.push_back(leaf.getLeaf());
  requireSampleMemory(double(leaves.size()));
  SampledBlocks samples{.origin = origin, .spacing = spacing, .blocks = {}};
  samples.blocks.resize(leaves.size());
  tbb::parallel_for(std::size_t{0}, leaves.size(),
                    [&](std::size_t n) { samples.blocks[n] = blockOf(*leaves[n], levelSet, origin, spacing, beyond); });
  return samples;
}

}  // namespace

GridDistance loadVdb(const fs::path& file, int threads, const Progress& progress) {
  openvdb::initialize();
  return withThreads(threads, [&] {
    progress.update("reading", 0);
    const Grid::Ptr levelSet = levelSetOf(file);
    const auto [origin, spacing] = originAndSpacing(*levelSet, file);
    requireUsablePlacement(*levelSet, origin, spacing, file);
    const TriangleMesh mesh = surfaceMesh(*levelSet, origin, spacing, file.filename().string());
    if (mesh.triangles.empty()) refuseFile(file, "the level set has no surface");
    const DistanceFunction beyond(ExactDistance(mesh, {.threads = threads}, progress));
    return GridDistance(samplesOf(*levelSet, origin, spacing, beyond), beyond, {.name = file.filename().string()});
  });
}

}  // namespace hpsdf::vdb
