// Tests exact leaves: leaves that keep the triangles nearest to their points.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "../support/made_meshes.h"
#include "../support/temporary_directory.h"
#include "../support/test_mesh.h"
#include "hpsdf/build.h"
#include "hpsdf/detail/exact_sign.h"
#include "hpsdf/detail/sign_check.h"
#include "hpsdf/detail/triangle_list.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/shapes.h"

namespace hpsdf {
namespace exact_leaf_test {

using support::placesIn;

struct Part {
  TriangleMesh mesh;
  DistanceOptions distance = {};
};

/// Two boxes, one of which reaches into the other.
TriangleMesh overlappingBoxes() {
  return support::joined(support::boxOfTwo(), support::moved(support::boxOfTwo(), {0.7, 0.6, 0.5}));
}

Part partOf(const std::string& name) {
  if (name == "shell") return {support::openBox(), {.insideTest = InsideTest::shell, .thickness = 0.1}};
  if (name == "far") return {support::moved(shapes::mesh("gear"), {300, -200, 100})};
  if (name == "overlap") return {overlappingBoxes()};
  if (name == "farOverlap") return {support::moved(overlappingBoxes(), {1e6, -3e5, 2e4})};
  if (name == "inward") return {support::reversed(overlappingBoxes())};
  if (name == "fandisk") return {loadMesh(support::testMesh("cad/fandisk.obj"))};
  return {shapes::mesh(name)};
}

BuildOptions hpx(double target = 1e-6) { return {.targetError = target, .strategy = Strategy::hpx}; }

class ExactLeaf : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "fandisk") HPSDF_SKIP_WITHOUT_MESHES();
  }
};

TEST_P(ExactLeaf, givesTheExactDistanceAndItsGradient) {
  const Part part = partOf(GetParam());
  const ExactDistance exact(part.mesh, part.distance);
  BuildOptions options = hpx();
  options.coefficients = CoefficientType::float64;
  const Field field = build(exact, domainAround(part.mesh), options);
  const double size = boundingBox(part.mesh).sizes().maxCoeff();
  int count = 0;
  for (const Vector3& x : placesIn(field.domain(), 20000)) {
    if (!field.domain().contains(x) || field.cellAt(x).degree != kExactDegree) continue;
    ++count;
    const ClosestPoint closest = exact.closestPoint(x);
    const ValueAndGradient found = field.valueAndGradient(x);
    ASSERT_NEAR(found.value, closest.signedDistance, 1e-12 * std::max(size, x.norm())) << x.transpose();
    ASSERT_EQ(found.value, field.value(x));
    ASSERT_NEAR(found.gradient.norm(), 1, 1e-9);
    // the gradient leads back to a point of the surface that is as near as the closest one
    const double unsignedDistance = found.value + part.distance.thickness / 2;
    const Vector3 foot = x - unsignedDistance * found.gradient;
    ASSERT_NEAR(std::abs(exact(foot) + part.distance.thickness / 2), 0, 1e-9 * std::max(size, x.norm()))
        << x.transpose();
  }
  EXPECT_GT(count, 50);
}

TEST_P(ExactLeaf, isExactNearTheSurface) {
  const Part part = partOf(GetParam());
  const ExactDistance exact(part.mesh, part.distance);
  const double size = boundingBox(part.mesh).sizes().maxCoeff();
  BuildOptions options = hpx();
  options.exactTolerance = GetParam() == "fandisk" ? 1e-5 : 0;
  const Field field = build(exact, domainAround(part.mesh), options);
  double greatest = 0;
  int count = 0;
  for (const Vector3& place : placesIn(field.domain(), 20000)) {
    const Vector3 x = place - 0.99 * exact(place) * (place - exact.closestPoint(place).point).normalized();
    const double distance = exact(x);
    if (!field.domain().contains(x) || std::abs(distance) > options.exactWithin * size) continue;
    ++count;
    greatest = std::max(greatest, std::abs(field.value(x) - distance));
  }
  EXPECT_GT(count, 1000);
  EXPECT_LT(greatest, (options.exactTolerance + 1e-6) * size);
}

