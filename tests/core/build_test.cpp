#include "hpsdf/build.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/field_file.h"
#include "hpsdf/shapes.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace build_test {

double sphere(const Vector3& x) { return x.norm() - 1; }
double torus(const Vector3& x) { return std::hypot(std::hypot(x.x(), x.y()) - 0.7, x.z()) - 0.3; }
Box cube(double half = 1.1) { return Box(Vector3::Constant(-half), Vector3::Constant(half)); }

struct Measured {
  double rms = 0;
  double largest = 0;
  double weightedSquare = 0;  ///< ∫ κ(Φ) (f − Φ)² over the domain, with the nearness exponent θ = 4
};

template <typename Phi>
Measured measure(const Field& field, Phi phi, int count = 50000) {
  std::mt19937_64 random(5);
  Measured m;
  const Box& domain = field.domain();
  const double diagonal = domain.diagonal().norm();
  for (int n = 0; n < count; ++n) {
    Vector3 x;
    for (int axis = 0; axis < 3; ++axis)
      x[axis] = std::uniform_real_distribution<double>(domain.min()[axis], domain.max()[axis])(random);
    const double error = field.value(x) - phi(x);
    m.rms += error * error / count;
    m.largest = std::max(m.largest, std::abs(error));
    m.weightedSquare += std::pow(1 - std::abs(phi(x)) / diagonal, 4) * error * error / count;
  }
  m.weightedSquare *= domain.sizes().prod();
  m.rms = std::sqrt(m.rms);
  return m;
}

TEST(Build, sphereAndTorusAreAccurate) {
  for (const auto phi : {sphere, torus}) {
    const Field field = build(phi, cube(), {.targetError = 1e-8});
    const Measured m = measure(field, phi);
    EXPECT_LT(m.rms, 1e-4);
    EXPECT_LT(m.largest, 5e-3);
    EXPECT_LE(field.metadata().totalError, 1e-8);
    EXPECT_GT(field.metadata().totalError, 0.9e-8);
    EXPECT_LT(m.weightedSquare, 1.3e-8);
    EXPECT_NEAR(field.metadata().rmsEstimate(field.domain()), std::sqrt(field.metadata().totalError / std::pow(2.2, 3)),
                1e-12);
  }
}

/// The numbers of leaves, coefficients and distance evaluations must not change, with default settings and with the
/// paper's. A box needs small cells at its edges and high degrees at its faces.
TEST(Build, countsOfAKnownBox) {
  struct Known {
    BuildOptions options;
    double leaves, coefficients, evaluations;
  };
  BuildOptions paper = paperOptions();
  paper.targetError = 1e-6;
  const BuildOptions embedded{.targetError = 1e-6, .estimator = Estimator::embedded};
  BuildOptions product = embedded;
  product.cubature = CubatureKind::product;
  for (const Known& known :
       {Known{{.targetError = 1e-6}, 22826, 245300, 1145432}, Known{embedded, 24548, 284088, 1629360},
        Known{product, 23813, 280978, 2946560}, Known{paper, 16456, 207568, 6772552}}) {
    const Field field = build(shapes::analytic("analytic:box"), cube(), known.options);
    const FieldStatistics figures = statistics(field);
    EXPECT_NEAR(double(figures.leaves), known.leaves, 0.002 * known.leaves);
    EXPECT_NEAR(double(figures.coefficients), known.coefficients, 0.002 * known.coefficients);
    EXPECT_NEAR(double(field.metadata().exactEvaluations), known.evaluations, 0.002 * known.evaluations);
  }
}

/// At degree 30 the fit is exact up to rounding; rounding of the running error sum must not delay the end.
TEST(Build, roundingEndsNoConstructionLate) {
  const auto smooth = [](const Vector3& x) { return std::sin(x.x()) * std::cos(x.y()) * std::exp(x.z()) + 5; };
  const auto coefficients = [&](double target) {
    const Field field = build(
        smooth, cube(),
        {.targetError = target, .grid = {1, 1, 1}, .nearness = 0, .estimator = Estimator::embedded, .maxDepth = 1});
    double sum = 0;
    field.forEachCell([&](const Cell& cell) { sum += cell.error; });
    EXPECT_NEAR(field.metadata().totalError, sum, 1e-6 * sum);
    EXPECT_LE(sum, target);
    return statistics(field).coefficients;
  };
  EXPECT_LT(coefficients(1e-17), 2 * coefficients(1e-15));
}

