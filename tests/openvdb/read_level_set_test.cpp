// Tests read_level_set.h: level sets as distances, and files that are damaged.
#include "hpsdf/openvdb/read_level_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/MeshToVolume.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>
#include <iostream>
#include <iterator>

#include "bunny.h"
#include "hpsdf/build.h"
#include "support/near_points.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace read_level_set_test {

constexpr double kRadius = 0.8, kVoxel = 0.05;
const Vector3 kCenter(0.1, 0.2, 0.3);

class ReadLevelSet : public testing::Test {
 protected:
  static void SetUpTestSuite() { openvdb::initialize(); }

  std::filesystem::path write(const openvdb::GridBase::Ptr& grid, const std::string& name = "grid.vdb") const {
    openvdb::io::File((folder_ / name).string()).write(openvdb::GridPtrVec{grid});
    return folder_ / name;
  }
  std::filesystem::path writeBytes(const std::string& bytes) const {
    std::ofstream(folder_ / "bytes.vdb", std::ios::binary) << bytes;
    return folder_ / "bytes.vdb";
  }
  std::string bytesOf(const std::filesystem::path& file) const {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  static openvdb::FloatGrid::Ptr sphere() {
    return openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
        float(kRadius), openvdb::Vec3f(float(kCenter.x()), float(kCenter.y()), float(kCenter.z())), float(kVoxel));
  }
  /// Expects an error that names the file and contains `message`.
  static void expectRefused(const std::filesystem::path& file, const std::string& message) {
    try {
      vdb::loadVdb(file);
      ADD_FAILURE() << "read: " << file;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::file);
      EXPECT_EQ(error.subject(), file.string());
      EXPECT_THAT(error.what(), testing::HasSubstr(message));
    }
  }

  support::TemporaryDirectory folder_;
};

TEST_F(ReadLevelSet, isTheDistanceInTheBandAndBeyond) {
  const GridDistance distance = vdb::loadVdb(write(sphere()));
  const Source& source = distance.source();
  EXPECT_EQ(source.name, "grid.vdb");
  EXPECT_NE(source.fingerprint, 0u);
  EXPECT_TRUE(
      source.box.isApprox(Box(kCenter - Vector3::Constant(kRadius), kCenter + Vector3::Constant(kRadius)), 2e-3));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1.5, 1.5);
  std::vector<Vector3> points(3000), gradients(points.size());
  for (Vector3& x : points) x = kCenter + Vector3(uniform(random), uniform(random), uniform(random));
  std::vector<double> values(points.size()), again(points.size());
  distance(points, values);
  distance.withGradients(points, again, gradients);
  EXPECT_EQ(values, again);
  for (std::size_t n = 0; n < points.size(); ++n) {
    const Vector3 x = points[n] - kCenter;
    const double expected = x.norm() - kRadius;
    // Near the end of the band, samples of the mesh take part, whose facets cut off up to a voxel² / (8 · radius).
    const double tolerance = std::abs(expected) < 1.5 * kVoxel ? 1e-4 : 2e-3;
    EXPECT_NEAR(values[n], expected, tolerance) << x.transpose();
    EXPECT_LT((gradients[n] - x.normalized()).norm(), x.norm() > 0.1 ? 0.1 : 2.01) << x.transpose();
  }
  const InterpolationError error = distance.interpolationError();
  EXPECT_GT(error.samples, 5000u);
  EXPECT_GT(error.rms, 1e-6);
  EXPECT_LT(error.max, 2e-3);
}

TEST_F(ReadLevelSet, keepsTransformsAndTakesDoubles) {
  const auto grid = std::make_shared<openvdb::DoubleGrid>(*sphere());
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  const auto transform = openvdb::math::Transform::createLinearTransform(kVoxel);
  transform->postTranslate(openvdb::Vec3d(5, 0, 0));
  grid->setTransform(transform);
  const Source source = vdb::loadVdb(write(grid)).source();
  EXPECT_NEAR(source.box.center().x(), 5 + kCenter.x(), 1e-3);
}

TEST_F(ReadLevelSet, refusesGridsThatItCannotUse) {
  const auto fog = sphere();
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  expectRefused(write(fog), "no level set");
  const auto rotated = sphere();
  rotated->transform().postRotate(0.3, openvdb::math::X_AXIS);
  expectRefused(write(rotated), "along the axes");
  const auto empty = openvdb::FloatGrid::create(0.1f);
  empty->setGridClass(openvdb::GRID_LEVEL_SET);
  expectRefused(write(empty), "no surface");
}

