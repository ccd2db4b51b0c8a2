// Tests that queries allocate no memory, by replacing the global operator new of this program.

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/range.h"
#include "hpsdf/shapes.h"
#include "support/count_allocations.h"

namespace hpsdf {
namespace allocations_test {

using support::allocationsOf;

TEST(Allocations, areCounted) {
  EXPECT_GT(allocationsOf([] { std::vector<int>(100).at(3) = 1; }), 0u);
}

TEST(Allocations, queriesMakeNone) {
  const TriangleMesh mesh = shapes::mesh("builtin:torus,segments=32,sides=16");
  const ExactDistance distance(mesh);
  const Field field = build(distance, domainAround(mesh), {.targetError = 1e-5}), smooth = blended(field, 0.2);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> coordinate(-1.5, 1.5);  // some points lie outside the domain
  std::vector<Vector3> points(1000);
  for (Vector3& x : points) x = {coordinate(random), coordinate(random), coordinate(random)};
  std::vector<double> values(points.size());
  std::vector<ValueAndGradient> both(points.size());
  std::vector<ValueGradientHessian> all(points.size());
  const RangeIndex ranges(smooth);
  double sum = 0;
  EXPECT_EQ(allocationsOf([&] {
              for (const Vector3& x : points) sum += ranges.range(Box(x, x + Vector3::Constant(0.2))).value.min;
              for (const Vector3& x : points) {
                sum += field.value(x) + field.valueAndGradient(x).gradient.x() + field.cellAt(x).error + distance(x);
              }
              for (const Vector3& x : points) sum += smooth.value(x) + smooth.valueAndGradient(x).gradient.x();
              for (const Field* f : {&field, &smooth}) {
                f->values(points, values);
                f->valuesAndGradients(points, both);
                f->valuesGradientsHessians(points, all);
              }
              distance(points, values);
            }),
            0u);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace allocations_test
}  // namespace hpsdf