TEST(Build, octreeAloneNeedsMoreCoefficients) {
  const auto coefficients = [](Strategy strategy, double targetError) {
    BuildOptions options = paperOptions();
    options.strategy = strategy;
    options.targetError = targetError;
    const Field field = build(torus, cube(), options);
    EXPECT_LE(field.metadata().totalError, targetError);
    const FieldStatistics s = statistics(field);
    if (strategy != Strategy::hp) {
      EXPECT_EQ(s.degreeLeaves.size(), 1u);
      EXPECT_EQ(s.degreeLeaves.begin()->first, strategy == Strategy::h1 ? 1 : 2);
    }
    EXPECT_LT(measure(field, torus).rms, std::sqrt(targetError));
    return double(s.coefficients);
  };
  EXPECT_GT(coefficients(Strategy::h2, 1e-5), 3 * coefficients(Strategy::hp, 1e-5));
  // The estimated error of a polynomial of degree 1 is its whole slope: too large, hence the larger target error.
  EXPECT_GT(coefficients(Strategy::h1, 1e-2), 3 * coefficients(Strategy::hp, 1e-2));
}

TEST(Build, totalErrorIsTheWeightedSumOverTheCells) {
  const BuildOptions options{
      .targetError = 1e-6, .nearness = 3, .estimator = Estimator::embedded, .coefficients = CoefficientType::float64};
  const Field field = build(torus, cube(), options);
  double sum = 0;
  field.forEachCell([&](const Cell& cell) {
    const double mean = *std::get<0>(field.data().coefficients).at(node::offset(field.data().nodes[cell.id]), 1);
    sum += std::pow(1 - std::abs(mean) / cube().diagonal().norm(), 3) * cell.error;
  });
  EXPECT_NEAR(sum, field.metadata().totalError, 1e-12);
}

std::string fileBytes(const Field& field, const std::filesystem::path& file) {
  save(field, file);
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(Build, sameBytesForAnyNumberOfThreads) {
  support::TemporaryDirectory folder;
  std::string first;
  const tbb::global_control workers(tbb::global_control::max_allowed_parallelism, 8);
  for (const int threads : {1, 2, 3, 8}) {
    const Field field = build(torus, cube(), {.targetError = 1e-7, .threads = threads});
    const std::string bytes = fileBytes(field, folder.path() / "field.hpsdf");
    if (first.empty()) first = bytes;
    EXPECT_TRUE(bytes == first) << threads << " threads";
  }
}

struct Counts {
  std::size_t leaves = 0;
  int degrees = 0;  ///< sum of the degrees of all leaves
  bool operator==(const Counts&) const = default;
};
Counts countsOf(const Field& field) {
  Counts counts;
  field.forEachCell([&](const Cell& cell) {
    ++counts.leaves;
    counts.degrees += cell.degree;
  });
  return counts;
}

/// Maps the box of each leaf to the leaf's coefficients.
std::map<std::vector<double>, std::vector<double>> leavesOf(const Field& field) {
  std::map<std::vector<double>, std::vector<double>> leaves;
  const auto& coefficients = std::get<FieldArray<double>>(field.data().coefficients).all();
  field.forEachCell([&](const Cell& cell) {
    const Vector3 lo = cell.box.min(), hi = cell.box.max();
    const auto first = coefficients.begin() + node::offset(field.data().nodes[cell.id]);
    leaves[{lo.x(), lo.y(), lo.z(), hi.x(), hi.y(), hi.z()}] = {first, first + coefficientCount(cell.degree)};
  });
  return leaves;
}

/// A construction with a step limit takes the same first steps as one without, even if the limit ends a parallel round.
TEST(Build, stepsAreCountedAndLimited) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "field.hpsdf";
  BuildOptions options{.targetError = 1e-5, .grid = {2, 3, 2}, .coefficients = CoefficientType::float64};
  const auto after = [&](std::uint64_t steps) {
    options.maxSteps = steps;
    return build(torus, cube(), options);
  };
  const Field whole = build(torus, cube(), options);
  const std::uint64_t total = whole.metadata().steps.value();
  ASSERT_GT(total, 100u);

  EXPECT_EQ(countsOf(after(0)), (Counts{12, 24})) << "the base cells, of degree 2";
  Field before = after(0);
  for (std::uint64_t steps = 1; steps <= 70; ++steps) {  // more than two rounds
    const Field field = after(steps);
    ASSERT_EQ(field.metadata().steps, steps);
    const Counts counts = countsOf(field), older = countsOf(before);
    const auto leaves = leavesOf(field), olderLeaves = leavesOf(before);
    std::size_t gone = 0;
    for (const auto& [box, coefficients] : olderLeaves) {
      const auto same = leaves.find(box);
      gone += same == leaves.end() || same->second != coefficients;
    }
    EXPECT_EQ(gone, 1u) << "after step " << steps << " one leaf is another";
    if (counts.leaves == older.leaves)
      EXPECT_EQ(counts.degrees, older.degrees + 1);
    else
      EXPECT_EQ(counts.leaves, older.leaves + 7);
    before = field;
  }
  EXPECT_GT(after(total - 1).metadata().totalError, 1e-5);

  const std::string bytes = fileBytes(whole, file);
  EXPECT_TRUE(fileBytes(after(total), file) == bytes);
  EXPECT_TRUE(fileBytes(after(total + 1), file) == bytes);
  const std::string half = fileBytes(after(total / 2), file);
  EXPECT_FALSE(half == bytes);
  options.threads = 1;
  EXPECT_TRUE(fileBytes(after(total / 2), file) == half);
}