/// An active tile takes a few bytes of the file, and 4096³ voxels where it is divided.
TEST_F(ReadLevelSet, refusesValuesThatAreNotFinite) {
  for (const float bad : {std::nanf(""), HUGE_VALF}) {
    const openvdb::FloatGrid::Ptr grid = sphere();
    grid->tree().beginValueOn().setValue(bad);
    expectRefused(write(grid), "a value that is not a finite number");
    const openvdb::FloatGrid::Ptr background = openvdb::FloatGrid::create(bad);
    background->setGridClass(openvdb::GRID_LEVEL_SET);
    expectRefused(write(background), "the background of the level set is not a finite number");
  }
}

TEST_F(ReadLevelSet, isAccurateFarFromTheOrigin) {
  const Vector3 shift(1e6, -2e6, 3e5);
  const openvdb::FloatGrid::Ptr grid = sphere();
  grid->transform().postTranslate(openvdb::Vec3d(shift.x(), shift.y(), shift.z()));
  const DistanceFunction distance = vdb::loadVdb(write(grid));
  for (const Vector3& direction : {Vector3(1, 0, 0), Vector3(0, 0.6, 0.8), Vector3(-0.6, 0, 0.8)})
    for (const double radius : {0.1, kRadius, 1.5}) {
      const Vector3 x = kCenter + shift + radius * direction;
      double value = 0;
      distance({&x, 1}, {&value, 1});
      EXPECT_NEAR(value, radius - kRadius, 2e-3) << radius;
    }
  grid->transform().postTranslate(openvdb::Vec3d(1e12, 0, 0));
  expectRefused(write(grid), "that rounding spoils them");
  const openvdb::FloatGrid::Ptr vast = sphere();
  vast->setTransform(openvdb::math::Transform::createLinearTransform(1e100));
  expectRefused(write(vast), "that rounding spoils them");
}

TEST_F(ReadLevelSet, refusesTilesThatMemoryCannotHold) {
  const auto grid = sphere();
  grid->tree().addTile(3, openvdb::Coord(1 << 14, 0, 0), 0.1f, true);
  try {
    vdb::loadVdb(write(grid));
    ADD_FAILURE() << "the file was read";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::limit);
    EXPECT_THAT(error.what(), testing::HasSubstr("memory"));
  }
}

TEST_F(ReadLevelSet, refusesForeignAndTruncatedFiles) {
  expectRefused(folder_ / "none.vdb", "no such file");
  expectRefused(folder_.path(), "a directory, not a file");
  ASSERT_EQ(mkfifo((folder_ / "pipe.vdb").c_str(), 0600), 0);
  expectRefused(folder_ / "pipe.vdb", "not a regular file");
  expectRefused(writeBytes(""), "no OpenVDB file");
  expectRefused(writeBytes("solid foreign\nendsolid\n"), "no OpenVDB file");
  const std::string whole = bytesOf(write(sphere()));
  for (std::size_t part = 0; part < 40; ++part) {
    const std::size_t length = whole.size() * part / 40;
    SCOPED_TRACE(length);
    expectRefused(writeBytes(whole.substr(0, length)), part == 0 ? "no OpenVDB file" : "ends too early");
  }
  expectRefused(writeBytes(whole.substr(0, whole.size() - 1)), "ends too early");
}

TEST_F(ReadLevelSet, givesTheBunnyInFewerBytes) {
  const std::optional<TriangleMesh> mesh = bunnyMesh();
  if (!mesh) GTEST_SKIP() << "HPSDF_MESHES is not set";
  std::vector<openvdb::Vec3s> vertices;
  std::vector<openvdb::Vec3I> triangles;
  for (const Vector3& v : mesh->vertices) vertices.emplace_back(float(v.x()), float(v.y()), float(v.z()));
  for (const auto& [a, b, c] : mesh->triangles) triangles.emplace_back(a, b, c);
  const auto transform = openvdb::math::Transform::createLinearTransform(kBunnyVoxel);
  const auto grid = openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, vertices, triangles, 3);
  const GridDistance distance = vdb::loadVdb(write(grid));

  const std::vector<Vector3> points = support::pointsNear(*mesh, 200'000, 0.02);
  std::vector<double> expected(points.size()), values(points.size());
  ExactDistance exact(*mesh);
  exact(points, expected);
  distance(points, values);
  const double ofGrid = rmsDifference(values, expected);
  // The settings of the benchmark "near", but for the error.
  const Field field =
      build(distance, bunnyDomain(),
            {.targetError = 5e-9, .grid = {16, 16, 16}, .nearness = 256, .maxDegree = 3, .quadrature = 2});
  field.values(points, values);
  const double ofField = rmsDifference(values, expected);
  std::cout << "RMS within 0.02: level set " << ofGrid << ", field " << ofField << "; bytes: level set "
            << grid->memUsage() << ", field " << field.bytes() << '\n';
  EXPECT_LE(ofField, 1.1 * 2.1e-4);
  EXPECT_LE(double(field.bytes()), 0.15 * double(grid->memUsage()));
}

}  // namespace read_level_set_test
}  // namespace hpsdf
