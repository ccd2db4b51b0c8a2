// Tests what a finished field is measured to be.

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <variant>

#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/exact_samples.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"
#include "hpsdf/verify.h"
#include "support/made_meshes.h"

namespace hpsdf {
namespace measure_test {

/// Returns a field of a torus with these options and its exact distance.
struct Torus {
  TriangleMesh mesh = shapes::mesh("torus,segments=48,sides=24");
  ExactDistance exact{mesh};
  Field field = build(exact, domainAround(mesh),
                      {.targetError = 1e-4, .strategy = Strategy::hp, .coefficients = CoefficientType::float32});
};

TEST(Measure, agreesWithManyMorePoints) {
  const Torus torus;
  const Measurement found = measure(torus.field, torus.exact);
  EXPECT_EQ(found.points, 20'000U);
  EXPECT_NEAR(found.nearDistance, 0.02, 1e-3);
  const SampleOptions many{.count = 400'000, .seed = 5};
  const Box& domain = torus.field.domain();
  const ErrorFigures near =
      measureError(torus.field, sampleNear(torus.exact, torus.mesh, domain, found.nearDistance, many));
  const ErrorFigures uniform = measureError(torus.field, sampleUniform(torus.exact, domain, 0, many));
  EXPECT_NEAR(found.near.rms / near.rms, 1, 0.05);
  EXPECT_NEAR(found.domain.rms / uniform.rms, 1, 0.05);
  EXPECT_LE(found.near.max, near.max * 1.05);
  EXPECT_GT(found.near.max, near.max / 2);
  const double worst = std::abs(torus.field.value(found.worst) - torus.exact(found.worst));
  EXPECT_DOUBLE_EQ(worst, std::max(found.near.max, found.domain.max));
  EXPECT_EQ(found.wrongSigns, 0U);
}

TEST(Measure, takesFewerPointsWhereWindingNumbersDecide) {
  const Torus torus;
  for (const auto& [test, points] : {std::pair(InsideTest::pseudonormal, 20'000U), {InsideTest::winding, 8'000U}}) {
    const ExactDistance distance(torus.mesh, {.insideTest = test});
    EXPECT_EQ(measure(torus.field, distance).points, points);
    EXPECT_EQ(measure(torus.field, distance, {.points = 1000}).points, 1000U);
  }
}

/// Where a field is exact in most of its domain, its error is in a few other leaves.
TEST(Measure, agreesWithManyMorePointsOfAFieldThatIsExactAlmostEverywhere) {
  const TriangleMesh mesh = shapes::mesh("gear,teeth=3");
  const ExactDistance exact(mesh);
  const Field field = build(exact, domainAround(mesh), {.tolerance = 0.002});
  const auto volume = statistics(field).degreeVolume;
  ASSERT_GT(volume.at(kExactDegree), 0.3);
  const Measurement found = measure(field, exact);
  const ErrorFigures many = measureError(field, sampleUniform(exact, field.domain(), 0, {.count = 400'000, .seed = 5}));
  ASSERT_GT(many.rms, 1e-6);
  EXPECT_NEAR(found.domain.rms / many.rms, 1, 0.05);
  EXPECT_EQ(found.signThreshold, 0.002);
  EXPECT_LT(10 * found.near.rms, 0.001);
}

TEST(Measure, doesNotDependOnThreads) {
  const Torus torus;
  const Measurement one = measure(torus.field, torus.exact, {.threads = 1}), all = measure(torus.field, torus.exact);
  EXPECT_EQ(one.near.rms, all.near.rms);
  EXPECT_EQ(one.domain.rms, all.domain.rms);
  EXPECT_EQ(one.tornShare, all.tornShare);
  EXPECT_EQ(one.worst, all.worst);
}

TEST(Measure, countsWrongSigns) {
  const Torus torus;
  FieldData data = torus.field.data();
  for (float& c : std::get<FieldArray<float>>(data.coefficients).values()) c = -c;
  const Measurement found = measure(Field(std::move(data)), torus.exact);
  EXPECT_GT(found.wrongSigns, found.points / 10);
}

/// Two halves of space, in one of which the distance to the plane z = 0 is too large by a tenth: across the face
/// between them the surface ends in a step. A surface that extends from −1 to 1 along the face has a crack of 2 · 0.1,
/// and an area of 4.
TEST(Measure, findsTheShareOfTheSurfaceThatIsTorn) {
  TriangleMesh plane;
  plane.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  plane.triangles = {{0, 1, 2}, {0, 2, 3}};
  const ExactDistance exact(plane, {.insideTest = InsideTest::winding});
  const auto fieldWithStep = [](double step) {
    FieldData data;
    data.domain = Box(Vector3::Constant(-2), Vector3::Constant(2));
    data.grid = {2, 1, 1};
    data.nodes = {node::leaf(1, 0), node::leaf(1, 4)};
    data.coefficients = std::vector<double>{0, 2, 0, 0, step, 2, 0, 0};  // 1, z, y, x
    return Field(std::move(data));
  };
  EXPECT_NEAR(measure(fieldWithStep(0.1), exact, {.points = 100'000}).tornShare, 2 * 0.1 / 4, 0.005);
  EXPECT_EQ(measure(fieldWithStep(0), exact, {.points = 100'000}).tornShare, 0);
  EXPECT_EQ(measure(blended(fieldWithStep(0.1)), exact).tornShare, 0);
}

TEST(Measure, worksWithoutTriangles) {
  const auto ball = [](const Vector3& x) { return x.norm() - 0.5; };
  const Field field = build(ball, Box(Vector3::Constant(-1), Vector3::Constant(1)), {.targetError = 1e-4});
  const Measurement found = measure(field, ball);
  EXPECT_GT(found.near.rms, 0);
  EXPECT_LT(found.near.rms, 0.05);
  EXPECT_EQ(found.tornShare, 0);
}

TEST(Measure, isForgottenWhenTheFieldChanges) {
  const Torus torus;
  const Field field = withMeasurement(torus.field, measure(torus.field, torus.exact));
  EXPECT_TRUE(field.metadata().measurement.has_value());
  EXPECT_FALSE(blended(field).metadata().measurement.has_value());
  EXPECT_FALSE(weaklyContinuous(field).field.metadata().measurement.has_value());
}

}  // namespace measure_test
}  // namespace hpsdf
