// Quantized coefficients: what they change, what queries of them give, and which arrays are refused.
#include "field/query/quantized.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <utility>
#include <variant>
#include <vector>

#include "basis/orthonormal.h"
#include "basis/projection.h"
#include "field/precision/round_coefficients.h"
#include "field/query/float_coefficients.h"
#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/safe_distance.h"
#include "hpsdf/shapes.h"
#include "support/one_leaf_field.h"
#include "support/random_field.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace quantized_test {

double torus(const Vector3& x) { return std::hypot(std::hypot(x.x(), x.y()) - 0.7, x.z()) - 0.3; }
Box cube() { return Box(Vector3::Constant(-1.1), Vector3::Constant(1.1)); }

std::optional<query::Quantized> quantizedBy(const Field& field, double step) {
  return query::quantized(field.data(), std::vector<double>(field.data().nodes.size(), step));
}

FieldData quantizedData(const Field& field, double step) {
  query::Quantized quantized = quantizedBy(field, step).value();
  FieldData data = field.data();
  query::take(std::move(quantized), data);
  return data;
}

query::Rounding changeBy(const Field& field, double step) {
  const query::Quantized quantized = quantizedBy(field, step).value();
  return query::quantizedRounding(field.data(), quantized.nodes, quantized.coefficients);
}

Field torusOf(CoefficientType type, BuildOptions options = {.targetError = 1e-6}) {
  options.coefficients = type;
  return build(torus, cube(), options);
}

std::vector<Vector3> randomPoints(const Box& box, std::size_t count) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Vector3> points(count);
  for (Vector3& x : points) x = box.min() + box.sizes().cwiseProduct(Vector3(unit(random), unit(random), unit(random)));
  return points;
}

template <typename F>
double rms(const std::vector<Vector3>& points, const F& f) {
  double sum = 0;
  for (const Vector3& x : points) sum += f(x) * f(x);
  return std::sqrt(sum / double(points.size()));
}

/// Every coefficient is rounded to the nearest multiple of the step in the orthonormal basis, for all degrees.
TEST(Quantized, roundsToTheNearestMultiples) {
  constexpr double kStep = 0.01;
  for (int degree = 0; degree <= kMaxDegree; ++degree) {
    const Field field = oneLeafField(unsigned(degree), degree);
    const auto& before = std::get<FieldArray<double>>(field.data().coefficients).all();
    const FieldData data = quantizedData(field, kStep);
    std::vector<double> after(before.size());
    decodeLeaf(std::get<QuantizedCoefficients>(data.coefficients), data.nodes[0], after.data());
    int index = 0;
    for (int i = 0; i <= degree; ++i)
      for (int j = 0; j <= degree - i; ++j)
        for (int k = 0; k <= degree - i - j; ++k, ++index) {
          const double unit = kStep * std::sqrt((2 * i + 1.0) * (2 * j + 1.0) * (2 * k + 1.0));
          ASSERT_NEAR(after[index], unit * std::round(before[index] / unit), 1e-12) << degree << ": " << index;
        }
  }
}

TEST(Quantized, queriesEvaluateTheRoundedPolynomials) {
  const Field field = randomField(3, {.minDegree = 0, .maxDegree = 9});
  FieldData data = quantizedData(field, 1e-3);
  const Field quantized(data);
  query::toDouble(data);
  const Field decoded(data);
  for (const Vector3& x : randomPoints(Box(Vector3::Constant(-1.2), Vector3::Constant(1.2)), 20000)) {
    const ValueAndGradient one = quantized.valueAndGradient(x), other = decoded.valueAndGradient(x);
    ASSERT_EQ(one.value, quantized.value(x));
    ASSERT_NEAR(one.value, other.value, 1e-13);
    ASSERT_LT((one.gradient - other.gradient).norm(), 1e-11);
    ASSERT_DOUBLE_EQ(quantized.cellAt(x).error, decoded.cellAt(x).error);
  }
  EXPECT_EQ(statistics(quantized).coefficients, statistics(decoded).coefficients);
}

/// Expects that batched queries of a field give the bits of single ones, and that these are those of the field with
/// decoded coefficients, up to rounding: 1e-13 for values, `ofGradient` for gradients.
void expectEqualAnswers(const Field& quantized, const Field& decoded, std::size_t count, double ofGradient) {
  const std::vector<Vector3> points = randomPoints(quantized.domain(), count);
  std::vector<ValueAndGradient> batch(points.size());
  quantized.valuesAndGradients(points, batch);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ValueAndGradient one = quantized.valueAndGradient(points[i]), other = decoded.valueAndGradient(points[i]);
    ASSERT_EQ(batch[i].value, one.value);
    ASSERT_EQ(batch[i].gradient, one.gradient);
    ASSERT_NEAR(one.value, other.value, 1e-13);
    ASSERT_LT((one.gradient - other.gradient).norm(), ofGradient);
  }
}

