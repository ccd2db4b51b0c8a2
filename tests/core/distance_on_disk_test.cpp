// Distances to meshes that are divided into parts on the disk equal those of meshes in memory, to the bit.

#include "hpsdf/input/distance_on_disk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/shapes.h"
#include "support/message_of.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace {

namespace fs = std::filesystem;
using support::messageOf;
using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kTorus = "torus,segments=40,sides=20";

struct Values {
  std::vector<double> distances;
  std::vector<Vector3> gradients;

  bool operator==(const Values&) const = default;
};

template <typename Distance>
Values valuesOf(const Distance& distance, const std::vector<Vector3>& points) {
  Values values{std::vector<double>(points.size()), std::vector<Vector3>(points.size())};
  distance.withGradients(points, values.distances, values.gradients);
  return values;
}

/// Returns points in and around a box, close to the vertices of a mesh, on them, and far away.
std::vector<Vector3> pointsAround(const TriangleMesh& mesh) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(-1, 1);
  const auto vector = [&] { return Vector3(anywhere(random), anywhere(random), anywhere(random)); };
  const Box box = boundingBox(mesh);
  std::vector<Vector3> points;
  for (int i = 0; i < 3000; ++i) points.push_back(box.center() + box.sizes().cwiseProduct(vector()));
  for (int i = 0; i < 3000; ++i) {
    const Vector3& vertex = mesh.vertices[random() % mesh.vertices.size()];
    points.push_back(i % 3 == 0 ? vertex : Vector3(vertex + 1e-3 * vector()));
  }
  for (int i = 0; i < 50; ++i) points.push_back(std::pow(10.0, i % 12) * vector());
  points.push_back(box.center());
  return points;
}

std::string contentsOf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(DistanceOnDisk, EqualsTheDistanceInMemory) {
  for (const char* shape : {"structured-bowl,cells=40", kTorus, "box", "gear"}) {
    SCOPED_TRACE(shape);
    const TriangleMesh mesh = shapes::mesh(shape);
    const std::vector<Vector3> points = pointsAround(mesh);
    const ExactDistance inMemory(mesh);
    ASSERT_EQ(inMemory.insideTestChoice().insideTest, InsideTest::pseudonormal);
    const Values expected = valuesOf(inMemory, points);
    for (const std::size_t facesOfPart :
         {mesh.triangles.size() / 40, mesh.triangles.size() / 7, mesh.triangles.size()}) {
      const support::TemporaryDirectory folder;
      const DistanceOnDisk onDisk(mesh, folder.path(), {.facesOfPart = facesOfPart});
      EXPECT_EQ(valuesOf(onDisk, points), expected) << onDisk.parts() << " parts";
      std::vector<double> distances(points.size());
      onDisk(points, distances);
      EXPECT_EQ(distances, expected.distances);
    }
  }
}

TEST(DistanceOnDisk, MakesTheSameFieldWithHardlyAnyMemory) {
  const support::TemporaryDirectory folder;
  const TriangleMesh mesh = shapes::mesh("structured-bowl,cells=30");
  const DistanceOnDisk onDisk(mesh, folder.path(), {.facesOfPart = 300, .memory = 1});
  ASSERT_GT(onDisk.parts(), 20);
  const ExactDistance inMemory(mesh);
  const Box domain(Vector3::Constant(-1.2), Vector3::Constant(1.2));
  const BuildOptions options{.targetError = 1e-4, .estimator = Estimator::embedded, .strategy = Strategy::hp};
  const fs::path one = folder.path() / "one.hpsdf", other = folder.path() / "other.hpsdf";
  save(build(inMemory, domain, options), one);
  save(build(onDisk, domain, options), other);
  EXPECT_TRUE(contentsOf(one) == contentsOf(other)) << "the files differ";
  EXPECT_GT(onDisk.mappings(), 10 * onDisk.parts());
}

TEST(DistanceOnDisk, MapsOnlyPartsThatMayHoldTheNearestTriangle) {
  const support::TemporaryDirectory folder;
  const TriangleMesh mesh = shapes::mesh("structured-bowl,cells=40");
  const DistanceOnDisk onDisk(mesh, folder.path(), {.insideTest = InsideTest::pseudonormal, .facesOfPart = 300});
  const Vector3 point = mesh.vertices[0] + Vector3::Constant(1e-6);
  double distance = 0;
  onDisk({&point, 1}, {&distance, 1});
  EXPECT_GE(onDisk.mappings(), 1);
  EXPECT_LE(onDisk.mappings(), 8);
  EXPECT_LT(onDisk.mappings(), onDisk.parts() / 4);
}

