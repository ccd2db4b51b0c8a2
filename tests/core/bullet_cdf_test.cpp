// Tests that Bullet reads the files of writeCubicGrid. Built twice, because Bullet exists with float and with double
// scalars.
#include <BulletCollision/CollisionShapes/btMiniSDF.h>
#include <BulletCollision/CollisionShapes/btSdfCollisionShape.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/detail/cubic_grid.h"
#include "support/cubic_grid_file.h"
#include "support/one_leaf_field.h"

namespace hpsdf {
namespace bullet_cdf_test {

constexpr bool kDouble = sizeof(btScalar) == 8;
constexpr double kRounding = kDouble ? 1e-12 : 1e-4;  // tolerance for values and gradients of some tens
constexpr int kPoints = 5000;

bool load(btMiniSDF& sdf, const std::string& bytes) { return sdf.load(bytes.data(), static_cast<int>(bytes.size())); }

btVector3 bulletVector(const Vector3& v) { return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())}; }
Vector3 vector(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

struct Differences {
  double value = 0, gradient = 0;  ///< RMS differences
  double greatestValue = 0, greatestGradient = 0;
};

/// Returns the differences between Bullet and the field at random points that Bullet's scalar type represents exactly.
Differences differences(const btMiniSDF& sdf, const Field& field) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.001, 0.999);
  Differences found;
  for (int n = 0; n < kPoints; ++n) {
    const Vector3 at(unit(random), unit(random), unit(random));
    const btVector3 x = bulletVector(field.domain().min() + field.domain().sizes().cwiseProduct(at));
    double value = 0;
    btVector3 gradient;
    if (!sdf.interpolate(0, value, x, &gradient)) throw std::runtime_error("Bullet has no value in the domain");
    const ValueAndGradient exact = field.valueAndGradient(vector(x));
    const double byValue = std::abs(value - exact.value), byGradient = (vector(gradient) - exact.gradient).norm();
    found.value += byValue * byValue / kPoints;
    found.gradient += byGradient * byGradient / kPoints;
    found.greatestValue = std::max(found.greatestValue, byValue);
    found.greatestGradient = std::max(found.greatestGradient, byGradient);
  }
  found.value = std::sqrt(found.value);
  found.gradient = std::sqrt(found.gradient);
  return found;
}

Differences differencesOfFile(const std::string& bytes, const Field& field) {
  btMiniSDF sdf;
  if (!load(sdf, bytes)) throw std::runtime_error("Bullet does not take the file");
  return differences(sdf, field);
}

TEST(BulletCdf, cubicPolynomialsComeBackWithTheirGradients) {
  const Field field = oneLeafField(1, 3);
  const Differences found = differencesOfFile(fileOf(sampleCubicGrid(field, {2, 3, 4})), field);
  EXPECT_LT(found.greatestValue, kRounding);
  EXPECT_LT(found.greatestGradient, 10 * kRounding);
}

/// Checks that the previous test detects wrong files.
TEST(BulletCdf, wrongFilesAreSeen) {
  const Field field = oneLeafField(1, 3);
  const CubicGrid grid = sampleCubicGrid(field, {2, 3, 4});
  const std::string bytes = fileOf(grid);
  btMiniSDF sdf;
  EXPECT_FALSE(load(sdf, bytes.substr(0, bytes.size() - 1)));
  EXPECT_FALSE(load(sdf, bytes + '\0'));
  const std::size_t nodes = 108 + 8 * 4, cells = nodes + 8 * grid.nodes.size() + 8 * 2;
  const auto swapped = [&](std::size_t at, std::size_t size) {
    std::string wrong = bytes;
    std::swap_ranges(wrong.begin() + long(at), wrong.begin() + long(at + size), wrong.begin() + long(at + size));
    return wrong;
  };
  // Swaps two distances, two nodes of the first cell, the resolutions in x and y, or the cell sizes in x and y.
  for (const std::string& wrong : {swapped(nodes, 8), swapped(cells + 8 * 4, 4), swapped(48, 4), swapped(60, 8)})
    EXPECT_GT(differencesOfFile(wrong, field).greatestValue, 1e-2);
}