TEST_P(ExactLeaf, isTheSameInBatches) {
  const Part part = partOf(GetParam());
  const ExactDistance exact(part.mesh, part.distance);
  BuildOptions options = hpx();
  for (const double blend : {0.0, kDefaultBlend}) {
    options.blend = blend;
    const Field field = build(exact, domainAround(part.mesh), options);
    std::vector<Vector3> points = placesIn(field.domain(), 5000);
    for (std::size_t i = 0; i < 200; ++i)  // groups of points close to the surface and to each other
      for (const Vector3& offset : placesIn(Box(-Vector3::Ones(), Vector3::Ones()), 16))
        points.push_back(part.mesh.vertices[i * 7 % part.mesh.vertices.size()] + 0.003 * offset);
    std::vector<double> values(points.size());
    std::vector<ValueAndGradient> both(points.size());
    field.values(points, values);
    field.valuesAndGradients(points, both);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ValueAndGradient single = field.valueAndGradient(points[i]);
      ASSERT_EQ(values[i], field.value(points[i]));
      ASSERT_EQ(both[i].value, single.value);
      ASSERT_EQ(both[i].gradient, single.gradient);
    }
  }
}

TEST_P(ExactLeaf, survivesAFile) {
  const Part part = partOf(GetParam());
  const support::TemporaryDirectory directory;
  for (const CoefficientType type : {CoefficientType::float32, CoefficientType::float64}) {
    BuildOptions options = hpx();
    options.coefficients = type;
    const Field field = build(ExactDistance(part.mesh, part.distance), domainAround(part.mesh), options);
    save(field, directory / "field.hpsdf");
    const Field loaded = load(directory / "field.hpsdf");
    EXPECT_EQ(loaded.bytes(), field.bytes());
    EXPECT_EQ(loaded.data().nodes, field.data().nodes);
    EXPECT_EQ(loaded.data().exact.lists, field.data().exact.lists);
    EXPECT_EQ(loaded.metadata().settings.exactTriangles, options.exactTriangles);
    for (const Vector3& x : placesIn(field.domain(), 500)) ASSERT_EQ(loaded.value(x), field.value(x));
  }
}

TEST_P(ExactLeaf, doesNotDependOnThreads) {
  const Part part = partOf(GetParam());
  const ExactDistance exact(part.mesh, part.distance);
  BuildOptions options = hpx();
  const Field field = build(exact, domainAround(part.mesh), options);
  options.threads = 1;
  const Field alone = build(exact, domainAround(part.mesh), options);
  EXPECT_EQ(alone.data().nodes, field.data().nodes);
  EXPECT_EQ(alone.data().coefficients, field.data().coefficients);
  EXPECT_EQ(alone.data().exact.lists, field.data().exact.lists);
}

INSTANTIATE_TEST_SUITE_P(Parts, ExactLeaf,
                         testing::Values("box", "gear", "shell", "far", "overlap", "farOverlap", "inward", "fandisk"),
                         [](const auto& part) { return part.param; });

TEST(ExactLeaves, ofACubeNeedFewBytes) {
  const TriangleMesh cube = support::boxOfTwo();
  const Field field = build(ExactDistance(cube), domainAround(cube), hpx());
  EXPECT_LT(field.data().exact.lists.size(), 1000U);
  EXPECT_EQ(field.data().exact.triangles.size(), cube.triangles.size());
}

TEST(ExactLeaves, listEveryTriangleForSomeOctantAndFewForEach) {
  const TriangleMesh gear = shapes::mesh("gear");
  const Field field = build(ExactDistance(gear), domainAround(gear), hpx());
  std::size_t listed = 0, ofOctants = 0;
  for (const std::uint64_t leaf : field.data().nodes) {
    if (!node::isExact(leaf)) continue;
    const TriangleListView list(field.data().exact, leaf);
    for (std::uint32_t i = 0; i < list.count(); ++i) {
      ASSERT_NE(list.octants(i), 0);
      ofOctants += std::popcount(list.octants(i));
    }
    listed += list.count();
  }
  EXPECT_LT(double(ofOctants) / 8, 0.75 * double(listed));
}

TEST(ExactLeaves, areExactAtEverySize) {
  for (const double size : {1e-12, 1e-7, 3e7, 1e16}) {
    SCOPED_TRACE(size);
    TriangleMesh gear = shapes::mesh("gear");
    for (Vector3& x : gear.vertices) x *= size;
    const ExactDistance exact(gear);
    const Field field = build(exact, domainAround(gear), hpx(1e-4));
    std::vector<Vector3> points = placesIn(field.domain(), 5000);
    std::erase_if(points, [&](const Vector3& x) {
      return !field.domain().contains(x) || field.cellAt(x).degree != kExactDegree;
    });
    ASSERT_GT(points.size(), 500U);
    std::vector<double> values(points.size());
    field.values(points, values);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_NEAR(values[i], exact(points[i]), 1e-6 * size);
      ASSERT_EQ(values[i], field.value(points[i]));
    }
  }
}