/// Integers from a few bits up to the most that SIMD decodes, in leaves of every degree with SIMD code and beyond.
TEST(Quantized, batchesDecodeIntegersOfAnyLength) {
  const Field field = randomField(7, {.minDegree = 0, .maxDegree = 6});
  for (double step = 0.25; step > 1e-6; step /= 4) {
    const Field quantized(quantizedData(field, step));
    FieldData data = quantized.data();
    query::toDouble(data);
    SCOPED_TRACE(step);
    expectEqualAnswers(quantized, Field(std::move(data)), 3000, 1e-11);
  }
}

TEST(Quantized, blendedFieldsToo) {
  const Field quantized = blended(Field(quantizedData(randomField(4), 1e-3)), 0.1);
  FieldData data = quantized.data();
  query::toDouble(data);
  expectEqualAnswers(quantized, Field(std::move(data)), 5000, 1e-11);
}

/// Returns the step that changes the field by `rms`.
double stepFor(const Field& field, double rms) {
  detail::QuantizedPart part;
  field.forEachCell([&](const Cell& cell) { part.add(cell.box.volume(), coefficientCount(cell.degree)); });
  return part.stepForChange(rms);
}

TEST(Quantized, theChangeIsAsForetoldAndAsStated) {
  const Field field = randomField(5, {.maxDepth = 2, .minDegree = 2, .maxDegree = 4});
  for (const double asked : {1e-3, 3e-4}) {
    const double step = stepFor(field, asked);
    const FieldData data = quantizedData(field, step);
    const query::Rounding stated = changeBy(field, step);
    EXPECT_NEAR(stated.rms / asked, 1, 0.1);
    const Field quantized(data);
    const std::vector<Vector3> points = randomPoints(field.domain(), 40000);
    const auto change = [&](const Vector3& x) { return quantized.value(x) - field.value(x); };
    EXPECT_NEAR(rms(points, change) / stated.rms, 1, 0.02);
    for (const Vector3& x : points) ASSERT_LE(std::abs(change(x)), stated.max);
  }
}

/// Each leaf keeps to the step that is asked for it, by a power of two, and is wide where its integers are long.
TEST(Quantized, leavesHaveStepsOfTheirOwn) {
  const Field field = randomField(5, {.maxDepth = 2, .minDegree = 0, .maxDegree = 6});
  const FieldData& data = field.data();
  std::mt19937_64 random(3);
  std::vector<double> steps(data.nodes.size());
  for (double& step : steps) step = std::exp2(-std::uniform_real_distribution<double>(6, 28)(random));
  const query::Quantized quantized = query::quantized(data, steps).value();
  std::array<int, 2> count{};
  for (std::size_t n = 0; n < data.nodes.size(); ++n) {
    if (!node::isLeaf(data.nodes[n])) continue;
    const double step = quantized.coefficients.stepOf(quantized.nodes[n]);
    ASSERT_LE(step, steps[n]);
    ASSERT_GT(2 * step, steps[n]);
    const int degree = node::degree(data.nodes[n]);
    std::vector<double> decoded(coefficientCount(degree));
    decodeLeaf(quantized.coefficients, quantized.nodes[n], decoded.data());
    withCoefficients(data, data.nodes[n], [&](const auto* c) {
      basis::forEachCoefficient(degree, [&](int i, int j, int k, int index) {
        ASSERT_NEAR(decoded[index], c[index], step / 2 * basis::norm(i, j, k) * (1 + 1e-9));
      });
    });
    ++count[node::isWide(quantized.nodes[n]) ? 1 : 0];
  }
  EXPECT_GT(std::ranges::min(count), 20);

  // Single and batched queries, with and without blending, agree with the decoded field.
  FieldData own = data;
  own.nodes = quantized.nodes;
  own.coefficients = quantized.coefficients;
  FieldData plain = own;
  query::toDouble(plain);
  for (const double blend : {0.0, 0.1}) {
    own.blend = plain.blend = blend;
    expectEqualAnswers(Field(own), Field(plain), 3000, 1e-10);
  }
  EXPECT_EQ(query::stepsOf(quantized.coefficients, quantized.nodes).size(), data.nodes.size());
}

TEST(Quantized, aStepThatNeedsTooManyBitsIsRefused) {
  const Field field = randomField(6);
  EXPECT_TRUE(quantizedBy(field, 1e-8));
  EXPECT_FALSE(quantizedBy(field, 1e-11));
  EXPECT_FALSE(quantizedBy(field, 0));
  EXPECT_FALSE(quantizedBy(field, std::numeric_limits<double>::infinity()));
}