TEST(DistanceOnDisk, ReadsBinaryPlyFilesWithoutLoadingThem) {
  const support::TemporaryDirectory folder;
  const fs::path file = folder.path() / "bowl.ply";
  saveMesh(shapes::mesh("structured-bowl,cells=20"), file);
  ASSERT_TRUE(DistanceOnDisk::isMappable(file));
  const TriangleMesh mesh = importMesh(file).mesh;
  const DistanceOnDisk onDisk(file, folder.path(), {.facesOfPart = 300});
  const ExactDistance inMemory(mesh);
  const std::vector<Vector3> points = pointsAround(mesh);
  EXPECT_EQ(valuesOf(onDisk, points), valuesOf(inMemory, points));
  EXPECT_EQ(onDisk.source().fingerprint, inMemory.source().fingerprint);
  EXPECT_EQ(onDisk.source().name, "bowl.ply");
  EXPECT_TRUE(onDisk.source().box.isApprox(inMemory.source().box, 0));
}

TEST(DistanceOnDisk, DividesMeshesThatAreFlatToRounding) {
  const support::TemporaryDirectory folder;
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {1, 1, 1e-310}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, "flat"};
  const DistanceOnDisk onDisk(mesh, folder.path(), {.insideTest = InsideTest::pseudonormal, .facesOfPart = 1});
  const std::vector<Vector3> points = pointsAround(shapes::mesh("box"));
  EXPECT_EQ(valuesOf(onDisk, points), valuesOf(ExactDistance(mesh, {.insideTest = InsideTest::pseudonormal}), points));
}

TEST(DistanceOnDisk, RefusesPlyFilesWithMoreThanTheirHeaderPromises) {
  const support::TemporaryDirectory folder;
  const fs::path file = folder.path() / "torus.ply";
  saveMesh(shapes::mesh(kTorus), file);
  std::ofstream(file, std::ios::binary | std::ios::app) << "more";
  EXPECT_THAT(messageOf([&] { DistanceOnDisk(file, folder.path()); }), HasSubstr("than its header promises"));
}

TEST(DistanceOnDisk, UsesPartsThatAreThereAlready) {
  const support::TemporaryDirectory folder;
  const TriangleMesh mesh = shapes::mesh(kTorus);
  const DistanceOnDisk first(mesh, folder.path(), {.facesOfPart = 300});
  const auto written = fs::last_write_time(first.folder());
  const DistanceOnDisk second(mesh, folder.path(), {.facesOfPart = 100});
  EXPECT_EQ(second.folder(), first.folder());
  EXPECT_EQ(second.parts(), first.parts());
  EXPECT_EQ(fs::last_write_time(second.folder()), written);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);

  TriangleMesh other = mesh;
  other.name = "the same under another name";
  EXPECT_EQ(DistanceOnDisk(other, folder.path()).source().name, other.name);
  const std::vector<Vector3> points = pointsAround(mesh);
  EXPECT_EQ(valuesOf(DistanceOnDisk::open(first.folder()), points), valuesOf(first, points));
}

TEST(DistanceOnDisk, AnswersManyThreadsAtOnce) {
  const support::TemporaryDirectory folder;
  const TriangleMesh mesh = shapes::mesh(kTorus);
  const DistanceOnDisk onDisk(mesh, folder.path(), {.facesOfPart = 100, .memory = 1});
  const std::vector<Vector3> points = pointsAround(mesh);
  const Values expected = valuesOf(ExactDistance(mesh), points);
  tbb::parallel_for(std::size_t{0}, points.size() / 100, [&](std::size_t i) {
    const std::vector<Vector3> some(points.begin() + std::ptrdiff_t(100 * i),
                                    points.begin() + std::ptrdiff_t(100 * i + 100));
    const Values values = valuesOf(onDisk, some);
    for (std::size_t k = 0; k < some.size(); ++k) EXPECT_EQ(values.distances[k], expected.distances[100 * i + k]);
  });
}

TEST(DistanceOnDisk, PointsThatAreNotFiniteDoNotSpoilOthers) {
  const support::TemporaryDirectory folder;
  const TriangleMesh mesh = shapes::mesh(kTorus);
  const DistanceOnDisk onDisk(mesh, folder.path(), {.facesOfPart = 100});
  const std::vector<Vector3> points = {Vector3::Constant(std::numeric_limits<double>::quiet_NaN()), Vector3(1, 2, 3)};
  std::vector<double> distances(2);
  onDisk(points, distances);
  EXPECT_FALSE(std::isfinite(distances[0]));
  EXPECT_EQ(distances[1], ExactDistance(mesh)(points[1]));
}

