// Tests the choice between polynomials and exact leaves for meshes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string_view>

#include "field/build/limits.h"
#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"
#include "support/made_meshes.h"

namespace hpsdf {
namespace automatic_strategy_test {

Strategy chosenFor(const DistanceFunction& distance, const Box& domain, BuildOptions options = {}) {
  options.targetError = 1e-2;
  return build(distance, domain, options).metadata().settings.strategy;
}

Strategy chosenFor(const TriangleMesh& mesh, const DistanceOptions& distance = {}, const BuildOptions& options = {}) {
  return chosenFor(ExactDistance(mesh, distance), domainAround(mesh), options);
}

TEST(AutomaticStrategy, isHpxForSharpEdgesAndCoarseFacets) {
  EXPECT_EQ(chosenFor(shapes::mesh("gear")), Strategy::hpx);
  EXPECT_EQ(chosenFor(support::boxOfTwo()), Strategy::hpx);
  EXPECT_EQ(chosenFor(support::openBox()), Strategy::hpx);
  EXPECT_EQ(chosenFor(shapes::mesh("torus,segments=16,sides=8")), Strategy::hpx);
}

TEST(AutomaticStrategy, isHpWhereExactLeavesGainNothing) {
  EXPECT_EQ(chosenFor(shapes::mesh("torus")), Strategy::hp) << "a smooth mesh";
  EXPECT_EQ(chosenFor(shapes::analytic("box"), Box(-Vector3::Ones(), Vector3::Ones())), Strategy::hp);
  EXPECT_EQ(chosenFor(support::boxOfTwo(), {.insideTest = InsideTest::outerHull}), Strategy::hp)
      << "no sign follows from the triangles";
  const TriangleMesh gear = shapes::mesh("gear");
  EXPECT_EQ(chosenFor(support::joined(gear, support::moved(gear, {5000, 0, 0}))), Strategy::hp)
      << "all triangles of a gear lie within a half percent of the size";
}

TEST(AutomaticStrategy, leavesRoomForLimits) {
  const TriangleMesh gear = shapes::mesh("gear");
  EXPECT_EQ(chosenFor(gear, {}, {.maxSteps = 0}), Strategy::hp);
  const BuildOptions few{.targetError = 0, .maxBytes = 100'000};
  const Field field = build(ExactDistance(gear), domainAround(gear), few);
  EXPECT_EQ(field.metadata().settings.strategy, Strategy::hp);
  EXPECT_LE(field.bytes(), 100'000u);
}

TEST(AutomaticStrategy, isNotMisledByTrianglesWithoutAreaOrTurnedOver) {
  TriangleMesh sphere = shapes::mesh("sphere,subdivisions=6");
  for (std::size_t i = 0; i < sphere.triangles.size(); i += 2)
    std::swap(sphere.triangles[i][0], sphere.triangles[i][1]);
  EXPECT_EQ(chosenFor(sphere, {.insideTest = InsideTest::shell, .thickness = 0.1}), Strategy::hp);
  sphere = shapes::mesh("sphere,subdivisions=6");
  for (std::size_t i = 0, count = sphere.triangles.size(); i < count; i += 2) {
    const auto [a, b, c] = sphere.triangles[i];
    sphere.triangles.push_back({a, b, b});
  }
  EXPECT_EQ(chosenFor(sphere, {.insideTest = InsideTest::shell, .thickness = 0.1}), Strategy::hp);
}

/// A gear whose long, thin triangles meet at the bore: a ball touches the more of them, the closer it is to the bore.
TriangleMesh fineGear() { return shapes::mesh("gear,teeth=100,segments=34"); }

TEST(AutomaticStrategy, isHpWhereThinTrianglesWouldTakeTooManyExactLeaves) {
  const TriangleMesh gear = fineGear();
  const ExactDistance distance(gear);
  const Field field =
      build(distance, domainAround(gear), {.targetError = 1e-2, .memoryLimit = distance.bytes() + 100'000'000});
  EXPECT_EQ(field.metadata().settings.strategy, Strategy::hp);
  EXPECT_LT(field.data().nodes.size(), 10'000u);
}

TEST(AutomaticStrategy, isHpxForFineMeshesWhoseExactLeavesAreFew) {
  EXPECT_EQ(chosenFor(shapes::mesh("gear,segments=24")), Strategy::hpx);
}

TEST(AutomaticStrategy, refusesExactLeavesBeforeTheyFillTheMemory) {
  const TriangleMesh gear = fineGear();
  const ExactDistance distance(gear);
  int reports = 0;
  const Progress progress{.report = [&](std::string_view, double) { ++reports; },
                          .cancelled = [&] { return reports > 50; }};
  const BuildOptions exact{.strategy = Strategy::hpx, .memoryLimit = distance.bytes() + 100'000'000};
  EXPECT_THAT([&] { build(distance, domainAround(gear), exact, progress); },
              testing::ThrowsMessage<Error>(testing::AllOf(testing::HasSubstr("exact cells near the surface need more"),
                                                           testing::HasSubstr("take strategy hp"))));
  EXPECT_LE(reports, 50) << "a thousand cells a report: all would be hundreds of thousands";
}

/// Where much detail lies in a small part of the mesh, the samples suggest up to 2.6 times the nodes that there are.
TEST(AutomaticStrategy, allowsForTheErrorOfEstimatesFromSamples) {
  const BuildOptions options{.strategy = Strategy::hpx, .memoryLimit = 25'000'000};  // 100,000 nodes
  const auto require = [&](double nodes, double overestimate) {
    detail::requireMemoryForExact({.nodes = nodes, .overestimate = overestimate}, 0, options);
  };
  EXPECT_NO_THROW(require(300'000, detail::kOverestimateBySamples));
  EXPECT_THROW(require(600'000, detail::kOverestimateBySamples), Error);
  try {
    require(600'000, detail::kOverestimateBySamples);
  } catch (const MemoryLimitError& error) {
    EXPECT_EQ(error.enough(), 180'000'000u) << "a fifth more than the estimate";
  }
  EXPECT_THROW(require(110'000, 1), Error) << "counted numbers are not allowed for";
}

TEST(AutomaticStrategy, doesNotDependOnTheNumberOfThreads) {
  const TriangleMesh gear = shapes::mesh("gear,teeth=16,segments=10");
  const ExactDistance distance(gear);
  const Strategy one =
      build(distance, domainAround(gear), {.targetError = 1e-2, .threads = 1}).metadata().settings.strategy;
  EXPECT_EQ(build(distance, domainAround(gear), {.targetError = 1e-2, .threads = 4}).metadata().settings.strategy, one);
}

}  // namespace automatic_strategy_test
}  // namespace hpsdf
