// Tests the options that say how accurate a field must be and which cells are refined.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "field/nearness.h"
#include "hpsdf/build.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace steering_test {

/// Signed distance to two spheres; it has a kink halfway between them.
double spheres(const Vector3& x) {
  return std::min((x - Vector3(0.5, 0.1, 0)).norm() - 0.4, (x + Vector3(0.5, 0, 0.2)).norm() - 0.35);
}
Box cube() { return Box(Vector3::Constant(-1.1), Vector3::Constant(1.1)); }

struct Measured {
  double rms = 0, near = 0, far = 0;  ///< near: within kNear of the surface; far: beyond 2 kNear
  double largest = 0, largestInBand = 0;
};

constexpr double kNear = 0.02, kBand = 0.1;

Measured measure(const Field& field, int count = 200000) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> coordinate(-1.1, 1.1);
  Measured m;
  int nearOnes = 0;
  for (int n = 0; n < count; ++n) {
    Vector3 x(coordinate(random), coordinate(random), coordinate(random));
    if (n % 2 == 1) x *= 0.4 / x.norm(), x += x.x() > 0 ? Vector3(0.5, 0.1, 0) : Vector3(-0.5, 0, -0.2);  // at surfaces
    const double exact = spheres(x), error = std::abs(field.value(x) - exact);
    m.largest = std::max(m.largest, error);
    if (std::abs(exact) <= kBand) m.largestInBand = std::max(m.largestInBand, error);
    if (std::abs(exact) <= kNear) m.near += error * error, ++nearOnes;
    if (n % 2 == 0) m.rms += error * error, m.far += std::abs(exact) > 2 * kNear ? error * error : 0;
  }
  m.near = std::sqrt(m.near / nearOnes);
  m.rms = std::sqrt(m.rms / (count / 2));
  m.far = std::sqrt(m.far / (count / 2));
  return m;
}