TEST(Build, stagesAreTheFieldsOfLimitedConstructions) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "field.hpsdf";
  BuildOptions options{.targetError = 1e-5, .grid = {2, 2, 2}};
  const std::uint64_t total = build(torus, cube(), options).metadata().steps.value();
  const std::vector<std::uint64_t> steps = {0, 1, 31, 32, 33, 33, 100, total, total + 1};
  std::vector<std::string> stages;
  buildStages(torus, cube(), options, steps, [&](const Field& field) { stages.push_back(fileBytes(field, file)); });
  ASSERT_EQ(stages.size(), steps.size());
  for (std::size_t n = 0; n < steps.size(); ++n) {
    options.maxSteps = steps[n];
    EXPECT_TRUE(stages[n] == fileBytes(build(torus, cube(), options), file)) << steps[n] << " steps";
  }
  options.maxSteps = 5;
  buildStages(torus, cube(), options, steps, [&](const Field& field) { EXPECT_LE(field.metadata().steps, 5u); });
  const std::vector<std::uint64_t> descending = {2, 1};
  EXPECT_THROW(buildStages(torus, cube(), options, descending, [](const Field&) {}), Error);
}

/// The field that a construction offers while it grows costs no evaluation of the distance, even where later stages
/// would, and does not affect the result.
TEST(Build, offersTheFieldAsItGrows) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "field.hpsdf";
  std::atomic<std::uint64_t> evaluations = 0;
  const auto counted = [&](const Vector3& x) {
    ++evaluations;
    return torus(x);
  };
  const BuildOptions simple{.targetError = 1e-5, .grid = {2, 2, 2}, .maxError = 0.02};
  BuildOptions rich = simple;
  rich.maxError = 0;
  rich.criterion = Criterion::optimal;
  rich.enrich = rich.bounds = true;
  rich.continuityWeight = 1;
  for (const BuildOptions& options : {simple, rich}) {
    evaluations = 0;
    const std::string alone = fileBytes(build(counted, cube(), options), file);
    const std::uint64_t evaluationsAlone = evaluations.exchange(0);
    std::vector<std::uint64_t> steps;
    const auto look = [&](const std::function<Field()>& fieldSoFar) {
      const std::uint64_t before = evaluations;
      const Field field = fieldSoFar();
      EXPECT_EQ(evaluations, before);
      EXPECT_LT(measure(field, torus, 100).rms, 0.2);
      steps.push_back(field.metadata().steps.value());
    };
    EXPECT_TRUE(fileBytes(build(counted, cube(), options, {}, look), file) == alone);
    EXPECT_EQ(evaluations, evaluationsAlone);
    EXPECT_GT(steps.size(), 2U);
    EXPECT_TRUE(std::ranges::is_sorted(steps));
    EXPECT_GT(steps.back(), steps.front());
  }
  EXPECT_THROW(build(torus, cube(), simple, {}, [](const auto&) { throw Cancelled(); }), Cancelled);
}