TEST(DistanceOnDisk, RefusesMeshesWhoseSignNormalsDoNotTell) {
  const support::TemporaryDirectory folder;
  const auto refusal = [&](const TriangleMesh& mesh) {
    return messageOf([&] { DistanceOnDisk(mesh, folder.path(), {.facesOfPart = 100}); });
  };
  TriangleMesh open = shapes::mesh(kTorus);
  open.triangles.pop_back();
  EXPECT_THAT(refusal(open), HasSubstr("more faces in one direction"));

  TriangleMesh two = shapes::mesh(kTorus);
  const TriangleMesh one = two;
  const auto add = [&](const Vector3& by) {
    const auto first = static_cast<std::uint32_t>(two.vertices.size());
    for (const Vector3& x : one.vertices) two.vertices.push_back(x + by);
    for (const Triangle& t : one.triangles) two.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  };
  add(Vector3(20, 0, 0));
  EXPECT_THAT(refusal(two), HasSubstr("2 components"));
  two = one;
  add(Vector3(0.5, 0, 0));
  EXPECT_THAT(refusal(two), HasSubstr("intersects itself"));
  two = one;
  add(Vector3::Zero());
  EXPECT_THAT(refusal(two), HasSubstr("have the same position"));

  TriangleMesh inward = one;
  for (Triangle& t : inward.triangles) std::swap(t[0], t[1]);
  EXPECT_THAT(refusal(inward), HasSubstr("point inward"));
  TriangleMesh unused = one;
  unused.vertices.emplace_back(9, 9, 9);
  EXPECT_THAT(refusal(unused), HasSubstr("belongs to no face"));
  TriangleMesh wrong = one;
  wrong.triangles[3][1] = 1000000;
  EXPECT_THAT(refusal(wrong), AllOf(HasSubstr("face 4"), HasSubstr("1000001")));
  EXPECT_TRUE(fs::is_empty(folder.path())) << "nothing half-made is left";

  // The volume of an open mesh may be negative.
  TriangleMesh inside = open;
  for (Triangle& t : inside.triangles) std::swap(t[0], t[1]);
  EXPECT_NO_THROW(DistanceOnDisk(inside, folder.path(), {.insideTest = InsideTest::pseudonormal, .facesOfPart = 100}));

  const DistanceOnDisk trusted(open, folder.path(), {.insideTest = InsideTest::pseudonormal, .facesOfPart = 100});
  const std::vector<Vector3> points = pointsAround(open);
  EXPECT_EQ(valuesOf(trusted, points), valuesOf(ExactDistance(open, {.insideTest = InsideTest::pseudonormal}), points));
}

TEST(DistanceOnDisk, RefusesDamagedParts) {
  const support::TemporaryDirectory folder;
  const TriangleMesh mesh = shapes::mesh(kTorus);
  const fs::path parts = DistanceOnDisk(mesh, folder.path(), {.facesOfPart = 100}).folder();
  {
    std::fstream stream(parts / "part-0", std::ios::binary | std::ios::in | std::ios::out);
    stream.seekp(1000);
    stream.put('x');
  }
  const std::vector<Vector3> points = pointsAround(mesh);
  std::vector<double> out(points.size());
  const DistanceOnDisk damaged(mesh, folder.path());
  for (int i = 0; i < 2; ++i)  // A damaged part is not trusted the next time.
    EXPECT_THAT(messageOf([&] { damaged(points, out); }), HasSubstr("damaged"));
  fs::resize_file(parts / "part-0", 64);
  EXPECT_THAT(messageOf([&] { DistanceOnDisk(mesh, folder.path())(points, out); }), HasSubstr("damaged"));
  fs::resize_file(parts / "index", 64);
  EXPECT_NE(messageOf([&] { DistanceOnDisk(mesh, folder.path())(points, out); }), "");
}

TEST(DistanceOnDisk, LeavesNothingBehindWhenCancelled) {
  const support::TemporaryDirectory folder;
  const TriangleMesh mesh = shapes::mesh(kTorus);
  Progress cancelled;
  int reports = 0;
  cancelled.report = [&](std::string_view, double) { ++reports; };
  cancelled.cancelled = [&] { return reports > 4; };
  EXPECT_THROW(DistanceOnDisk(mesh, folder.path(), {.facesOfPart = 100}, cancelled), Cancelled);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

}  // namespace
}  // namespace hpsdf