std::string refusal(const BuildOptions& options) {
  try {
    build(spheres, cube(), options);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Steering, optimalNeedsFewerCoefficientsForTheSameError) {
  const BuildOptions paper{.targetError = 1e-7, .grid = {3, 3, 3}};
  BuildOptions optimal = paper;
  optimal.criterion = Criterion::optimal;
  const Field before = build(spheres, cube(), paper), after = build(spheres, cube(), optimal);
  EXPECT_LT(double(statistics(after).coefficients), 0.75 * double(statistics(before).coefficients));
  EXPECT_LT(measure(after).rms, 1.05 * measure(before).rms);
  EXPECT_LE(after.metadata().totalError, 1e-7);
  EXPECT_GT(after.metadata().totalError, 0.9e-7) << "no more than needed is left";
  EXPECT_EQ(after.metadata().settings.criterion, Criterion::optimal);
  EXPECT_EQ(before.metadata().settings.criterion, Criterion::paper);
}

TEST(Steering, optimalKeepsToItsStrategyAndLimits) {
  for (const Strategy strategy : {Strategy::h1, Strategy::h2}) {
    const double target = strategy == Strategy::h1 ? 0.1 : 1e-5;  // for degree 1 the estimate is the slope
    const Field field =
        build(spheres, cube(),
              {.targetError = target, .grid = {3, 3, 3}, .criterion = Criterion::optimal, .strategy = strategy});
    const auto leaves = statistics(field).degreeLeaves;
    ASSERT_EQ(leaves.size(), 1u);
    EXPECT_EQ(leaves.begin()->first, strategy == Strategy::h1 ? 1 : 2);
    EXPECT_LE(field.metadata().totalError, target);
  }
  const Field field =
      build(spheres, cube(), {.targetError = 1e-7, .grid = {3, 3, 3}, .criterion = Criterion::optimal, .maxDegree = 3});
  EXPECT_EQ(statistics(field).degreeLeaves.rbegin()->first, 3);
}

/// Pruning also follows constructions that end at limits of steps, degree or depth instead of at the target error.
TEST(Steering, optimalTakesBackWhateverEndedTheConstruction) {
  const BuildOptions options{.targetError = 1e-9, .grid = {3, 3, 3}, .criterion = Criterion::optimal, .maxSteps = 100};
  BuildOptions paper = options;
  paper.criterion = Criterion::paper;
  const Field steps = build(spheres, cube(), options);
  EXPECT_EQ(steps.metadata().steps, 100u);
  EXPECT_LT(statistics(steps).coefficients, statistics(build(spheres, cube(), paper)).coefficients);
  BuildOptions limited = options;
  limited.maxSteps.reset();
  limited.maxDegree = 2;
  limited.maxDepth = 2;
  EXPECT_LT(statistics(build(spheres, cube(), limited)).leaves, 27u * 64u);
}

TEST(Steering, everyWayIsTheSameForAnyNumberOfThreads) {
  const std::vector<BuildOptions> ways = {
      {.targetError = 1e-6, .criterion = Criterion::optimal},
      {.targetError = NearFarError{1e-3, 4e-3}},
      {.targetError = NearFarError{1e-3, 4e-3}, .criterion = Criterion::optimal},
      {.targetError = 0, .maxError = 0.02},
      {.targetError = 0, .maxBytes = 200000, .criterion = Criterion::optimal},
      {.targetError = 1e-5, .nearnessKind = NearnessKind::exponential, .estimator = Estimator::residual},
      {.targetError = 1e-5, .estimator = Estimator::checked, .criterion = Criterion::optimal}};
  for (BuildOptions options : ways) {
    options.threads = 1;
    const Field one = build(spheres, cube(), options);
    options.threads = 3;
    const Field three = build(spheres, cube(), options);
    EXPECT_EQ(one.data().nodes, three.data().nodes);
    EXPECT_EQ(one.data().coefficients, three.data().coefficients);
    EXPECT_EQ(one.metadata().totalError, three.metadata().totalError);
  }
}

TEST(Steering, stagesOfAnOptimalConstructionAreThoseOfShorterOnes) {
  BuildOptions options{.targetError = 1e-7, .grid = {3, 3, 3}, .criterion = Criterion::optimal};
  const std::vector<std::uint64_t> steps = {0, 40, 90};
  std::size_t stage = 0;
  buildStages(spheres, cube(), options, steps, [&](const Field& field) {
    BuildOptions shorter = options;
    shorter.maxSteps = steps[stage++];
    const Field whole = build(spheres, cube(), shorter);
    EXPECT_EQ(field.data().nodes, whole.data().nodes);
    EXPECT_EQ(field.data().coefficients, whole.data().coefficients);
  });
  EXPECT_EQ(stage, steps.size());
}

TEST(Steering, bytesAreALimitThatIsMadeUseOf) {
  for (const Criterion criterion : {Criterion::paper, Criterion::optimal}) {
    double lastRms = HUGE_VAL;
    for (const std::uint64_t bytes : {50000u, 150000u, 450000u}) {
      const Field field = build(spheres, cube(), {.targetError = 0, .maxBytes = bytes, .criterion = criterion});
      EXPECT_LE(field.bytes(), bytes);
      EXPECT_GT(field.bytes(), 0.85 * double(bytes));
      EXPECT_EQ(precisionName(field), "quantized");
      const double rms = measure(field, 50000).rms;
      EXPECT_LT(rms, 0.6 * lastRms);
      lastRms = rms;
    }
  }
  const Field reached = build(spheres, cube(), {.targetError = 1e-4, .maxBytes = 100000000});
  EXPECT_LE(reached.metadata().totalError, 1e-4);
  EXPECT_LT(reached.bytes(), 1000000u) << "the target ends it first";
  const Field precise =
      build(spheres, cube(), {.targetError = 0, .maxBytes = 400000, .coefficients = CoefficientType::float64});
  EXPECT_FALSE(precise.singlePrecision());
  EXPECT_LE(precise.bytes(), 400000u);
  EXPECT_NE(refusal({.targetError = 0, .maxBytes = 1000}).find("base grid alone"), std::string::npos);
}

/// The byte limit also holds with enrichment, blending and bounds, and for fields of hardly more than the base cells.
TEST(Steering, bytesAreNeverExceeded) {
  std::vector<BuildOptions> ways(1);
  const auto both = [&](const auto& change) {
    const std::vector<BuildOptions> before = ways;
    ways.insert(ways.end(), before.begin(), before.end());
    for (std::size_t n = before.size(); n < ways.size(); ++n) change(ways[n]);
  };
  both([](BuildOptions& o) { o.criterion = Criterion::optimal; });
  both([](BuildOptions& o) { o.strategy = Strategy::h2; });
  both([](BuildOptions& o) { o.enrich = true; });
  both([](BuildOptions& o) { o.blend = 0.1, o.bounds = true; });
  int built = 0, refused = 0;
  for (BuildOptions& options : ways)
    for (const std::uint64_t bytes : {6000u, 8000u, 11000u, 13000u, 16000u, 24000u, 50000u}) {
      options.targetError = 0;
      options.maxBytes = bytes;
      try {
        EXPECT_LE(build(spheres, cube(), options).bytes(), bytes);
        ++built;
      } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("base grid alone"), std::string::npos);
        ++refused;
      }
    }
  EXPECT_GT(built, 40);
  EXPECT_GT(refused, 20);
}

