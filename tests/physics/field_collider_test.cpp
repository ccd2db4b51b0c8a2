#include "hpsdf/physics/field_collider.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/triangle_list.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"
#include "support/made_meshes.h"
#include "support/random_field.h"

namespace hpsdf::physics {
namespace field_collider_test {

Vector3 pointAround(const Box& box, std::mt19937_64& random, double beyond = 1.2) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Vector3 from(uniform(random), uniform(random), uniform(random));
  return box.center() + beyond / 2 * box.sizes().cwiseProduct(from);
}

/// Returns 10‖x‖² − 5 over [-1, 1]³: positive at the sides, negative in the middle, and much steeper than a distance.
Field steepField() {
  FieldData data;
  data.domain = Box(Vector3(-1, -1, -1), Vector3(1, 1, 1));
  data.nodes = {node::leaf(2, 0)};
  data.coefficients = std::vector<double>{5, 0, 20.0 / 3, 0, 0, 20.0 / 3, 0, 0, 0, 20.0 / 3};
  return Field(std::move(data));
}

/// Returns random fields that are no distances, and at the end two fields of a torus, one with a single base cell.
std::vector<Field> fields() {
  std::vector<Field> result = {steepField()};
  const Box flat(Vector3(-3, -1, 5), Vector3(1, 2, 5.5));
  for (unsigned seed = 0; seed < 2; ++seed) {
    result.push_back(randomField(seed, {.roughness = 1}));
    result.push_back(blended(result.back(), 0.25));
    result.push_back(
        randomField(seed, {.domain = flat, .grid = {3, 1, 1}, .radius = 0.2, .roughness = 0.5, .single = true}));
    result.push_back(randomField(seed, {.grid = {1, 1, 1}, .maxDepth = 9, .deepAt = Vector3(0.1, 0.2, 0.6)}));
    result.push_back(blended(result.back(), 0.1));
    result.push_back(randomField(seed, {.refinement = 0, .maxDegree = 30}));
  }
  const DistanceFunction torus = shapes::analytic("torus");
  result.push_back(build(torus, domainAround(torus.source().box), {.targetError = 1e-7}));
  result.push_back(build(torus, domainAround(torus.source().box),
                         {.targetError = 1e-7, .grid = {1, 1, 1}, .strategy = Strategy::hp}));
  return result;
}

/// Returns a thin wedge, at whose edge the normals of the two sides nearly oppose each other.
TriangleMesh wedge() {
  TriangleMesh mesh = support::boxOfTwo();
  for (Vector3& x : mesh.vertices) x.z() *= 0.02 * (1.1 + x.x());
  return mesh;
}

Field exactField(const TriangleMesh& mesh, const DistanceOptions& distance = {}, double within = 0.005) {
  return build(ExactDistance(mesh, distance), domainAround(mesh),
               {.targetError = 1e-5, .strategy = Strategy::hpx, .exactWithin = within});
}

/// Returns one exact leaf for a few random triangles that have nothing to do with each other, so that its sign changes
/// anywhere.
Field scatteredField(unsigned seed, ExactSign sign) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-0.8, 0.8);
  FieldData data;
  data.domain = Box(Vector3(-1, -1, -1), Vector3(1, 1, 1));
  data.nodes = {node::exactLeaf(sign, 0)};
  std::vector<Vector3> vertices(12);
  for (Vector3& x : vertices) x = Vector3(uniform(random), uniform(random), uniform(random));
  const Vector3 corner = vertices[0];
  data.exact.vertices = std::move(vertices);
  data.exact.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {7, 8, 9}, {9, 10, 11}};
  data.exact.lists = {5, 0xffffffff, 0xff, triangle_run::packed(0, 5) | triangle_run::kLast};
  if (sign == ExactSign::winding) {
    data.exact.lists[0] |= TriangleListView::kReferenceBit;
    const auto reference = PackedReference({Vector3(0.1, -0.2, 0.3), 0}, corner).words();
    data.exact.lists.insert(data.exact.lists.end(), reference.begin(), reference.end());
  }
  return Field(std::move(data));
}

/// Returns fields with exact leaves: of solids with and without sharp edges, of two boxes that overlap, of a shell, of
/// an open mesh whose sign jumps beside its hole, and of scattered triangles. All but the last are there as built and
/// with blended zones of two widths.
std::vector<Field> exactFields() {
  std::vector<Field> result;
  result.push_back(exactField(shapes::mesh("gear")));
  result.push_back(exactField(shapes::mesh("torus,segments=24,sides=12")));
  result.push_back(exactField(wedge()));
  result.push_back(
      exactField(support::joined(support::boxOfTwo(), support::moved(support::boxOfTwo(), {0.7, 0.6, 0.5}))));
  result.push_back(exactField(support::openBox(), {.insideTest = InsideTest::shell, .thickness = 0.1}));
  result.push_back(exactField(support::openBox(), {.insideTest = InsideTest::pseudonormal}, 0.2));
  for (std::size_t i = 0, count = result.size(); i < count; ++i)
    result.push_back(blended(result[i], i == 0 ? kDefaultBlend : kMaxBlend));
  for (unsigned seed = 0; seed < 2; ++seed)
    for (const ExactSign sign : {ExactSign::pseudonormal, ExactSign::winding})
      result.push_back(scatteredField(seed, sign));
  return result;
}

