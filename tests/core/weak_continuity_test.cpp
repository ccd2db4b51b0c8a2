#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <atomic>
#include <cmath>
#include <random>

#include "basis/projection.h"
#include "field/continuity/face_coupling.h"
#include "field/query/evaluate.h"
#include "field/query/float_coefficients.h"
#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/error.h"
#include "hpsdf/jumps.h"
#include "hpsdf/shapes.h"
#include "support/random_field.h"

namespace hpsdf {
namespace weak_continuity_test {

std::vector<double> coefficientsOf(const Field& field) {
  const std::span<const double> all = std::get<FieldArray<double>>(field.data().coefficients).all();
  return {all.begin(), all.end()};
}

Field withCoefficients(const Field& field, const std::vector<double>& coefficients) {
  FieldData data = field.data();
  data.coefficients = coefficients;
  return Field(std::move(data));
}

Field inDouble(const Field& field) {
  FieldData data = field.data();
  query::toDouble(data);
  return Field(std::move(data));
}

/// Measures Σ w_F ∫ jump² dA over all interfaces F by quadrature, where w_F is the width of the smaller cell.
double jumpEnergy(const Field& field) {
  double sum = 0;
  for (const Interface& face : findJumps(field).interfaces) {
    const double width = query::cellSize(field.data(), std::max(face.depths[0], face.depths[1]))[face.axis];
    sum += width * face.area * face.value.rms * face.value.rms;
  }
  return sum;
}

/// Computes ‖f − g‖² from the coefficients of two fields with the same leaves, which may be stored in different orders.
double squaredDistance(const Field& field, const Field& other) {
  const std::vector<double> a = coefficientsOf(field);
  const std::vector<double> b = coefficientsOf(other);
  double sum = 0;
  field.forEachCell([&](const Cell& cell) {
    const std::uint32_t atA = node::offset(field.data().nodes[cell.id]);
    const std::uint32_t atB = node::offset(other.data().nodes[cell.id]);
    basis::forEachCoefficient(cell.degree, [&](int i, int j, int k, int index) {
      const double d = a[atA + index] - b[atB + index];
      sum += d * d * basis::squaredNorm(i, j, k) * query::cellSize(field.data(), cell.depth).prod();
    });
  });
  return sum;
}

double functional(const Field& field, const Field& fits, double weight) {
  return jumpEnergy(field) + weight * squaredDistance(field, fits);
}

/// Returns the matrix M of the face coupling, one product with a unit vector per column.
Eigen::MatrixXd denseMatrix(continuity::FaceCoupling& coupling, std::size_t size) {
  Eigen::MatrixXd matrix(size, size);
  std::vector<double> unit(size), column(size);
  for (std::size_t n = 0; n < size; ++n) {
    unit.assign(size, 0.0);
    unit[n] = 1;
    coupling.apply(0, unit, column);
    matrix.col(static_cast<Eigen::Index>(n)) =
        Eigen::Map<Eigen::VectorXd>(column.data(), static_cast<Eigen::Index>(size));
  }
  return matrix;
}

/// Returns the matrix M by polarisation of measured jump energies, independently of the library's traces.
Eigen::MatrixXd measuredMatrix(const Field& field, continuity::FaceCoupling& coupling, std::size_t size) {
  const double volume = field.domain().sizes().prod();
  const auto energy = [&](std::size_t m, std::size_t n) {
    std::vector<double> x(size, 0.0);
    x[m] += 1;
    x[n] += 1;
    FieldData data = field.data();
    coupling.fromUnknowns(x, data);
    return jumpEnergy(Field(std::move(data))) / volume;
  };
  Eigen::MatrixXd matrix(size, size);
  for (std::size_t m = 0; m < size; ++m)
    for (std::size_t n = m; n < size; ++n) {
      const double both = energy(m, n);
      matrix(m, n) = matrix(n, m) = m == n ? both / 4 : (both - energy(m, m) / 4 - energy(n, n) / 4) / 2;
    }
  return matrix;
}

/// Makes two neighbouring cells of unequal degree that are not cubes.
Field twoCells() {
  return randomField(3, {.domain = Box(Vector3(0, 0, 0), Vector3(2, 1.5, 0.7)),
                         .grid = {2, 1, 1},
                         .refinement = 0,
                         .minDegree = 2,
                         .maxDegree = 4});
}

/// Makes two base cells, one of which is split, with one of its children split again.
Field hangingCells() {
  return randomField(8, {.domain = Box(Vector3(0, 0, 0), Vector3(1, 2, 1.3)),
                         .grid = {1, 2, 1},
                         .refinement = 0,
                         .maxDepth = 2,
                         .deepAt = Vector3(0.3, 0.9, 0.2),
                         .minDegree = 1,
                         .maxDegree = 2});
}

TEST(FaceCoupling, equalsTheMatrixOfTheFunctional) {
  for (const Field& field : {twoCells(), hangingCells()}) {
    continuity::FaceCoupling coupling(field.data());
    const std::size_t size = coupling.toUnknowns(field.data()).size();
    const Eigen::MatrixXd matrix = denseMatrix(coupling, size);
    EXPECT_TRUE(matrix.isApprox(measuredMatrix(field, coupling, size), 1e-10));
    EXPECT_TRUE(matrix.isApprox(matrix.transpose(), 1e-14));
    const std::vector<double> diagonal = coupling.diagonal();
    double greatest = 0;
    for (std::size_t n = 0; n < size; ++n) greatest = std::max(greatest, std::abs(diagonal[n] / matrix(n, n) - 1));
    const bool hanging = findJumps(field).hanging > 0;
    EXPECT_LT(greatest, hanging ? 1 : 1e-13);
  }
}

TEST(FaceCoupling, readsAndWritesCoefficients) {
  const Field field = hangingCells();
  const continuity::FaceCoupling coupling(field.data());
  const std::vector<double> x = coupling.toUnknowns(field.data());
  double squares = 0;
  for (const double value : x) squares += value * value;
  const Field zero = withCoefficients(field, std::vector<double>(coefficientsOf(field).size(), 0.0));
  EXPECT_NEAR(squares, squaredDistance(field, zero) / field.domain().sizes().prod(), 1e-12 * squares);
  FieldData data = field.data();
  coupling.fromUnknowns(x, data);
  const Field again{std::move(data)};
  std::mt19937 random(1);
  for (int n = 0; n < 100; ++n) {
    const Vector3 point = field.domain().min() + field.domain().sizes().cwiseProduct(Vector3::Random().cwiseAbs());
    EXPECT_NEAR(again.value(point), field.value(point), 1e-13);
  }
}

TEST(WeakContinuity, solvesTheDenseSystem) {
  for (const Field& field : {twoCells(), hangingCells()})
    for (const double weight : {0.01, 1.0}) {
      continuity::FaceCoupling coupling(field.data());
      const std::vector<double> x0 = coupling.toUnknowns(field.data());
      const auto size = static_cast<Eigen::Index>(x0.size());
      Eigen::MatrixXd system = denseMatrix(coupling, x0.size());
      system.diagonal().array() += weight;
      const Eigen::VectorXd expected = system.ldlt().solve(weight * Eigen::Map<const Eigen::VectorXd>(x0.data(), size));
      const WeaklyContinuous made = weaklyContinuous(field, {.weight = weight, .tolerance = 1e-13});
      const std::vector<double> x = continuity::FaceCoupling(made.field.data()).toUnknowns(made.field.data());
      EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(x.data(), size) - expected).norm(), 1e-10 * expected.norm());
      EXPECT_GT(made.iterations, 1);
      EXPECT_LE(made.residual, 1e-13);
      const double change = std::sqrt(squaredDistance(made.field, inDouble(field)) / field.domain().sizes().prod());
      EXPECT_NEAR(made.change, change, 1e-12 * change);
      EXPECT_EQ(made.field.metadata().settings.continuityWeight, weight);
    }
}