TEST(Steering, noSampleIsWorseThanTheMaximumError) {
  const Field field = build(spheres, cube(), {.targetError = 0, .maxError = 0.01});
  const Measured m = measure(field);
  EXPECT_LE(m.largest, 0.01);
  EXPECT_GT(m.largest, 0.002);
  EXPECT_LE(field.metadata().measuredError, 0.01);
  EXPECT_GE(field.metadata().measuredError, m.largest) << "with half of the greatest step beside it";
  EXPECT_EQ(field.metadata().settings.maxError, 0.01);

  const Field band = build(spheres, cube(), {.targetError = 0, .maxError = 0.01, .band = kBand});
  EXPECT_LE(measure(band).largestInBand, 0.01);
  EXPECT_LT(statistics(band).leaves, statistics(field).leaves);

  // maxBytes is only a limit for the refinement towards maxError; the refinement must not fill it up.
  const Field within = build(spheres, cube(), {.targetError = 0, .maxError = 0.01, .maxBytes = field.bytes() + 100000});
  EXPECT_LE(within.metadata().measuredError, 0.01);
  EXPECT_LE(within.bytes(), field.bytes());

  const Field loose = build(spheres, cube(), {.targetError = 1e-4});
  EXPECT_GT(measure(loose).largest, 0.01) << "or the target alone would have done";
  EXPECT_EQ(loose.metadata().measuredError, 0);
  const Field after = build(spheres, cube(), {.targetError = 1e-4, .maxError = 0.01});
  EXPECT_LE(measure(after).largest, 0.01);
  EXPECT_LE(after.metadata().totalError, 1e-4);
}

TEST(Steering, whatIsLeftOfTheMaximumErrorIsSaid) {
  for (const BuildOptions& options : {BuildOptions{.targetError = 0, .maxError = 1e-3, .maxDegree = 2, .maxDepth = 1},
                                      BuildOptions{.targetError = 0, .maxError = 1e-3, .maxSteps = 5},
                                      BuildOptions{.targetError = 0, .maxError = 1e-3, .maxBytes = 60000}}) {
    const Field field = build(spheres, cube(), options);
    EXPECT_GT(field.metadata().measuredError, 1e-3);
    EXPECT_GE(field.metadata().measuredError, 0.9 * measure(field, 50000).largest);
    EXPECT_LE(*field.metadata().steps, options.maxSteps.value_or(*field.metadata().steps));
    EXPECT_LE(field.bytes(), options.maxBytes.value_or(field.bytes()));
  }
}

TEST(Steering, nearAndFarErrorsAreReached) {
  for (const Criterion criterion : {Criterion::paper, Criterion::optimal}) {
    const Field field = build(spheres, cube(), {.targetError = NearFarError{3e-4, 3e-3}, .criterion = criterion});
    const Measured m = measure(field);
    EXPECT_LT(m.near, 1.2 * 3e-4);
    EXPECT_LT(m.far, 1.2 * 3e-3);
    EXPECT_GT(m.far, 3e-4) << "far away may be worse";
    EXPECT_GT(field.metadata().settings.nearness, 0);
    EXPECT_EQ(field.metadata().settings.nearnessKind, NearnessKind::exponential);
    EXPECT_EQ(field.metadata().settings.targetError.weighted(), field.metadata().totalError);
    const Field even = build(spheres, cube(), {.targetError = NearFarError{3e-4, 3e-4}, .criterion = criterion});
    EXPECT_EQ(even.metadata().settings.nearness, 0);
    EXPECT_LT(measure(even).far, 1.2 * 3e-4);
    EXPECT_GT(even.bytes(), field.bytes());
  }
}