TEST(BulletCdf, itIsTheInterpolationThatTheCommandMeasures) {
  const Field field = oneLeafField(2, 6);
  const CubicGrid grid = sampleCubicGrid(field, {3, 2, 2});
  btMiniSDF sdf;
  ASSERT_TRUE(load(sdf, fileOf(grid)));
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0.001, 0.999);
  for (int n = 0; n < kPoints; ++n) {
    const Vector3 at(unit(random), unit(random), unit(random));
    const btVector3 x = bulletVector(field.domain().min() + field.domain().sizes().cwiseProduct(at));
    double value = 0;
    ASSERT_TRUE(sdf.interpolate(0, value, x, nullptr));
    EXPECT_NEAR(value, grid.value(vector(x)), kRounding);
  }
}

/// Doubling the cells along each axis divides the error of values by 16 and the error of gradients by 8.
TEST(BulletCdf, differencesShrinkWithTheFourthOrder) {
  const Field field = oneLeafField(3, 5);
  const auto found = [&](std::uint32_t n) {
    return differencesOfFile(fileOf(sampleCubicGrid(field, {n, n, n})), field);
  };
  std::vector<Differences> finer = {found(4), found(8)};
  if (kDouble) finer.push_back(found(16));  // in single precision rounding would dominate
  for (std::size_t n = 1; n < finer.size(); ++n) {
    EXPECT_NEAR(finer[n - 1].value / finer[n].value, 16, 2);
    EXPECT_NEAR(finer[n - 1].gradient / finer[n].gradient, 8, 1);
  }
}

TEST(BulletCdf, theDomainsBoundaryBelongsToIt) {
  const Field field = oneLeafField(4, 3);
  btMiniSDF sdf;
  ASSERT_TRUE(load(sdf, fileOf(sampleCubicGrid(field, {3, 5, 7}))));
  for (int corner = 0; corner < 8; ++corner) {
    Vector3 x;
    for (int axis = 0; axis < 3; ++axis)
      x[axis] = corner >> axis & 1 ? field.domain().max()[axis] : field.domain().min()[axis];
    double value = 0;
    ASSERT_TRUE(sdf.interpolate(0, value, bulletVector(x), nullptr));
    EXPECT_NEAR(value, field.value(x), 10 * kRounding);
  }
  double value = 0;
  EXPECT_FALSE(sdf.interpolate(0, value, bulletVector(field.domain().max() + Vector3(0.01, 0, 0)), nullptr));
}

TEST(BulletCdf, aFieldIsACollisionShape) {
  const auto distance = [](const Vector3& x) { return x.norm() - 0.7; };
  const Field field = build(distance, Box(Vector3(-1, -1, -1), Vector3(1, 1, 1)),
                            {.targetError = 1e-8, .estimator = Estimator::embedded});
  const std::string bytes = fileOf(sampleCubicGrid(field, finestCubicGrid(field.domain(), 2'000'000)));
  btSdfCollisionShape shape;
  ASSERT_TRUE(shape.initializeSDF(bytes.data(), static_cast<int>(bytes.size())));
  shape.setMargin(0);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> fromCenter(0.5, 0.9);
  for (int n = 0; n < kPoints; ++n) {
    const Vector3 direction = Vector3(normal(random), normal(random), normal(random)).normalized();
    const Vector3 x = fromCenter(random) * direction;
    btScalar found = 0;
    btVector3 gradient;
    ASSERT_TRUE(shape.queryPoint(bulletVector(x), found, gradient));
    EXPECT_NEAR(found, distance(x), 1e-4);
    EXPECT_LT((vector(gradient) - direction).norm(), 5e-3);
  }
}

}  // namespace bullet_cdf_test
}  // namespace hpsdf