TEST(WeakContinuity, isAMinimumOfTheFunctional) {
  const Field field = hangingCells();
  constexpr double kWeight = 0.3, kStep = 1e-3;
  const Field made = weaklyContinuous(field, {.weight = kWeight, .tolerance = 1e-13}).field;
  const double least = functional(made, field, kWeight);
  EXPECT_LT(least, functional(field, field, kWeight));
  const std::vector<double> c = coefficientsOf(made);
  for (std::size_t n = 0; n < c.size(); ++n) {  // central differences of a quadratic are exact
    std::vector<double> above = c, below = c;
    above[n] += kStep;
    below[n] -= kStep;
    const double up = functional(withCoefficients(made, above), field, kWeight);
    const double down = functional(withCoefficients(made, below), field, kWeight);
    EXPECT_NEAR(up, down, 1e-12) << n;
    EXPECT_GT(up, least);
    EXPECT_GT(down, least);
  }
}

TEST(WeakContinuity, tradesJumpForChange) {
  const Field field = randomField(5, {.maxDepth = 3, .maxDegree = 4});
  double jump = findJumps(field).value.rms, change = 0;
  for (const double weight : {100.0, 10.0, 1.0, 0.1, 0.01}) {
    const WeaklyContinuous made = weaklyContinuous(field, {.weight = weight});
    const double less = findJumps(made.field).value.rms;
    EXPECT_LT(less, jump) << weight;
    EXPECT_GT(made.change, change) << weight;
    jump = less;
    change = made.change;
  }
}