TEST(ExactLeaves, withDamagedListsAreRefused) {
  const auto fieldOf = [](std::vector<std::uint32_t> lists, std::uint32_t offset) {
    FieldData data;
    data.domain = Box(Vector3(-1, -1, -1), Vector3(1, 1, 1));
    data.nodes = {node::exactLeaf(ExactSign::positive, offset)};
    data.exact.vertices = std::vector<Vector3>{{0, 0, 0}, {0.5, 0, 0}, {0, 0.5, 0}, {0.5, 0.5, 0}};
    data.exact.triangles = {{0, 1, 2}, {1, 3, 2}};
    data.exact.lists = std::move(lists);
    return Field(std::move(data));
  };
  const std::uint32_t both = triangle_run::packed(0, 2) | triangle_run::kLast;
  EXPECT_NEAR(fieldOf({2, 0xffff, both}, 0).value({0.1, 0.1, 0.25}), 0.25, 1e-12);
  EXPECT_NEAR(fieldOf({2, 0x0ff0, both}, 0).value({0.1, 0.1, 0.25}), 0.25, 1e-12);
  EXPECT_NEAR(fieldOf({2, 0xf00f, both}, 0).value({0.1, 0.1, 0.25}), std::hypot(0.25, 0.3 / std::sqrt(2)), 1e-12)
      << "the distance to the triangle of the other octants";
  EXPECT_THROW(fieldOf({2, 0xff0f, both}, 1), Error) << "no list begins there";
  EXPECT_THROW(fieldOf({2, 0x7f7f, both}, 0), Error) << "an octant without triangles";
  EXPECT_THROW(fieldOf({1, 0xff, both}, 0), Error) << "a number that differs from that of the runs";
  EXPECT_THROW(fieldOf({2, 0xffff, triangle_run::packed(0, 2)}, 0), Error) << "no end";
  EXPECT_THROW(fieldOf({2, 0xffff, triangle_run::packed(1, 2) | triangle_run::kLast}, 0), Error) << "no such triangle";
  EXPECT_THROW(fieldOf({0xffffffff, 0xffff, both}, 0), Error) << "longer than all lists";
  EXPECT_THROW(fieldOf({0}, 0), Error) << "an empty list";
}

TEST(ExactLeaves, followTheWindingNumberWhereTrianglesIntersect) {
  const TriangleMesh boxes = overlappingBoxes();
  const ExactDistance exact(boxes);
  const Field field = build(exact, domainAround(boxes), hpx());
  int count = 0, inBoth = 0;
  for (const Vector3& x : placesIn(field.domain(), 50000)) {
    const FieldData& data = field.data();
    const std::uint64_t leaf = data.nodes[field.cellAt(x).id];
    if (!node::isExact(leaf) || node::exactSign(leaf) != ExactSign::winding) continue;
    ++count;
    ASSERT_EQ(windingAt(data.exact, leaf, x), std::lround(windingNumber(boxes, x))) << x.transpose();
    inBoth += static_cast<int>(windingAt(data.exact, leaf, x) == 2);
  }
  EXPECT_GT(count, 500);
  EXPECT_GT(inBoth, 20);
}

/// Returns the mesh without some of its faces.
TriangleMesh without(TriangleMesh mesh, const std::vector<std::size_t>& faces) {
  for (const std::size_t face : faces) mesh.triangles[face] = {0, 0, 0};
  std::erase_if(mesh.triangles, [](const auto& triangle) { return triangle[0] == triangle[1]; });
  return mesh;
}