/// The field so far is that of a construction which ends there, but for the rounding of its coefficients.
TEST(Build, theFieldSoFarIsThatOfALimitedConstruction) {
  support::TemporaryDirectory folder;
  const auto file = folder.path() / "field.hpsdf";
  BuildOptions options{.targetError = 1e-5, .grid = {2, 2, 2}, .coefficients = CoefficientType::float32};
  std::vector<Field> offered;
  build(torus, cube(), options, {}, [&](const auto& fieldSoFar) { offered.push_back(fieldSoFar()); });
  ASSERT_GT(offered.size(), 2U);
  options.maxSteps = offered[1].metadata().steps;
  const Field limited = build(torus, cube(), options);
  EXPECT_TRUE(std::ranges::equal(offered[1].data().nodes, limited.data().nodes));
  EXPECT_TRUE(offered[1].data().coefficients == limited.data().coefficients);
}

TEST(Build, offersNoFieldWhileMemoryIsShort) {
  BuildOptions options{.targetError = 1e-6, .grid = {2, 2, 2}};
  const auto offers = [&] {
    int count = 0;
    build(torus, cube(), options, {}, [&](const auto&) { ++count; });
    return count;
  };
  const int all = offers();
  const Field field = build(torus, cube(), options);
  options.memoryLimit = 250 * field.data().nodes.size() + 8 * statistics(field).coefficients + 1000;
  EXPECT_LT(offers(), all);
}

/// τ refers to a mesh scaled to the paper's size: scaling the shape by a power of two gives exactly the same cells.
TEST(Build, targetErrorIsMeantAtThePapersScale) {
  const Field one = build(DistanceFunction(sphere, Source{.box = cube(1)}), cube(), {.targetError = 1e-6});
  const auto large = [](const Vector3& x) { return x.norm() - 1024; };
  const Field other =
      build(DistanceFunction(large, Source{.box = cube(1024)}), cube(1024 * 1.1), {.targetError = 1e-6});
  EXPECT_EQ(one.data().nodes, other.data().nodes);
  EXPECT_DOUBLE_EQ(one.metadata().totalError, other.metadata().totalError);
  EXPECT_NEAR(other.metadata().rmsEstimate(other.domain()), 1024 * one.metadata().rmsEstimate(one.domain()), 1e-9);
  // A callable without a bounding box is scaled by the size of the domain.
  const Field bare = build(large, cube(1024 * 1.1), {.targetError = 1e-6});
  EXPECT_DOUBLE_EQ(bare.metadata().referenceLength, 2048);
}

TEST(Build, floatCoefficientsChangeTheFieldByWhatIsStated) {
  const Field exact = build(torus, cube(), {.targetError = 1e-7, .coefficients = CoefficientType::float64});
  const Field rounded = build(torus, cube(), {.targetError = 1e-7, .coefficients = CoefficientType::float32});
  EXPECT_EQ(exact.data().nodes, rounded.data().nodes);
  EXPECT_FALSE(exact.singlePrecision());
  EXPECT_TRUE(rounded.singlePrecision());
  EXPECT_EQ(exact.metadata().roundingRms, 0);
  const Measured m = measure(rounded, [&](const Vector3& x) { return exact.value(x); });
  EXPECT_GT(m.rms, 0);
  EXPECT_NEAR(m.rms / rounded.metadata().roundingRms, 1, 0.1);
}

TEST(Build, automaticPrecisionFollowsTheTarget) {
  EXPECT_EQ(precisionName(build(sphere, cube(), {.targetError = 1e-6})), "quantized");
  // An RMS error of 1e-9 is requested: integers would be too long, and rounding to float would add more than 1 %.
  const auto smooth = [](const Vector3& x) { return 0.1 * x.x() * x.y() * x.z() + std::sin(x.x()) + 10; };
  EXPECT_EQ(precisionName(build(smooth, cube(), {.targetError = 1e-17, .nearness = 0})), "double");
}