TEST(WeakContinuity, leavesAContinuousFieldAlone) {
  // All leaves have the same polynomial x³ − x·y + z.
  const Field pattern = randomField(11, {.minDegree = 3, .maxDegree = 5});
  FieldData data = pattern.data();
  auto& c = std::get<FieldArray<double>>(data.coefficients).values();
  const auto projection = basis::productProjection(basis::gaussLegendre(8), 5);
  pattern.forEachCell([&](const Cell& cell) {
    std::vector<double> samples;
    for (const Vector3& point : projection->points()) {
      const Vector3 x = cell.box.center() + 0.5 * cell.box.sizes().cwiseProduct(point);
      samples.push_back(x.x() * x.x() * x.x() - x.x() * x.y() + x.z());
    }
    std::vector<double> polynomial = (*projection)(samples);
    for (int degree = 5; degree > cell.degree; --degree) polynomial = basis::truncated(polynomial, degree, degree - 1);
    std::ranges::copy(polynomial, c.begin() + node::offset(data.nodes[cell.id]));
  });
  const Field field{std::move(data)};
  const WeaklyContinuous made = weaklyContinuous(field, {.weight = 1e-3});
  EXPECT_EQ(made.iterations, 0);
  EXPECT_EQ(made.change, 0);
  EXPECT_EQ(coefficientsOf(made.field), coefficientsOf(field));
}

TEST(WeakContinuity, givesTheSameBytesForAnyNumberOfThreads) {
  const Field field = randomField(7, {.grid = {4, 4, 4}, .refinement = 0.4, .maxDepth = 2, .maxDegree = 7});
  ASSERT_GT(statistics(field).leaves, 500u) << "more than one chunk";
  EXPECT_EQ(coefficientsOf(weaklyContinuous(field, {.weight = 0.1}, 1).field),
            coefficientsOf(weaklyContinuous(field, {.weight = 0.1}, 2).field));
}

TEST(WeakContinuity, doesNotDependOnTheUnit) {
  const Field field = randomField(9);
  FieldData scaled = field.data();
  constexpr double kScale = 1024;  // a power of two, which scales exactly
  scaled.domain = Box(kScale * scaled.domain.min(), kScale * scaled.domain.max());
  for (double& c : std::get<FieldArray<double>>(scaled.coefficients).values()) c *= kScale;
  const auto small = weaklyContinuous(field), large = weaklyContinuous(Field(std::move(scaled)));
  EXPECT_EQ(small.iterations, large.iterations);
  const std::vector<double> ofLarge = coefficientsOf(large.field), ofSmall = coefficientsOf(small.field);
  for (std::size_t n = 0; n < ofLarge.size(); ++n) EXPECT_DOUBLE_EQ(ofLarge[n], kScale * ofSmall[n]);
}

Field sphereField(const BuildOptions& options) {
  const DistanceFunction sphere = shapes::analytic("analytic:sphere");
  return build(sphere, domainAround(sphere.source().box), options);
}

