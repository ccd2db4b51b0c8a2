#include "hpsdf/cell_history.h"

#include <gtest/gtest.h>

#include <array>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/random_points.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_file.h"

namespace hpsdf {
namespace cell_history_test {

const std::vector<Vector3> kPlaces = {{0.1, 0.2, 0.3}, {0.6, 0.01, 0.02}, {-0.7, 0.3, 0.1},  {0.4, -0.4, 0.2},
                                      {0, 0, 0},       {0.9, 0.9, 0.9},   {-0.5, -0.5, 0.0}, {0.52, 0.52, -0.1},
                                      {0.2, 0.7, 0.1}, {-0.9, 0.1, -0.2}};

using Levels = std::vector<std::pair<int, int>>;  // depths and degrees

/// Returns the levels that the leaf at a point has after each step of the construction itself.
std::vector<Levels> levelsOfSteps(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                                  std::uint64_t count) {
  std::vector<std::uint64_t> steps(count + 1);
  std::iota(steps.begin(), steps.end(), 0);
  std::vector<Levels> levels(kPlaces.size());
  buildStages(distance, domain, options, steps, [&](const Field& field) {
    for (std::size_t i = 0; i < kPlaces.size(); ++i) {
      const Cell cell = field.cellAt(kPlaces[i]);
      if (levels[i].empty() || levels[i].back() != std::pair(cell.depth, cell.degree))
        levels[i].emplace_back(cell.depth, cell.degree);
    }
  });
  return levels;
}

Levels levelsOf(const CellHistory& history) {
  Levels levels;
  for (const CellStep& step : history.steps)
    if (step.degree) levels.emplace_back(step.depth, *step.degree);
  return levels;
}

struct Case {
  std::string name;
  std::string shape;
  BuildOptions options;
  DistanceOptions distance = {};
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class DecisionsTest : public testing::TestWithParam<Case> {};

TEST_P(DecisionsTest, areThoseOfTheConstruction) {
  const TriangleMesh mesh = loadMesh(GetParam().shape);
  const ExactDistance distance(mesh);
  const Box domain = domainAround(mesh);
  const Field field = build(distance, domain, GetParam().options);
  const std::uint64_t count = *field.metadata().steps;
  const std::vector<Levels> expected = levelsOfSteps(distance, domain, GetParam().options, count);
  std::size_t decisions = 0;
  for (std::size_t i = 0; i < kPlaces.size(); ++i) {
    const CellHistory history = cellHistory(field, distance, kPlaces[i]);
    EXPECT_TRUE(history.agrees) << kPlaces[i].transpose();
    EXPECT_EQ(levelsOf(history), expected[i]) << kPlaces[i].transpose();
    EXPECT_EQ(history.cell.id, field.cellAt(kPlaces[i]).id);
    EXPECT_EQ(history.steps.back().choice, CellChoice::keep);
    decisions += expected[i].size();
  }
  EXPECT_GT(decisions, kPlaces.size());
}

INSTANTIATE_TEST_SUITE_P(
    Refinements, DecisionsTest,
    testing::Values(
        Case{"default",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.targetError = 1e-7, .grid = {3, 3, 3}}},
        Case{"paper", "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             [] {
               BuildOptions options = paperOptions();
               options.targetError = 1e-5;
               options.grid = {2, 2, 2};
               return options;
             }()},
        Case{"exact",
             "builtin:gear,teeth=5,segments=2",
             {.targetError = 1e-9, .grid = {2, 2, 2}, .strategy = Strategy::hpx}},
        Case{"depthLimit",
             "builtin:box",
             {.targetError = 1e-9, .grid = {2, 2, 2}, .maxDegree = 4, .maxDepth = 2, .strategy = Strategy::hp}},
        Case{"h2", "builtin:box", {.targetError = 1e-4, .grid = {2, 2, 2}, .strategy = Strategy::h2}}),
    [](const auto& test) { return test.param.name; });

class ReplayTest : public testing::TestWithParam<Case> {};

TEST_P(ReplayTest, arrivesAtTheLeavesOfTheField) {
  const TriangleMesh mesh = loadMesh(GetParam().shape);
  const ExactDistance distance(mesh, GetParam().distance);
  const Field field = build(distance, domainAround(mesh), GetParam().options);
  std::vector<Vector3> places = kPlaces;
  for (std::uint64_t i = 0; i < 25; ++i) places.push_back(detail::Random(5, i).inBox(field.domain()));
  for (const Vector3& x : places) {
    const CellHistory history = cellHistory(field, distance, x);
    EXPECT_TRUE(history.agrees) << x.transpose();
    EXPECT_EQ(history.steps.back().degree, history.cell.degree) << x.transpose();
    EXPECT_EQ(history.steps.back().depth, history.cell.depth) << x.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(
    Fields, ReplayTest,
    testing::Values(
        Case{"optimal",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.targetError = 1e-7, .grid = {3, 3, 3}, .criterion = Criterion::optimal}},
        Case{"quantized",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.targetError = 1e-7, .grid = {3, 3, 3}, .coefficients = CoefficientType::quantized}},
        Case{"quantizedTolerance",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.grid = {3, 3, 3}, .tolerance = 2e-2, .coefficients = CoefficientType::quantized}},
        Case{"quantizedOptimal",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.targetError = 1e-7,
              .grid = {3, 3, 3},
              .criterion = Criterion::optimal,
              .coefficients = CoefficientType::quantized}},
        Case{"optimalWithExactLeaves",
             "builtin:gear,teeth=5,segments=2",
             {.targetError = 1e-6, .grid = {3, 3, 3}, .criterion = Criterion::optimal, .strategy = Strategy::hpx}},
        Case{"optimalWithinBytes",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.targetError = 0, .grid = {3, 3, 3}, .maxBytes = 30'000, .criterion = Criterion::optimal}},
        Case{"optimalEnriched",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.targetError = 1e-6, .grid = {3, 3, 3}, .criterion = Criterion::optimal, .enrich = true}},
        Case{"enrichedWithExactLeaves",
             "builtin:gear,teeth=5,segments=2",
             {.targetError = 1e-6, .grid = {3, 3, 3}, .strategy = Strategy::hpx, .enrich = true}},
        Case{"maxErrorCutOffBySteps",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.targetError = 1e-4, .grid = {2, 2, 2}, .maxError = 2e-3, .maxDepth = 4, .maxSteps = 60}},
        Case{"maxErrorCutOffByBytes",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.targetError = 1e-4, .grid = {2, 2, 2}, .maxError = 2e-3, .maxBytes = 60'000, .maxDepth = 4}},
        Case{"maxError",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.targetError = 1e-4, .grid = {2, 2, 2}, .maxError = 5e-3, .maxDepth = 4}},
        Case{"maxErrorAlone",
             "builtin:box",
             {.targetError = 0, .grid = {2, 2, 2}, .maxError = 1e-2, .maxDepth = 4, .strategy = Strategy::hp}},
        Case{"enriched",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.targetError = 1e-6, .grid = {3, 3, 3}, .enrich = true}},
        Case{"limitOfBytes",
             "builtin:box",
             {.targetError = 0, .grid = {2, 2, 2}, .maxBytes = 40'000, .strategy = Strategy::hpx}},
        Case{"nearAndFar",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.targetError = NearFarError{.near = 1e-3, .far = 1e-2}, .grid = {3, 3, 3}}},
        Case{"band",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.targetError = 1e-7, .grid = {3, 3, 3}, .band = 0.1}},
        Case{"blended",
             "builtin:box",
             {.targetError = 1e-8, .grid = {3, 3, 3}, .strategy = Strategy::hpx, .blend = 0.04}},
        Case{"tolerance",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.grid = {3, 3, 3}, .tolerance = 5e-3}},
        Case{"certified",
             "builtin:torus,major=0.7,minor=0.25,segments=24,sides=12",
             {.grid = {3, 3, 3}, .tolerance = 2e-2, .certified = true}},
        Case{"shell",
             "builtin:box",
             {.targetError = 1e-6, .grid = {3, 3, 3}},
             {.insideTest = InsideTest::shell, .thickness = 0.1}},
        Case{"shellWithinTolerance",
             "builtin:box",
             {.grid = {3, 3, 3}, .tolerance = 1e-2},
             {.insideTest = InsideTest::shell, .thickness = 0.1}},
        Case{"hull",
             "builtin:gear,teeth=5,segments=2",
             {.targetError = 1e-6, .grid = {3, 3, 3}},
             {.insideTest = InsideTest::outerHull}},
        Case{"toleranceOfBox", "builtin:box", {.grid = {3, 3, 3}, .tolerance = 1e-3}}),
    [](const auto& test) { return test.param.name; });