std::vector<Field> allFields() {
  std::vector<Field> result = fields();
  for (Field& field : exactFields()) result.push_back(std::move(field));
  return result;
}

TEST(FieldCollider, boundsTheFieldFromBelow) {
  std::mt19937_64 random(1);
  for (const Field& field : allFields()) {
    const FieldCollider collider(field);
    for (int i = 0; i < 20000; ++i) {
      const Vector3 x = pointAround(field.domain(), random);
      const double bound = collider.lowerBound(x);
      ASSERT_TRUE(bound == 0 || field.value(x) >= bound) << bound << " for " << field.value(x);
    }
  }
}

TEST(FieldCollider, boundsTheFieldInSpheres) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(0, 1);
  int wrongByItself = 0;
  for (const Field& field : allFields()) {
    const FieldCollider collider(field);
    const double size = field.domain().diagonal().norm();
    for (int i = 0; i < 20000; ++i) {
      const Vector3 center = pointAround(field.domain(), random, 1.5);
      const Vector3 other = pointAround(field.domain(), random, 1.5);
      const Vector3 x = center + std::pow(uniform(random), 3) * (other - center);
      const double radius = (x - center).norm() + 1e-14 * size;
      const double value = field.value(x);
      const double bound = collider.lowerBoundAround(center) - radius;
      ASSERT_TRUE(bound <= 0 || value >= bound) << bound << " for " << value;
      const double byItself = field.value(center) - radius;
      wrongByItself += byItself > 0 && value < byItself;
    }
  }
  EXPECT_GT(wrongByItself, 1000) << "the fields' own values would not do";
}

/// Bounds must also be close to the field: bounds that are far too low would pass the other tests.
TEST(FieldCollider, losesFewCells) {
  const DistanceFunction sphere = shapes::analytic("sphere,radius=0.7");
  const Field field = build(sphere, domainAround(sphere.source().box), {.targetError = 1e-7});
  const FieldCollider collider(field);
  const double cell = field.domain().sizes().x() / 96;
  std::mt19937_64 random(3);
  for (int i = 0; i < 20000; ++i) {
    const Vector3 x = pointAround(field.domain(), random, 1);
    const double value = field.value(x);
    ASSERT_GT(collider.lowerBound(x), value - 2 * cell);
    ASSERT_GT(collider.lowerBoundAround(x), 0.88 * value - 4 * cell);
  }
  EXPECT_LT(collider.bytes(), 4u << 20);
}

/// Bounds in exact leaves near the surface must be close to the field, too. Some two cells are lost beside edges, where
/// it takes as much to be certain of the sign. Far from the surface, the sign is often not certain at all.
TEST(FieldCollider, losesFewCellsInExactLeaves) {
  constexpr double kNear = 0.02;
  for (const char* shape : {"box", "gear"}) {
    const TriangleMesh mesh = shapes::mesh(shape);
    const Field field = exactField(mesh, {}, 0.02);
    const FieldCollider collider(field);
    const double cell = field.domain().sizes().maxCoeff() / 96;
    std::mt19937_64 random(4);
    std::size_t count = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vector3 x = pointAround(field.domain(), random, 1);
      if (field.cellAt(x).degree != kExactDegree) continue;
      const double value = field.value(x);
      if (std::abs(value) > kNear) continue;
      ASSERT_GT(collider.lowerBound(x), value - 2.5 * cell) << shape << " at " << x.transpose();
      ++count;
    }
    EXPECT_GT(count, 500U) << shape;
  }
}

TEST(FieldCollider, takesLeavesOfDegreeZero) {
  FieldData data;
  data.domain = Box(Vector3(-1, -1, -1), Vector3(1, 1, 1));
  data.nodes = {node::leaf(0, 0)};
  data.coefficients = std::vector<double>{0.01};
  const Field field(std::move(data));
  const FieldCollider collider(field);
  for (const Vector3& x : {Vector3(0, 0, 0), Vector3(0.9, -0.9, 0.9)}) {
    EXPECT_LE(collider.lowerBound(x), 0.01);
    EXPECT_GT(collider.lowerBound(x), 0.008);  // rounded down to multiples of 1/32 of a cell's edge
  }
}

TEST(FieldCollider, knowsThatFarAwayIsOutside) {
  const DistanceFunction sphere = shapes::analytic("sphere,radius=0.7");
  const Field field = build(sphere, domainAround(sphere.source().box), {.targetError = 1e-5});
  const FieldCollider collider(field);
  EXPECT_GT(collider.lowerBoundAround({10, 0, 0}), 9);
  EXPECT_GT(collider.lowerBound({10, 0, 0}), 9);
  EXPECT_GT(collider.lowerBoundAround({1e300, 0, 0}), 1e200);
  EXPECT_GT(collider.lowerBoundAround({std::numeric_limits<double>::infinity(), 0, 0}), 1e200);
}

}  // namespace field_collider_test
}  // namespace hpsdf::physics