double measuredRms(const Field& field) {
  const DistanceFunction sphere = shapes::analytic("analytic:sphere");
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Vector3> points(100000);
  for (Vector3& x : points) {
    const Vector3 share(unit(random), unit(random), unit(random));
    x = field.domain().min() + share.cwiseProduct(field.domain().sizes());
  }
  std::vector<double> exact(points.size()), values(points.size());
  sphere(points, exact);
  field.values(points, values);
  double squares = 0;
  for (std::size_t i = 0; i < points.size(); ++i) squares += (values[i] - exact[i]) * (values[i] - exact[i]);
  return std::sqrt(squares / double(points.size()));
}

TEST(WeakContinuity, addsItsChangeToTheErrorOfAProjection) {
  const Field field = sphereField({.targetError = 1e-5, .quadrature = 6, .coefficients = CoefficientType::float64});
  const WeaklyContinuous made = weaklyContinuous(field, {.weight = 0.2});
  const double before = measuredRms(field), after = measuredRms(made.field);
  EXPECT_GT(after, 1.02 * before);
  EXPECT_NEAR(after, std::hypot(before, made.change), 0.01 * after);
  const FieldMetadata& a = field.metadata();
  const FieldMetadata& b = made.field.metadata();
  const double grown = (b.totalError - a.totalError) * std::pow(a.referenceLength / 2, 5);
  const double unweighted = made.change * made.change * field.domain().sizes().prod();
  EXPECT_GT(grown, 0.2 * unweighted);
  EXPECT_LT(grown, unweighted);
}

TEST(WeakContinuity, keepsFloatsAsFloats) {
  const Field field = sphereField({.targetError = 1e-6, .coefficients = CoefficientType::float32});
  const Field made = weaklyContinuous(field).field;
  EXPECT_TRUE(made.singlePrecision());
  EXPECT_GT(made.metadata().roundingRms, field.metadata().roundingRms);
  EXPECT_LT(made.metadata().roundingRms, 2 * field.metadata().roundingRms);
  const Field exact = weaklyContinuous(inDouble(field)).field;
  FieldData rounded = exact.data();
  query::toFloat(rounded);
  EXPECT_EQ(rounded.coefficients, made.data().coefficients);
}

TEST(WeakContinuity, changesNothingWithTheGreatestWeight) {
  const WeaklyContinuous made = weaklyContinuous(randomField(5), {.weight = kMaxContinuityWeight});
  EXPECT_LE(made.residual, 1e-3);
  EXPECT_LT(made.change, 1e-6);
}

TEST(WeakContinuity, dropsTheMeasuredMaximum) {
  const Field made = weaklyContinuous(sphereField({.targetError = 0, .maxError = 0.1})).field;
  EXPECT_EQ(made.metadata().settings.maxError, 0);
  EXPECT_EQ(made.metadata().measuredError, 0);
}

TEST(WeakContinuity, dropsBounds) {
  FieldData data = randomField(2).data();
  data.bounds.resize(data.nodes.size());
  EXPECT_TRUE(weaklyContinuous(Field(std::move(data))).field.data().bounds.empty());
}

TEST(WeakContinuity, refusesBadSettings) {
  const Field field = randomField(1);
  for (const double weight :
       {0.0, -1.0, std::nan(""), 1.01 * kMaxContinuityWeight, std::numeric_limits<double>::infinity()})
    EXPECT_THROW(weaklyContinuous(field, {.weight = weight}), Error) << weight;
  EXPECT_NEAR(weaklyContinuous(field, {.weight = kMaxContinuityWeight}).change, 0, 1e-8);
  for (const double tolerance : {0.0, 1.0, -1.0, std::nan("")})
    EXPECT_THROW(weaklyContinuous(field, {.tolerance = tolerance}), Error) << tolerance;
  EXPECT_THROW(weaklyContinuous(field, {.maxIterations = 0}), Error);
  EXPECT_THROW(weaklyContinuous(weaklyContinuous(field).field), Error) << "the field is weakly continuous already";
  try {
    weaklyContinuous(field, {.weight = 1e-3, .maxIterations = 3});
    FAIL() << "three iterations do not suffice";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("3 iterations"), std::string::npos) << error.what();
  }
}