/// Points outside the narrow band count neither as accurate nor as wrong.
TEST(Steering, nearAndFarErrorsLookAtTheBandAlone) {
  const auto made = [](Criterion criterion) {
    const BuildOptions options{.targetError = NearFarError{3e-4, 3e-3},
                               .estimator = Estimator::embedded,
                               .criterion = criterion,
                               .band = kBand};
    return build(spheres, cube(), options);
  };
  const Field paper = made(Criterion::paper), optimal = made(Criterion::optimal);
  EXPECT_LT(double(optimal.bytes()), 0.85 * double(paper.bytes()));
  EXPECT_LT(measure(optimal).near, 1.2 * 3e-4);
  EXPECT_LT(measure(paper).near, 1.2 * 3e-4);
}

TEST(Steering, roundingCountsForTheMaximumError) {
  const auto far = [](const Vector3& x) { return x.norm() + 10000; };
  const Box domain(Vector3::Constant(1), Vector3::Constant(2));
  const auto made = [&](CoefficientType type, double maxError) {
    return build(far, domain, {.targetError = 0, .grid = {2, 2, 2}, .maxError = maxError, .coefficients = type});
  };
  EXPECT_FALSE(made(CoefficientType::automatic, 1e-3).singlePrecision());
  EXPECT_EQ(precisionName(build(spheres, cube(), {.targetError = 0, .maxError = 0.05})), "quantized");
  const Field field = made(CoefficientType::float32, 1e-4);
  double worst = 0;
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> coordinate(1, 2);
  for (int n = 0; n < 20000; ++n) {
    const Vector3 x(coordinate(random), coordinate(random), coordinate(random));
    worst = std::max(worst, std::abs(field.value(x) - far(x)));
  }
  EXPECT_GT(worst, 1e-4);
  EXPECT_GE(field.metadata().measuredError, worst);
}

TEST(Steering, residualIsTheErrorItself) {
  for (const Estimator estimator : {Estimator::embedded, Estimator::residual, Estimator::checked}) {
    BuildOptions options{.targetError = 1e-7, .nearness = 0, .estimator = estimator};
    options.coefficients = CoefficientType::float64;
    const Field field = build(spheres, cube(), options);
    EXPECT_NEAR(measure(field).rms / field.metadata().rmsEstimate(field.domain()), 1.1, 0.2);
    EXPECT_EQ(field.metadata().settings.estimator, estimator);
  }
}

TEST(Steering, nearnessWeighs) {
  const detail::Nearness polynomial{NearnessKind::polynomial, 4, 2}, exponential{NearnessKind::exponential, 4, 2};
  EXPECT_EQ(polynomial.weight(0), 1);
  EXPECT_EQ(exponential.weight(0), 1);
  EXPECT_DOUBLE_EQ(polynomial.weight(-0.5), std::pow(0.75, 4));
  EXPECT_DOUBLE_EQ(exponential.weight(-0.5), std::exp(-1));
  EXPECT_EQ(polynomial.weight(3), 0);
  const BuildOptions even{.targetError = 1e-6, .nearness = 0};
  BuildOptions weighed = even;
  weighed.nearness = 20;
  weighed.nearnessKind = NearnessKind::exponential;
  EXPECT_LT(statistics(build(spheres, cube(), weighed)).leaves, statistics(build(spheres, cube(), even)).leaves);
}

TEST(Steering, refusesWhatDoesNotGoTogether) {
  EXPECT_NE(refusal({.targetError = 0}).find("target error 0"), std::string::npos);
  EXPECT_NE(refusal({.targetError = NearFarError{.near = 1e-3}}).find("give both"), std::string::npos);
  EXPECT_NE(refusal({.targetError = NearFarError{1e-3, 1e-4}}).find("above far error"), std::string::npos);
  EXPECT_NE(refusal({.maxError = -1}).find("max error -1"), std::string::npos);
  EXPECT_NE(refusal({.maxError = 0.1, .criterion = Criterion::optimal}).find("maximum error"), std::string::npos);
  BuildOptions paper = paperOptions();
  paper.estimator = Estimator::checked;
  EXPECT_NE(refusal(paper).find("checked estimator"), std::string::npos);
  paper.estimator = Estimator::embedded;
  paper.criterion = Criterion::optimal;
  EXPECT_NE(refusal(paper).find("children's samples"), std::string::npos);
}

}  // namespace steering_test
}  // namespace hpsdf