/// Coefficients are quantized with a change of a tenth of the estimated error, or else stored as doubles.
TEST(Build, automaticPrecisionComparesRoundingWithTheEstimate) {
  const auto smooth = [](const Vector3& x) { return 3 + std::sin(x.x()) * std::cos(x.y()) * std::exp(x.z()); };
  int quantized = 0, doubles = 0;
  for (double target = 1e-6; target > 1e-17; target /= 10) {
    const Field chosen = build(smooth, cube(), {.targetError = target, .grid = {2, 2, 2}, .nearness = 0});
    if (precisionName(chosen) == "double") {
      ++doubles;
      continue;
    }
    ++quantized;
    ASSERT_EQ(precisionName(chosen), "quantized");
    EXPECT_EQ(doubles, 0) << "only for the least errors";
    EXPECT_NEAR(chosen.metadata().roundingRms / chosen.metadata().rmsEstimate(chosen.domain()), 0.1, 0.02);
  }
  EXPECT_GT(quantized, 0);
  EXPECT_GT(doubles, 0);
}

/// The memory estimate of build.h is 250 bytes per node and 8 bytes per coefficient.
TEST(Build, saysEarlyThatMemoryWillNotDo) {
  std::atomic<std::uint64_t> taken = 0;
  const auto counted = [&](const Vector3& x) {
    ++taken;
    return torus(x);
  };
  BuildOptions options{.targetError = 1e-8};
  const Field whole = build(counted, cube(), options);
  const std::uint64_t all = taken.exchange(0);
  const double needed = 250.0 * double(whole.data().nodes.size()) + 8.0 * double(statistics(whole).coefficients);
  options.memoryLimit = std::uint64_t(1.1 * needed);
  EXPECT_EQ(build(counted, cube(), options).data().nodes, whole.data().nodes);
  EXPECT_EQ(taken.exchange(0), all);
  options.memoryLimit = std::uint64_t(needed / 3);
  try {
    build(counted, cube(), options);
    FAIL() << "it holds no more than a third";
  } catch (const MemoryLimitError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("of memory are needed, more than the"));
    EXPECT_THAT(error.what(), testing::StartsWith("about ")) << "it is read off how the error falls";
    EXPECT_THAT(error.what(), testing::HasSubstr("a memoryLimit of " + std::to_string(error.enough())));
    EXPECT_EQ(error.kind(), ErrorKind::limit);
    EXPECT_GE(double(error.enough()), needed);
  }
  EXPECT_LT(taken.load(), all / 4) << "more than it takes to fill that third";
  options.memoryLimit = 10'000;
  EXPECT_THROW(build(counted, cube(), options), Error) << "not even the base grid";
}