TEST(Quantized, constructionsKeepTheirErrorInAThirdOfTheBytes) {
  const Field exact = torusOf(CoefficientType::float64), single = torusOf(CoefficientType::float32);
  const Field quantized = torusOf(CoefficientType::quantized);
  EXPECT_EQ(precisionName(quantized), "quantized");
  EXPECT_LT(double(quantized.bytesOfParts().coefficients), 0.3 * double(single.bytesOfParts().coefficients));
  EXPECT_LT(double(quantized.bytes()), 0.4 * double(single.bytes()));
  const std::vector<Vector3> points = randomPoints(cube(), 40000);
  const auto errorOf = [&](const Field& field) {
    return rms(points, [&](const Vector3& x) { return field.value(x) - torus(x); });
  };
  EXPECT_LT(errorOf(quantized), 1.01 * errorOf(exact));
  const double change = rms(points, [&](const Vector3& x) { return quantized.value(x) - exact.value(x); });
  EXPECT_NEAR(change / quantized.metadata().roundingRms, 1, 0.05);
}

TEST(Quantized, aMaximumErrorBoundsTheChange) {
  constexpr double kMost = 2e-3;
  const BuildOptions options{.targetError = 1e-5, .maxError = kMost, .maxDegree = 3};
  const Field exact = torusOf(CoefficientType::float64, options),
              quantized = torusOf(CoefficientType::quantized, options);
  ASSERT_EQ(precisionName(quantized), "quantized");
  for (const Vector3& x : randomPoints(cube(), 40000))
    ASSERT_LE(std::abs(quantized.value(x) - exact.value(x)), 0.01 * kMost);
}

/// Without an error to compare it with, there is no step to choose.
TEST(Quantized, fieldsWithoutAnErrorKeepFloats) {
  const auto linear = [](const Vector3& x) { return x.x(); };
  const Field field = build(linear, cube(), {.targetError = 1e-6, .coefficients = CoefficientType::quantized});
  EXPECT_EQ(precisionName(field), "float");
}

/// Beside exact leaves, polynomials are more exact than the field is on average, and stay so.
TEST(Quantized, fieldsWithExactLeavesKeepTheirErrorAtTheSurface) {
  const TriangleMesh mesh = loadMesh("builtin:gear,teeth=5,segments=2");
  const ExactDistance distance(mesh);
  BuildOptions options{.targetError = 1e-6, .grid = {3, 3, 3}, .strategy = Strategy::hpx};
  options.coefficients = CoefficientType::float32;
  const Field single = build(distance, domainAround(mesh), options);
  options.coefficients = CoefficientType::quantized;
  const Field field = build(distance, domainAround(mesh), options);
  ASSERT_EQ(precisionName(field), "quantized");
  EXPECT_LT(double(field.bytesOfParts().coefficients), 0.6 * double(single.bytesOfParts().coefficients));
  const double length = field.metadata().referenceLength;
  int near = 0;
  for (const Vector3& x : randomPoints(field.domain(), 20000)) {
    if (std::abs(distance(x)) > options.exactWithin * length) continue;
    ++near;
    ASSERT_NEAR(field.value(x), single.value(x), 2e-7 * length);
  }
  EXPECT_GT(near, 100);
}

/// Returns true if the errors of a field at random points are within its tolerance.
bool isWithinTolerance(const Field& field, const ExactDistance& distance) {
  const AllowedError allowed = allowedError(field.metadata().settings, field.metadata().referenceLength);
  return std::ranges::all_of(randomPoints(field.domain(), 20000), [&](const Vector3& x) {
    return std::abs(field.value(x) - distance(x)) <= allowed.at(distance(x));
  });
}

TEST(Quantized, aToleranceIsKept) {
  const TriangleMesh mesh = shapes::mesh("torus,segments=12,sides=6");
  const ExactDistance distance(mesh);
  const auto made = [&](BuildOptions options) { return build(distance, domainAround(mesh), options); };
  for (const double tolerance : {4e-2, 2e-2}) {
    const Field field = made({.tolerance = tolerance});
    ASSERT_EQ(precisionName(field), "quantized");
    EXPECT_LE(field.metadata().measuredError, tolerance);
    EXPECT_TRUE(isWithinTolerance(field, distance));
    EXPECT_LT(field.bytes(), made({.tolerance = tolerance, .coefficients = CoefficientType::float32}).bytes());
  }
  const Field certified = made({.tolerance = 4e-2, .certified = true});
  ASSERT_EQ(precisionName(certified), "quantized");
  EXPECT_TRUE(isWithinTolerance(certified, distance));
}