/// Beside a hole the distance is not that to triangles, and a leaf must not be exact.
TEST(ExactLeaves, ofOpenMeshesHaveTheExactDistance) {
  std::array<int, 4> bySign{};
  int besideHoles = 0;
  for (const TriangleMesh& mesh : {support::openBox(), without(overlappingBoxes(), {0, 15}),
                                   without(shapes::mesh("builtin:sphere,subdivisions=3"), {3, 100, 101, 102, 250})}) {
    const ExactDistance exact(mesh);
    ASSERT_EQ(exact.insideTestChoice().insideTest, InsideTest::winding);
    BuildOptions options = hpx();
    options.coefficients = CoefficientType::float64;
    const Field field = build(exact, domainAround(mesh), options);
    const double size = boundingBox(mesh).sizes().maxCoeff();
    for (const Vector3& x : placesIn(field.domain(), 20000)) {
      if (!field.domain().contains(x)) continue;
      const ClosestPoint closest = exact.closestPoint(x);
      const bool isBesideHole = std::abs(closest.signedDistance) < 0.999 * (closest.point - x).norm();
      besideHoles += static_cast<int>(isBesideHole);
      const Cell cell = field.cellAt(x);
      if (cell.degree != kExactDegree) continue;
      ASSERT_FALSE(isBesideHole) << x.transpose();
      ASSERT_NEAR(field.value(x), closest.signedDistance, 1e-12 * size) << x.transpose();
      ++bySign[static_cast<std::size_t>(node::exactSign(field.data().nodes[cell.id]))];
    }
  }
  EXPECT_GT(besideHoles, 50);
  for (const ExactSign sign : {ExactSign::pseudonormal, ExactSign::positive, ExactSign::negative, ExactSign::winding})
    EXPECT_GT(bySign[static_cast<std::size_t>(sign)], 50) << static_cast<int>(sign);
}