TEST(WeakContinuity, reportsAndStops) {
  const Field field = randomField(1);
  std::atomic<int> reports = 0;
  double last = 0;
  Progress progress;
  progress.report = [&](std::string_view, double fraction) {
    ++reports;
    EXPECT_GE(fraction, 0);
    EXPECT_LE(fraction, 1);
    last = fraction;
  };
  weaklyContinuous(field, {}, 0, progress);
  EXPECT_GT(reports, 3);
  EXPECT_GT(last, 0.5);
  progress.cancelled = [&] { return last > 0; };
  EXPECT_THROW(weaklyContinuous(field, {}, 0, progress), Cancelled);
  last = 0;
  EXPECT_THROW(weaklyContinuous(field, {}, 0, progress), Cancelled) << "during the iterations";
}

TEST(Build, enrichesEveryLeaf) {
  const BuildOptions usual{
      .targetError = 1e-4, .estimator = Estimator::embedded, .maxDegree = 3, .coefficients = CoefficientType::float64};
  BuildOptions enriching = usual;
  enriching.enrich = true;
  const Field before = sphereField(usual), after = sphereField(enriching);
  ASSERT_EQ(statistics(before).degreeLeaves.size(), 2u) << "of degree 2 and 3";
  ASSERT_EQ(before.data().nodes.size(), after.data().nodes.size());
  for (std::size_t n = 0; n < before.data().nodes.size(); ++n) {
    const std::uint64_t a = before.data().nodes[n], b = after.data().nodes[n];
    ASSERT_EQ(node::isLeaf(a), node::isLeaf(b));
    if (!node::isLeaf(a)) continue;
    EXPECT_EQ(node::degree(b), std::min(node::degree(a) + 1, 3));
  }
  EXPECT_TRUE(after.metadata().settings.enrich);
  EXPECT_FALSE(before.metadata().settings.enrich);
  EXPECT_GT(after.metadata().exactEvaluations, before.metadata().exactEvaluations);
  EXPECT_LT(measuredRms(after), measuredRms(before));
  EXPECT_LT(after.metadata().totalError, before.metadata().totalError);
}

TEST(Build, enrichedFieldsAreMoreExact) {
  BuildOptions options{.targetError = 1e-5};
  const double before = measuredRms(sphereField(options));
  options.enrich = true;
  EXPECT_LT(measuredRms(sphereField(options)), 0.6 * before);
}

TEST(Build, isWeaklyContinuousBeforeItRounds) {
  BuildOptions options{.targetError = 1e-5, .coefficients = CoefficientType::float64};
  const Field before = sphereField(options);
  options.continuityWeight = 0.1;
  const Field made = sphereField(options);
  const Field expected = weaklyContinuous(before, {.weight = 0.1}).field;
  EXPECT_EQ(coefficientsOf(made), coefficientsOf(expected));
  EXPECT_EQ(made.metadata().totalError, expected.metadata().totalError);
  options.coefficients = CoefficientType::float32;
  FieldData rounded = expected.data();
  query::toFloat(rounded);
  EXPECT_EQ(sphereField(options).data().coefficients, rounded.coefficients);
  options.continuityWeight = 0;
  EXPECT_THROW(sphereField(options), Error);
}

TEST(Build, appliesContinuityToEveryStage) {
  const DistanceFunction sphere = shapes::analytic("analytic:sphere");
  BuildOptions options{.targetError = 1e-5, .enrich = true, .continuityWeight = 0.5};
  const std::array<std::uint64_t, 3> steps{0, 4, 9};
  buildStages(sphere, domainAround(sphere.source().box), options, steps, [&, n = 0](const Field& stage) mutable {
    options.maxSteps = steps[n++];
    const Field whole = sphereField(options);
    EXPECT_EQ(stage.data().coefficients, whole.data().coefficients);
    EXPECT_EQ(stage.metadata().exactEvaluations, whole.metadata().exactEvaluations);
  });
}

}  // namespace weak_continuity_test
}  // namespace hpsdf