TEST(Build, saysEarlyThatASoupTakesTooMuchMemory) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  TriangleMesh soup;
  for (std::uint32_t i = 0; i < 100; ++i) {
    for (int k = 0; k < 3; ++k) soup.vertices.emplace_back(uniform(random), uniform(random), uniform(random));
    soup.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const ExactDistance distance(soup);
  std::atomic<std::uint64_t> taken = 0;
  const auto counted = [&](const Vector3& x) {
    ++taken;
    return distance(x);
  };
  EXPECT_THROW(build(counted, domainAround(soup), {.targetError = 1e-6, .memoryLimit = 40'000'000}), Error);
  EXPECT_LT(taken.load(), 400'000u) << "the power law of the error tells it";
}

/// While the facets come into sight, the error hardly falls for a while.
TEST(Build, isNotRefusedWhereTheFacetsOfASmoothShapeComeIntoSight) {
  const TriangleMesh sphere = shapes::mesh("sphere,subdivisions=3");
  const ExactDistance distance(sphere);
  BuildOptions options{.targetError = 5e-8, .strategy = Strategy::hp};
  options.memoryLimit = distance.bytes() + 45'000'000;  // the construction takes 36 MB
  EXPECT_NO_THROW(build(distance, domainAround(sphere), options));
}

TEST(Build, limitsHold) {
  const Field shallow = build(torus, cube(), {.targetError = 1e-9, .maxDegree = 6, .maxDepth = 1});
  const FieldStatistics s = statistics(shallow);
  EXPECT_LE(s.depthLeaves.rbegin()->first, 1);
  EXPECT_EQ(s.degreeLeaves.rbegin()->first, 6);    // at the maximum depth only the degree can increase
  EXPECT_GT(shallow.metadata().totalError, 1e-9);  // the construction ended because no leaf could be refined further
  const Field flat = build(torus, cube(), {.targetError = 1e-6, .maxDegree = 2});
  EXPECT_EQ(statistics(flat).degreeLeaves.size(), 1u);
  const Field linear = build(torus, cube(), {.targetError = 1e-3, .strategy = Strategy::h1});
  EXPECT_EQ(statistics(linear).degreeLeaves.rbegin()->first, 1);
  EXPECT_EQ(linear.metadata().settings.maxDegree, 1);
  const Field base = build(torus, cube(), {.targetError = 1e-9, .maxDegree = 2, .maxDepth = 0});
  EXPECT_EQ(statistics(base).leaves, 216u);
}

/// Φ is even about the centre of the single base cell, so that coefficients of odd degree vanish; the estimator must
/// not mistake the first vanishing degree for convergence.
TEST(Build, symmetryDoesNotLookLikeConvergence) {
  const Field field = build(sphere, cube(), {.targetError = 1e-8, .grid = {1, 1, 1}});
  EXPECT_GT(statistics(field).leaves, 50u);
  EXPECT_LT(measure(field, sphere).rms, 1e-4);
}

TEST(Build, bandLeavesFarCellsAlone) {
  const BuildOptions everywhere{.targetError = 1e-8, .nearness = 0, .estimator = Estimator::embedded};
  BuildOptions near = everywhere;
  near.band = 0.1;
  const Field whole = build(torus, cube(), everywhere);
  const Field banded = build(torus, cube(), near);
  EXPECT_LT(statistics(banded).leaves, statistics(whole).leaves);
  banded.forEachCell([&](const Cell& cell) {
    const double closest = std::abs(torus(cell.box.center())) - cell.box.diagonal().norm() / 2;
    if (closest > 0.2) {
      EXPECT_LE(cell.degree, 3);
    }
    if (closest > 0.2) {
      EXPECT_LE(cell.depth, 1);
    }
  });
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1.1, 1.1);
  double square = 0;
  int count = 0;
  while (count < 20000) {
    const Vector3 x(uniform(random), uniform(random), uniform(random));
    if (std::abs(torus(x)) > 0.1) continue;
    square += std::pow(banded.value(x) - torus(x), 2);
    ++count;
  }
  EXPECT_LT(std::sqrt(square / count), 1e-4);
}

/// A higher nearness exponent θ increases the error far from the surface relative to the error near it.
TEST(Build, nearnessFavoursTheSurface) {
  const auto farOverNear = [](double nearness) {
    const Field field = build(torus, cube(), {.targetError = 1e-6, .nearness = nearness});
    std::mt19937_64 random(6);
    std::uniform_real_distribution<double> uniform(-1.1, 1.1);
    double near = 0, far = 0;
    int nearCount = 0, farCount = 0;
    for (int n = 0; n < 100000; ++n) {
      const Vector3 x(uniform(random), uniform(random), uniform(random));
      const bool isNear = std::abs(torus(x)) < 0.1;
      (isNear ? near : far) += std::pow(field.value(x) - torus(x), 2);
      ++(isNear ? nearCount : farCount);
    }
    return std::sqrt(far / farCount) / std::sqrt(near / nearCount);
  };
  EXPECT_GT(farOverNear(32), 2 * farOverNear(0));
}

TEST(Build, boxesAndGridsNeedNotBeCubic) {
  const Box domain(Vector3(-1.2, -1.3, -0.5), Vector3(1.1, 1.2, 0.6));
  const Field field = build(torus, domain, {.targetError = 1e-7, .grid = {5, 4, 2}});
  EXPECT_LT(measure(field, torus).rms, 3e-4);
  EXPECT_EQ(field.grid(), (std::array<std::uint32_t, 3>{5, 4, 2}));
}

TEST(Build, takesBatchedCallables) {
  std::atomic<std::size_t> calls = 0;
  const auto batched = [&](std::span<const Vector3> points, std::span<double> out) {
    calls += points.size();
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = torus(points[i]);
  };
  const Field field = build(batched, cube(), {.targetError = 1e-6});
  EXPECT_EQ(field.data().nodes, build(torus, cube(), {.targetError = 1e-6}).data().nodes);
  EXPECT_EQ(field.metadata().exactEvaluations, calls);
}

