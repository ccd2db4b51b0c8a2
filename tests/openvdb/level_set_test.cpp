// Tests level_set.h: level sets of fields, judged by OpenVDB's own checks.
#include "hpsdf/openvdb/level_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/MeshToVolume.h>

#include <fstream>
#include <iterator>

#include "bunny.h"
#include "hpsdf/build.h"
#include "hpsdf/shapes.h"
#include "level_set_grid.h"
#include "support/near_points.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace level_set_test {

using vdb::LevelSetOptions;

const Field& torus() {
  static const Field field = [] {
    const DistanceFunction distance = shapes::analytic("analytic:torus");
    return build(distance, domainAround(distance.source().box), {.targetError = 1e-8});
  }();
  return field;
}

std::string fileOf(const LevelSetOptions& options, bool isNano = false) {
  const support::TemporaryDirectory folder;
  OutputFile out(folder / "grid");
  isNano ? vdb::writeNanoVdb(torus(), options, out) : vdb::writeVdb(torus(), options, out);
  out.commit();
  std::ifstream stream(folder / "grid", std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Expects that exactly the voxels of a box with |f| below the width of the band are active, with the field's values,
/// and that the others have the sign of the field.
void expectLevelSetOf(const Field& field, const openvdb::FloatGrid& grid, double voxel, int reach) {
  const auto accessor = grid.getConstAccessor();
  const float background = grid.background();
  for (int x = -reach; x <= reach; ++x)
    for (int y = -reach; y <= reach; ++y)
      for (int z = -reach; z <= reach; ++z) {
        const auto expected = float(field.value(voxel * Vector3(x, y, z)));
        float value = 0;
        const bool isActive = accessor.probeValue({x, y, z}, value);
        ASSERT_EQ(isActive, std::abs(expected) < background) << x << ' ' << y << ' ' << z;
        ASSERT_EQ(value, isActive ? expected : expected < 0 ? -background : background);
      }
}

TEST(LevelSet, holdsTheBandAndTheSign) {
  const double voxel = 0.03;
  const auto grid = vdb::makeLevelSet(torus(), {.voxel = voxel}, {});
  EXPECT_EQ(openvdb::tools::checkLevelSet(*grid), "");
  EXPECT_EQ(grid->getName(), "surface");
  EXPECT_EQ(grid->voxelSize(), openvdb::Vec3d(voxel));
  expectLevelSetOf(torus(), *grid, voxel, 50);
  const vdb::LevelSetFigures figures = vdb::figuresOf(*grid);
  EXPECT_EQ(figures.activeVoxels, grid->activeVoxelCount());
  EXPECT_LT(figures.leafNodes, 6 * figures.activeVoxels / 512) << "blocks without a part of the band are not stored";
}

TEST(LevelSet, closesASolidThatTheDomainCuts) {
  const DistanceFunction sphere([](const Vector3& x) { return x.norm() - 1; });
  const Field field = build(sphere, Box(Vector3(-0.5, -2, -2), Vector3(2, 2, 2)), {.targetError = 1e-7});
  const auto grid = vdb::makeLevelSet(field, {.voxel = 0.05, .halfWidth = 2}, {});
  expectLevelSetOf(field, *grid, 0.05, 45);
  EXPECT_LT(grid->evalActiveVoxelBoundingBox().min().x(), -20) << "as far outside as the field is negative at the wall";
}

TEST(LevelSet, isTheSameFileForAnyNumberOfThreads) {
  for (const bool isNano : {false, true}) {
    const std::string file = fileOf({.voxel = 0.04, .threads = 1}, isNano);
    EXPECT_EQ(file, fileOf({.voxel = 0.04, .threads = 4}, isNano));
    EXPECT_NE(file, fileOf({.voxel = 0.04, .halfWidth = 4}, isNano));
  }
}

TEST(LevelSet, refusesWhatMemoryCannotHold) {
  for (const double voxel : {1e-5, 1e-7, 1e-9, 1e-300, 0.0, -1.0, std::nan("")}) {
    SCOPED_TRACE(voxel);
    EXPECT_THROW(vdb::makeLevelSet(torus(), {.voxel = voxel}, {}), Error);
  }
  EXPECT_THROW(vdb::makeLevelSet(torus(), {.voxel = 0.1, .halfWidth = 0.5}, {}), Error);
  EXPECT_THROW(vdb::makeLevelSet(torus(), {.voxel = 0.1, .halfWidth = 1e9}, {}), Error);
}

TEST(LevelSet, stopsWhenCancelled) {
  EXPECT_THROW(vdb::makeLevelSet(torus(), {.voxel = 0.05}, {.cancelled = [] { return true; }}), Cancelled);
}

std::vector<double> trilinear(const openvdb::FloatGrid& grid, const std::vector<Vector3>& points) {
  const auto accessor = grid.getConstAccessor();
  const openvdb::tools::GridSampler<openvdb::FloatGrid::ConstAccessor, openvdb::tools::BoxSampler> sampler(
      accessor, grid.transform());
  std::vector<double> values;
  for (const Vector3& x : points) values.push_back(sampler.wsSample(openvdb::Vec3d(x.x(), x.y(), x.z())));
  return values;
}

openvdb::FloatGrid::Ptr levelSetOfMesh(const TriangleMesh& mesh) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  for (const Vector3& v : mesh.vertices) points.emplace_back(float(v.x()), float(v.y()), float(v.z()));
  for (const auto& [a, b, c] : mesh.triangles) triangles.emplace_back(a, b, c);
  const auto transform = openvdb::math::Transform::createLinearTransform(kBunnyVoxel);
  return openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, points, triangles, 3);
}

TEST(LevelSet, ofTheBunnyIsAsExactAsOpenVdbs) {
  const std::optional<TriangleMesh> mesh = bunnyMesh();
  if (!mesh) GTEST_SKIP() << "HPSDF_MESHES is not set";
  openvdb::initialize();
  const ExactDistance exact(*mesh);
  const std::vector<Vector3> points = support::pointsNear(*mesh, 200'000, 0.02);
  std::vector<double> expected(points.size());
  exact(points, expected);
  const double theirs = rmsDifference(trilinear(*levelSetOfMesh(*mesh), points), expected);
  // As in the benchmark "near", but with an error that is small beside that of the trilinear interpolation.
  const Field field =
      build(exact, bunnyDomain(),
            {.targetError = 1e-9, .grid = {16, 16, 16}, .nearness = 256, .maxDegree = 3, .quadrature = 2});
  const auto grid = vdb::makeLevelSet(field, {.voxel = kBunnyVoxel}, {});
  EXPECT_EQ(openvdb::tools::checkLevelSet(*grid, 6), "");
  const double ours = rmsDifference(trilinear(*grid, points), expected);
  RecordProperty("ours", std::to_string(ours));
  std::cout << "RMS within 0.02: OpenVDB's " << theirs << ", the field's " << ours << '\n';
  EXPECT_LE(ours, theirs);
}

}  // namespace level_set_test
}  // namespace hpsdf