TEST(Quantized, aLimitOfBytesIsKept) {
  const std::vector<Vector3> points = randomPoints(cube(), 40000);
  const auto errorOf = [&](const Field& field) {
    return rms(points, [&](const Vector3& x) { return field.value(x) - torus(x); });
  };
  for (const Criterion criterion : {Criterion::paper, Criterion::optimal})
    for (const double maxError : {0.0, 2e-3}) {
      if (criterion == Criterion::optimal && maxError > 0) continue;
      const BuildOptions options{.targetError = 0, .maxError = maxError, .maxBytes = 40'000, .criterion = criterion};
      const Field field = torusOf(CoefficientType::automatic, options);
      const Field single = torusOf(CoefficientType::float32, options);
      ASSERT_EQ(precisionName(field), "quantized");
      EXPECT_LE(field.bytes(), 40'000u);
      EXPECT_GT(field.bytes(), 32'000u);
      EXPECT_LT(errorOf(field), 0.6 * errorOf(single));
    }
}

/// Vertices whose rounding is not negligible stay double only if bytes are not limited.
TEST(Quantized, verticesKeepToALimitOfBytes) {
  const ExactDistance distance(shapes::mesh("torus,segments=96,sides=48"));
  BuildOptions options{.maxError = 1e-6, .maxBytes = 333'491, .strategy = Strategy::hpx, .exactWithin = 0};
  options.exactTriangles = 255;
  EXPECT_LE(build(distance, domainAround(distance.source().box), options).bytes(), 333'491u);
}

TEST(Quantized, boundsHoldAfterRounding) {
  const Field field =
      torusOf(CoefficientType::quantized, {.targetError = 1e-4, .grid = {3, 3, 3}, .maxDepth = 3, .bounds = true});
  ASSERT_EQ(precisionName(field), "quantized");
  for (const Vector3& x : randomPoints(cube(), 40000)) {
    const CellBound bound = field.data().bounds[field.cellAt(x).id];
    const ValueAndGradient found = field.valueAndGradient(x);
    ASSERT_LE(std::abs(found.value - torus(x)), double(bound.error));
    ASSERT_LE(found.gradient.norm(), double(bound.slope) * (1 + 1e-12));
  }
}

TEST(Quantized, weaklyContinuousFieldsHaveSmallerSteps) {
  const Field field = torusOf(CoefficientType::quantized, {.targetError = 1e-4, .grid = {3, 3, 3}});
  const Field smooth = weaklyContinuous(field, {}).field;
  ASSERT_EQ(precisionName(smooth), "quantized");
  const auto stepOf = [](const Field& f) { return std::get<QuantizedCoefficients>(f.data().coefficients).step; };
  EXPECT_DOUBLE_EQ(stepOf(smooth), 0.2 * stepOf(field));
  EXPECT_GT(smooth.metadata().roundingRms, field.metadata().roundingRms);
}

TEST(Quantized, theSameBytesForAnyNumberOfThreads) {
  const Field one = torusOf(CoefficientType::quantized, {.targetError = 1e-6, .threads = 1});
  const Field two = torusOf(CoefficientType::quantized, {.targetError = 1e-6, .threads = 2});
  EXPECT_EQ(one.data().nodes, two.data().nodes);
  EXPECT_EQ(one.data().coefficients, two.data().coefficients);
}

TEST(Quantized, refusesInvalidArrays) {
  const FieldData valid = quantizedData(randomField(7), 1e-3);
  ASSERT_NO_THROW(Field{valid});
  const auto refuses = [&](const auto& spoil) {
    FieldData data = valid;
    spoil(std::get<QuantizedCoefficients>(data.coefficients));
    EXPECT_THROW(Field{std::move(data)}, Error);
  };
  refuses([](QuantizedCoefficients& c) { c.step = 0; });
  refuses([](QuantizedCoefficients& c) { c.step = std::nan(""); });
  refuses([](QuantizedCoefficients& c) { c.step = 1e300; });
  refuses([](QuantizedCoefficients& c) { c.meanBits = 0; });
  refuses([](QuantizedCoefficients& c) { c.meanBits = 33; });
  refuses([](QuantizedCoefficients& c) { c.bytes.values().clear(); });
  refuses([](QuantizedCoefficients& c) { c.bytes.values().pop_back(); });  // The last leaf reaches into the padding.
  refuses([](QuantizedCoefficients& c) { std::ranges::fill(c.bytes.values(), 0xff); });  // Widths are 31.
}

}  // namespace quantized_test
}  // namespace hpsdf