TEST(CellHistory, tellsThatTheDistanceIsAnother) {
  const TriangleMesh mesh = loadMesh("builtin:box"), other = loadMesh("builtin:sphere");
  const Field field = build(ExactDistance(mesh), domainAround(mesh), {.targetError = 1e-7, .grid = {3, 3, 3}});
  bool agrees = true;
  for (const Vector3& x : kPlaces) agrees = agrees && cellHistory(field, ExactDistance(other), x).agrees;
  EXPECT_FALSE(agrees);
}

TEST(CellHistory, comparesWhatTheConstructionCompared) {
  const TriangleMesh mesh = loadMesh("builtin:torus,major=0.7,minor=0.25,segments=24,sides=12");
  const ExactDistance distance(mesh);
  const BuildOptions options{.targetError = 1e-7, .grid = {3, 3, 3}, .cubature = CubatureKind::compact};
  const Field field = build(distance, domainAround(mesh), options);
  std::size_t raised = 0, divided = 0;
  for (const Vector3& x : kPlaces)
    for (const CellStep& step : cellHistory(field, distance, x).steps) {
      if (step.choice == CellChoice::keep || !step.degreeTrial || !step.octreeTrial) continue;
      EXPECT_EQ(*step.degreeTrial->gain > *step.octreeTrial->gain, step.choice == CellChoice::raise);
      EXPECT_GT(step.octreeTrial->bytes, step.degreeTrial->bytes);
      (step.choice == CellChoice::raise ? raised : divided)++;
    }
  EXPECT_GT(raised, 0U);
  EXPECT_GT(divided, 0U);
}