/// On an edge the winding number depends on rounding, and does not tell how far the hole is.
TEST(ExactLeaves, ofOpenMeshesHaveTheExactDistanceWhereTheCentreLiesOnAnEdge) {
  for (const double bend : {0.05, 0.2}) {
    const TriangleMesh sheet{{{-1, -1, bend}, {1, -1, 0}, {1, 1, bend}, {-1, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, "sheet"};
    const ExactDistance exact(sheet, {.insideTest = InsideTest::winding});
    for (const double halfWidth : {0.1, 0.3, 0.6}) {
      BuildOptions options = hpx();
      options.grid = {5, 5, 5};
      options.exactWithin = 0.1;
      options.coefficients = CoefficientType::float64;
      const Vector3 middle(0, 0, bend);
      const Box domain(middle - Vector3::Constant(halfWidth), middle + Vector3::Constant(halfWidth));
      const Field field = build(exact, domain, options);
      for (const Vector3& x : placesIn(domain, 2000)) {
        if (!domain.contains(x) || field.cellAt(x).degree != kExactDegree) continue;
        ASSERT_NEAR(field.value(x), exact(x), 1e-12) << x.transpose();
      }
    }
  }
}

TEST(ExactLeaves, haveTheNormalAsGradientOnTheSurfaceWhereTrianglesIntersect) {
  const TriangleMesh boxes = overlappingBoxes();
  const Field field = build(ExactDistance(boxes), domainAround(boxes), hpx());
  int count = 0;
  for (Vector3 x : placesIn(Box(Vector3::Constant(-1), Vector3::Constant(1)), 3000)) {
    if (std::max(std::abs(x.y()), std::abs(x.z())) > 0.99) continue;
    x.x() = 1;  // on the first box, whose corner (1, 1, 1) lies in the second one
    const Cell cell = field.cellAt(x);
    if (cell.degree != kExactDegree || node::exactSign(field.data().nodes[cell.id]) != ExactSign::winding) continue;
    if (x.y() > -0.41 && x.z() > -0.51) continue;  // in the second box
    ++count;
    const ValueAndGradient found = field.valueAndGradient(x);
    ASSERT_NEAR((found.gradient - Vector3::UnitX()).norm(), 0, 1e-6) << x.transpose();
  }
  EXPECT_GT(count, 100);
}

/// The segments from the reference point to the vertices of a grid run through edges and vertices of the triangles, if
/// the reference point lies on the grid too.
TEST(ExactLeaves, countASegmentThroughAnEdgeOrAVertexOnce) {
  FieldData data;
  data.domain = Box(Vector3::Constant(-2), Vector3::Constant(2));
  data.nodes = {node::exactLeaf(ExactSign::winding, 0)};
  const TriangleMesh box = support::boxOfTwo();
  data.exact.vertices = box.vertices;
  for (const Triangle& triangle : box.triangles) data.exact.triangles.push_back(triangle);
  data.exact.lists = {12 | TriangleListView::kReferenceBit, 0xffffffff, 0xffffffff, 0xffffffff,
                      triangle_run::packed(0, 12) | triangle_run::kLast};
  const auto reference = PackedReference({Vector3::Zero(), 1}, box.vertices[box.triangles[0][0]]).words();
  data.exact.lists.insert(data.exact.lists.end(), reference.begin(), reference.end());
  const Field field(std::move(data));
  for (const double x : {-1.5, -0.5, 0.0, 0.5, 1.5})
    for (const double y : {-1.5, -0.5, 0.0, 0.5, 1.5})
      for (const double z : {-1.5, -0.5, 0.25, 0.5, 1.5}) {
        const Vector3 point(x, y, z);
        EXPECT_EQ(field.value(point) < 0, point.cwiseAbs().maxCoeff() < 1) << point.transpose();
      }
}

/// Segments that are aimed at a vertex miss it by rounding errors, which must not open a gap between the triangles
/// there.
TEST(ExactLeaves, countASegmentThroughAVertexOnceDespiteRounding) {
  const TriangleMesh torus = shapes::mesh("torus,segments=24,sides=12");
  const TriangleMesh both = support::joined(torus, support::moved(torus, {0.2, 0.1, 0.05}));
  const ExactDistance exact(both);
  BuildOptions options = hpx(1e-5);
  options.coefficients = CoefficientType::float64;  // keeps the vertices as they are
  const Field field = build(exact, domainAround(both), options);
  const FieldData& data = field.data();
  int count = 0;
  field.forEachCell([&](const Cell& cell) {
    const std::uint64_t leaf = data.nodes[cell.id];
    if (!node::isExact(leaf) || node::exactSign(leaf) != ExactSign::winding) return;
    const Vector3 reference = referenceOf(data.exact, leaf).point;
    for (const Vector3& vertex : both.vertices)
      for (const double beyond : {1.01, 1.1, 1.3, 2.0, 3.0}) {
        const Vector3 x = reference + beyond * (vertex - reference);
        if (!cell.box.contains(x) || std::abs(exact(x)) < 1e-6) continue;
        ++count;
        ASSERT_EQ(windingAt(data.exact, leaf, x) > 0, exact(x) < 0) << x.transpose();
      }
  });
  EXPECT_GT(count, 1000);
}

TEST(ExactLeaves, withDamagedReferencesAreRefused) {
  const auto fieldOf = [](std::uint32_t count, ExactSign sign, std::vector<std::uint32_t> reference) {
    FieldData data;
    data.domain = Box(Vector3(-1, -1, -1), Vector3(1, 1, 1));
    data.nodes = {node::exactLeaf(sign, 0)};
    data.exact.vertices = std::vector<Vector3>{{0, 0, 0}, {0.5, 0, 0}, {0, 0.5, 0}};
    data.exact.triangles = {{0, 1, 2}};
    data.exact.lists = {count, 0xff, triangle_run::packed(0, 1) | triangle_run::kLast};
    data.exact.lists.insert(data.exact.lists.end(), reference.begin(), reference.end());
    return Field(std::move(data));
  };
  constexpr std::uint32_t kOne = 1 | TriangleListView::kReferenceBit, kNan = 0x7fc00000;
  const std::vector<std::uint32_t> above = {0, 0, 0x3f000000, 0};  // z = 0.5
  EXPECT_NEAR(fieldOf(kOne, ExactSign::winding, above).value({0.1, 0.1, -0.25}), -0.25, 1e-12);
  EXPECT_NEAR(fieldOf(kOne, ExactSign::winding, above).value({0.9, 0, -0.25}), std::hypot(0.4, 0.25), 1e-12);
  const std::vector<std::uint32_t> greatest = {0, 0, 0x3f000000, 0x7fffffff};
  EXPECT_NEAR(fieldOf(kOne, ExactSign::winding, greatest).value({0.1, 0.1, -0.25}), -0.25, 1e-12) << "no overflow";
  EXPECT_THROW(fieldOf(kOne, ExactSign::winding, {0, 0, 0x3f000000}), Error) << "too few words";
  EXPECT_THROW(fieldOf(kOne, ExactSign::winding, {0, 0, kNan, 1}), Error) << "not a point";
  EXPECT_THROW(fieldOf(1, ExactSign::winding, {}), Error) << "no reference";
  EXPECT_THROW(fieldOf(kOne, ExactSign::pseudonormal, {0, 0, 0x3f000000, 1}), Error) << "no reference is expected";
}

TEST(ExactLeaves, needADistanceToTriangles) {
  const auto ball = [](const Vector3& x) { return x.norm() - 0.5; };
  const Box domain(Vector3::Constant(-1), Vector3::Constant(1));
  const Field plain = build(ball, domain), asked = build(ball, domain, hpx());
  EXPECT_EQ(asked.data().nodes, plain.data().nodes);
  EXPECT_TRUE(asked.data().exact.empty());
}

}  // namespace exact_leaf_test
}  // namespace hpsdf