TEST(Build, progressRisesAndCancelStops) {
  double last = 0;
  std::size_t reports = 0;
  bool rises = true;
  Progress progress;
  progress.report = [&](std::string_view task, double fraction) {
    if (task != "refining") return;
    rises = rises && fraction >= last;
    last = fraction;
    ++reports;
  };
  build(torus, cube(), {.targetError = 1e-7}, progress);
  EXPECT_TRUE(rises);
  EXPECT_GT(reports, 10u);
  EXPECT_GT(last, 0.5);

  std::atomic<int> calls = 0;
  progress.cancelled = [&] { return ++calls > 100; };
  EXPECT_THROW(build(torus, cube(), {.targetError = 1e-9}, progress), Cancelled);
}

/// A cell of high degree has many batches of samples; cancelling must not wait for the last batch.
TEST(Build, cancelStopsWithinACell) {
  std::atomic<std::size_t> taken = 0, takenLate = 0;
  std::atomic<bool> cancel = false;
  const auto phi = [&](std::span<const Vector3> points, std::span<double> out) {
    if (cancel) takenLate += points.size();
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = torus(points[i]);
    if ((taken += points.size()) > 60000) cancel = true;
  };
  const Progress progress{.report = {}, .cancelled = [&] { return cancel.load(); }};
  EXPECT_THROW(build(phi, cube(), {.targetError = 1e-12, .grid = {1, 1, 1}, .maxDepth = 0, .threads = 1}, progress),
               Cancelled);
  EXPECT_EQ(takenLate, 0u);
}

TEST(Build, refusesBadOptions) {
  const auto refuses = [](const BuildOptions& options, const std::string& word, const Box& domain = cube()) {
    try {
      build(torus, domain, options);
      ADD_FAILURE() << "accepted: " << word;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refuses({.targetError = 0}, "target error");
  refuses({.targetError = -1}, "target error");
  refuses({.targetError = nan}, "target error");
  refuses({.grid = {6, 0, 6}}, "base grid");
  refuses({.grid = {100000, 100000, 100000}}, "base grid");
  refuses({.nearness = -1}, "nearness");
  refuses({.maxDegree = 31}, "degree");
  refuses({.maxDegree = 0}, "degree");
  refuses({.maxDepth = 21}, "depth");
  refuses({.quadrature = 1}, "quadrature");
  refuses({.band = -1}, "band");
  refuses({.threads = -1}, "threads");
  refuses({.grid = {16384, 1, 1}, .maxDepth = 20}, "2^32 cells an axis");
  refuses({.tolerance = 0.1, .continuityWeight = 1}, "leave out weak continuity or the tolerance");
  refuses({.tolerance = 0.1, .enrich = true}, "leave out enrich or the tolerance");
  refuses({.tolerance = 0.1, .band = 1}, "leave out the band or the tolerance");
  refuses({.maxError = 0.1, .continuityWeight = 1}, "leave out weak continuity or the maximum error");
  refuses({.targetError = 1e-300}, "beyond double precision", cube(1e-5));
  refuses({.targetError = 1e300}, "beyond double precision", cube(1e5));
  refuses({}, "domain", Box(Vector3(0, 0, 0), Vector3(1, 1, 0)));
  refuses({}, "domain", Box(Vector3(0, 0, 0), Vector3(1, nan, 1)));
}

TEST(Build, refusesDistancesThatAreNotFinite) {
  const auto broken = [](const Vector3& x) { return x.x() > 0.5 ? std::log(-1.0) : x.norm(); };
  EXPECT_THROW(build(broken, cube()), Error);
}

TEST(DomainAround, enlargesAsThePaperDoes) {
  const Box surface(Vector3(0, 0, 0), Vector3(4, 2, 1));
  const Box cubic = domainAround(surface);
  EXPECT_TRUE(cubic.sizes().isApprox(Vector3::Constant(4.4)));
  EXPECT_TRUE(cubic.center().isApprox(Vector3(2, 1, 0.5)));
  const Box box = domainAround(surface, DomainShape::box, 0.5);
  EXPECT_TRUE(box.sizes().isApprox(Vector3(6, 3, 1.5)));
  EXPECT_THROW(domainAround(Box()), Error);
}

}  // namespace build_test
}  // namespace hpsdf