/// A cell that is raised because of its own samples has no trial of its children to be compared with.
TEST(CellHistory, tellsOfCellsThatAreRaisedAtOnce) {
  const TriangleMesh mesh = loadMesh("builtin:torus,major=0.7,minor=0.25,segments=24,sides=12");
  const ExactDistance distance(mesh);
  const Field field = build(distance, domainAround(mesh), {.targetError = 1e-7, .grid = {3, 3, 3}});
  std::size_t raised = 0;
  for (const Vector3& x : kPlaces) {
    const CellHistory history = cellHistory(field, distance, x);
    EXPECT_TRUE(history.agrees);
    for (const CellStep& step : history.steps)
      if (step.choice == CellChoice::raise && step.degreeTrial && !step.octreeTrial) {
        EXPECT_EQ(step.degree, 2);
        ++raised;
      }
  }
  EXPECT_GT(raised, 0U);
}

TEST(CellHistory, refusesFieldsThatWereChanged) {
  const TriangleMesh mesh = loadMesh("builtin:box");
  const ExactDistance distance(mesh);
  const Field field = build(distance, domainAround(mesh), {.grid = {3, 3, 3}, .tolerance = 0.05});
  EXPECT_TRUE(cellHistory(field, distance, Vector3::Zero()).agrees);
  EXPECT_THROW(cellHistory(blended(field), distance, Vector3::Zero()), Error);
}

TEST(CellHistory, refusesSettingsOutOfRange) {
  const TriangleMesh mesh = loadMesh("builtin:box");
  const ExactDistance distance(mesh);
  FieldData forged = build(distance, domainAround(mesh), {.targetError = 1e-3, .grid = {2, 2, 2}}).data();
  forged.metadata.settings.maxDegree = 200;
  EXPECT_THROW(cellHistory(Field(forged), distance, Vector3::Zero()), Error);
}

TEST(CellHistory, rejectsWhatIsNotWithinTheTolerance) {
  const TriangleMesh mesh = loadMesh("builtin:torus,major=0.7,minor=0.25,segments=24,sides=12");
  const ExactDistance distance(mesh);
  const auto counts = [&](bool certified) {
    const BuildOptions options{.grid = {2, 2, 2}, .tolerance = 0.02, .certified = certified};
    const Field field = build(distance, domainAround(mesh), options);
    std::size_t rejected = 0, unproven = 0, taken = 0;
    for (const Vector3& x : kPlaces)
      for (const CellStep& step : cellHistory(field, distance, x).steps) {
        EXPECT_TRUE(!step.exactTrial || step.triangles > 0);
        if (!step.degreeTrial) continue;
        const bool isTooGreat = step.degreeTrial->error > 0.93;
        EXPECT_EQ(step.degreeTrial->isUnproven, step.degreeTrial->isRejected && !isTooGreat);
        if (isTooGreat || !certified) {
          EXPECT_EQ(step.degreeTrial->isRejected, isTooGreat) << step.degreeTrial->error;
        }
        ++(step.degreeTrial->isUnproven ? unproven : step.degreeTrial->isRejected ? rejected : taken);
      }
    return std::array{rejected, unproven, taken};
  };
  const auto checked = counts(false), certified = counts(true);
  EXPECT_GT(checked[0], 0U);
  EXPECT_EQ(checked[1], 0U);
  EXPECT_GT(checked[2], 0U);
  EXPECT_GT(certified[1], 0U);
  EXPECT_GT(certified[2], 0U);
}

TEST(CellHistory, refusesPlacesOutside) {
  const TriangleMesh mesh = loadMesh("builtin:box");
  const ExactDistance distance(mesh);
  const Field field = build(distance, domainAround(mesh), {.targetError = 1e-3, .grid = {2, 2, 2}});
  EXPECT_THROW(cellHistory(field, distance, Vector3(9, 0, 0)), Error);
  EXPECT_THROW(cellHistory(field, distance, Vector3(0, 0, std::nan(""))), Error);
}

}  // namespace cell_history_test
}  // namespace hpsdf
