#include "hpsdf/field.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <thread>

#include "field/query/evaluate.h"
#include "field/query/quantized.h"
#include "hpsdf/build.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace field_test {

double torus(const Vector3& x) { return std::hypot(std::hypot(x.x(), x.y()) - 0.7, x.z()) - 0.3; }

Box unitDomain() { return Box(Vector3::Constant(-1.1), Vector3::Constant(1.1)); }

const Field& torusField() {
  static const Field field = build(torus, unitDomain(), {.targetError = 1e-6});
  return field;
}

Vector3 randomPoint(std::mt19937_64& random, double half) {
  std::uniform_real_distribution<double> uniform(-half, half);
  const double x = uniform(random), y = uniform(random);
  return {x, y, uniform(random)};
}

/// Makes two base cells along x: the first has the value 100; the second is split, and its child n has the value n.
FieldData steps() {
  FieldData data;
  data.domain = Box(Vector3(0, 0, 0), Vector3(2, 1, 1));
  data.grid = {2, 1, 1};
  data.nodes = {node::leaf(0, 0), node::internal(2)};
  std::vector<double> constants = {100};
  for (std::uint32_t child = 0; child < 8; ++child) {
    data.nodes.push_back(node::leaf(0, child + 1));
    constants.push_back(child);
  }
  data.coefficients = constants;
  return data;
}

#ifndef NDEBUG
TEST(FieldDeathTest, movedFromFieldsAreNotQueried) {
  Field field(steps());
  const Field other = std::move(field);
  EXPECT_EQ(other.value({0.5, 0.5, 0.5}), 100);
  EXPECT_DEATH(field.value({0.5, 0.5, 0.5}), "the field was moved from");
  EXPECT_DEATH(field.cellAt({0.5, 0.5, 0.5}), "the field was moved from");
  EXPECT_DEATH(statistics(field), "the field was moved from");
}
#endif

TEST(Field, cellsAreHalfOpen) {
  const Field field(steps());
  EXPECT_EQ(field.value({0.9999, 0.5, 0.5}), 100);
  EXPECT_EQ(field.value({1.0, 0, 0}), 0);      // A common face belongs to the upper cell.
  EXPECT_EQ(field.value({1.5, 0.2, 0.2}), 1);  // lies in child x
  EXPECT_EQ(field.value({1.2, 0.5, 0.2}), 2);  // lies in child y
  EXPECT_EQ(field.value({1.2, 0.2, 0.5}), 4);  // lies in child z
  EXPECT_EQ(field.value({2, 1, 1}), 7);        // The domain includes its upper boundary.
  EXPECT_EQ(field.value({1.49, 0.49, 0.49}), 0);
}

TEST(Field, findsTheCellOfAPoint) {
  const Field field(steps());
  const Cell cell = field.cellAt({1.7, 0.1, 0.8});
  EXPECT_EQ(cell.id, 2u + 5u);
  EXPECT_EQ(cell.depth, 1);
  EXPECT_EQ(cell.degree, 0);
  EXPECT_TRUE(cell.box.min().isApprox(Vector3(1.5, 0, 0.5)));
  EXPECT_TRUE(cell.box.max().isApprox(Vector3(2, 0.5, 1)));
}

TEST(Field, everyLeafIsVisitedOnceAndFillsTheDomain) {
  const Field& field = torusField();
  std::set<std::uint32_t> seen;
  double volume = 0;
  field.forEachCell([&](const Cell& cell) {
    EXPECT_TRUE(seen.insert(cell.id).second);
    volume += cell.box.sizes().prod();
    const Cell found = field.cellAt(cell.box.center());
    EXPECT_EQ(found.id, cell.id);
    EXPECT_EQ(found.depth, cell.depth);
    EXPECT_EQ(found.degree, cell.degree);
    EXPECT_EQ(found.error, cell.error);
    EXPECT_TRUE(found.box.isApprox(cell.box, 1e-14));
  });
  EXPECT_NEAR(volume, std::pow(2.2, 3), 1e-9);
  EXPECT_EQ(seen.size(), statistics(field).leaves);
}

TEST(Field, statisticsAddUp) {
  const FieldStatistics s = statistics(torusField());
  double degrees = 0, depths = 0;
  std::size_t coefficients = 0;
  for (const auto& [level, share] : s.degreeVolume) degrees += share;
  for (const auto& [level, share] : s.depthVolume) depths += share;
  for (const auto& [degree, leaves] : s.degreeLeaves) coefficients += leaves * coefficientCount(degree);
  EXPECT_NEAR(degrees, 1, 1e-12);
  EXPECT_NEAR(depths, 1, 1e-12);
  EXPECT_EQ(coefficients, s.coefficients);
  EXPECT_EQ(s.nodes, 216 + (s.leaves - 216) / 7 * 8);
  const std::size_t arrays = s.nodes * 8 + coefficientBytes(torusField().data());
  EXPECT_GT(s.bytes, arrays);
  EXPECT_LE(s.bytes, arrays * 9 / 8) << "with the lookup grid";
}

TEST(Field, gradientMatchesCentralDifferencesWithinCells) {
  const Field field = build(torus, unitDomain(), {.targetError = 1e-8, .coefficients = CoefficientType::float64});
  std::mt19937_64 random(1);
  const double step = 1e-5;
  int compared = 0;
  for (int n = 0; n < 20000; ++n) {
    const Vector3 x = randomPoint(random, 1.09);
    const Cell cell = field.cellAt(x);
    if ((x - cell.box.min()).minCoeff() < 2 * step || (cell.box.max() - x).minCoeff() < 2 * step) continue;
    const auto result = field.valueAndGradient(x);
    EXPECT_EQ(result.value, field.value(x));
    Vector3 difference;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3 d = Vector3::Unit(axis) * step;
      difference[axis] = (field.value(x + d) - field.value(x - d)) / (2 * step);
    }
    ASSERT_LT((difference - result.gradient).norm(), 1e-6 * result.gradient.norm() + 1e-9) << x.transpose();
    ++compared;
  }
  EXPECT_GT(compared, 15000);
}

TEST(Field, continuesOutsideWithMatchingGradient) {
  const Field& field = torusField();
  std::mt19937_64 random(2);
  int outside = 0;
  for (int n = 0; n < 5000; ++n) {
    const Vector3 x = randomPoint(random, 3);
    if (field.domain().exteriorDistance(x) < 1e-3) continue;
    ++outside;
    const Vector3 q = x.cwiseMax(field.domain().min()).cwiseMin(field.domain().max());
    const auto result = field.valueAndGradient(x);
    EXPECT_EQ(result.value, field.value(x));
    EXPECT_NEAR(result.value, field.value(q) + (x - q).norm(), 1e-12);
    const Cell cell = field.cellAt(x);
    for (int axis = 0; axis < 3; ++axis) {
      const double step = 1e-6;
      const Vector3 d = Vector3::Unit(axis) * step;
      const bool free = q[axis] == x[axis];
      if (free && (x[axis] - cell.box.min()[axis] < 2 * step || cell.box.max()[axis] - x[axis] < 2 * step)) continue;
      EXPECT_NEAR(result.gradient[axis], (field.value(x + d) - field.value(x - d)) / (2 * step), 1e-6);
    }
  }
  EXPECT_GT(outside, 3000);
  // The field is continuous across the domain's boundary.
  for (int n = 0; n < 200; ++n) {
    Vector3 x = randomPoint(random, 1.0);
    x[n % 3] = 1.1;
    const Vector3 beyond = x + Vector3::Unit(n % 3) * 1e-9;
    EXPECT_NEAR(field.value(x), field.value(beyond), 1e-8);
  }
}

TEST(Field, evaluatesAtInfinityAndNan) {
  const Field& field = torusField();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(std::isnan(field.value({nan, 0, 0})));
  EXPECT_TRUE(std::isnan(field.valueAndGradient({0, nan, 0}).value));
  EXPECT_EQ(field.value({infinity, 0, 0}), infinity);
  EXPECT_EQ(field.value({0, -infinity, 0}), infinity);
  EXPECT_NEAR(field.valueAndGradient({1e200, 0, 0}).gradient.x(), 1, 1e-12);
  EXPECT_TRUE(field.valueAndGradient({std::nextafter(field.domain().max().x(), 9), 0, 0}).gradient.allFinite());
}

/// The lookup grid leads to the same leaf as the descent from the base cells: on faces and corners of cells, on and
/// beyond the domain's boundary, at depths above and below the lookup grid's, for base grids of any shape.
TEST(Field, queriesEndInTheCellThatHoldsThePoint) {
  const auto phi = [](const Vector3& x) { return std::hypot(std::hypot(x.x(), x.y()) - 0.7, x.z()) - 0.3; };
  const Box domain(Vector3(-1, -1.5, -1), Vector3(1, 1, 1.2));
  for (const BuildOptions& options : {BuildOptions{.targetError = 1e-6}, BuildOptions{.grid = {1, 2, 3}},
                                      BuildOptions{.targetError = 1e-3, .grid = {7, 1, 1}}}) {
    const Field field = build(phi, domain, options);
    std::mt19937_64 random(8);
    std::uniform_int_distribution<int> eighth(-4, 68);
    std::uniform_real_distribution<double> coordinate(-1.6, 1.6);
    for (int n = 0; n < 20000; ++n) {
      Vector3 x(coordinate(random), coordinate(random), coordinate(random));
      for (int axis = 0; axis < 3; ++axis)  // Half of the coordinates lie on faces of cells.
        if (random() % 2 == 0)
          x[axis] = domain.min()[axis] + domain.sizes()[axis] * (eighth(random) / (8.0 * field.grid()[axis]));
      const Cell cell = field.cellAt(x);
      const Vector3 inside = x.cwiseMax(domain.min()).cwiseMin(domain.max());
      const Vector3 local = 2 * (inside - cell.box.min()).cwiseQuotient(cell.box.sizes()) - Vector3::Ones();
      const std::uint64_t bits = field.data().nodes[cell.id];
      const double expected = withCoefficients(field.data(), bits, [&](const auto* c) {
        return query::evaluate(c, node::degree(bits), {local.x(), local.y(), local.z()});
      });
      ASSERT_NEAR(field.value(x), expected + (x - inside).norm(), 1e-12) << x.transpose();
    }
  }
}

TEST(Field, batchesAndThreadsGiveTheSameBits) {
  const Field& field = torusField();
  std::mt19937_64 random(4);
  std::vector<Vector3> points(5000);
  for (Vector3& x : points) x = randomPoint(random, 1.5);
  std::vector<double> values(points.size());
  std::vector<ValueAndGradient> both(points.size());
  field.values(points, values);
  std::thread other([&] { field.valuesAndGradients(points, both); });
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(values[i], field.value(points[i]));
  other.join();
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(both[i].value, values[i]);
    EXPECT_EQ(both[i].gradient, field.valueAndGradient(points[i]).gradient);
  }
}

/// Makes random cells of depths 0 to 5 and degrees 0 to 6. The coefficients of the last leaf end the array, so that
/// AddressSanitizer reports reads beyond them.
template <typename T>
Field mixedField() {
  std::mt19937_64 random(5);
  FieldData data;
  data.domain = Box(Vector3(-1, -0.3, 0), Vector3(1, 0.9, 0.7));
  data.grid = {3, 2, 1};
  std::vector<int> depths(6, 0);
  std::vector<T> coefficients;
  std::uniform_real_distribution<T> coefficient(-1, 1);
  data.nodes.resize(6);
  for (std::size_t n = 0; n < data.nodes.size(); ++n) {
    if (depths[n] < 5 && random() % 8 < 3) {
      data.nodes[n] = node::internal(static_cast<std::uint32_t>(data.nodes.size()));
      data.nodes.resize(data.nodes.size() + 8);
      depths.resize(data.nodes.size(), depths[n] + 1);
    } else {
      const int degree = static_cast<int>(random() % 7);
      data.nodes[n] = node::leaf(degree, static_cast<std::uint32_t>(coefficients.size()));
      for (int k = 0; k < coefficientCount(degree); ++k) coefficients.push_back(coefficient(random));
    }
  }
  data.coefficients = coefficients;
  return Field(std::move(data));
}

Field mixedQuantizedField() {
  FieldData data = mixedField<double>().data();
  query::Quantized quantized = query::quantized(data, std::vector<double>(data.nodes.size(), 1e-3)).value();
  query::take(std::move(quantized), data);
  return Field(std::move(data));
}

/// Returns points inside, on faces and edges of cells, on the domain's boundary and outside; some are infinite or NaN.
std::vector<Vector3> trickyPoints(const Field& field, std::size_t count) {
  const double infinity = std::numeric_limits<double>::infinity();
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> inside(0, 1);
  std::uniform_int_distribution<int> fraction(0, 32);
  std::vector<Vector3> points(count);
  for (Vector3& x : points)
    for (int axis = 0; axis < 3; ++axis) {
      const double lower = field.domain().min()[axis], upper = field.domain().max()[axis];
      const std::array special = {lower,     std::nextafter(lower, -9),
                                  -0.0,      lower - inside(random),
                                  upper,     std::nextafter(upper, 9),
                                  infinity,  upper + inside(random),
                                  1e-310,    1e300,
                                  -infinity, std::nan("")};
      switch (random() % 64) {
        case 0:
          x[axis] = special[random() % special.size()];
          break;
        case 1:
        case 2:
        case 3:
          x[axis] = lower + (upper - lower) * (fraction(random) / (32.0 * field.grid()[axis]));
          break;
        default:
          x[axis] = lower + (upper - lower) * inside(random);
      }
    }
  return points;
}

bool sameBits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) || (std::isnan(a) && std::isnan(b));
}

void expectBatchesEqualSingleQueries(const Field& field, std::span<const Vector3> points) {
  std::vector<double> values(points.size());
  std::vector<ValueAndGradient> both(points.size());
  field.values(points, values);
  field.valuesAndGradients(points, both);
  std::vector<double> separateValues(points.size());
  std::vector<Vector3> gradients(points.size());
  field.valuesAndGradients(points, separateValues, gradients);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ValueAndGradient single = field.valueAndGradient(points[i]);
    ASSERT_TRUE(sameBits(separateValues[i], single.value)) << points[i].transpose();
    ASSERT_TRUE(sameBits(values[i], field.value(points[i]))) << points[i].transpose();
    ASSERT_TRUE(sameBits(both[i].value, single.value)) << points[i].transpose();
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_TRUE(sameBits(both[i].gradient[axis], single.gradient[axis])) << points[i].transpose();
      ASSERT_TRUE(sameBits(gradients[i][axis], single.gradient[axis])) << points[i].transpose();
    }
  }
}

/// Tests every instruction set of the processor, down to scalar code.
TEST(Field, batchesGiveTheSameBitsOnEveryInstructionSet) {
  for (const Field& field : {mixedField<double>(), mixedField<float>(), mixedQuantizedField()}) {
    const FieldStatistics found = statistics(field);
    ASSERT_EQ(found.degreeLeaves.size(), 7u);
    ASSERT_EQ(found.depthLeaves.size(), 6u);
    const std::vector<Vector3> points = trickyPoints(field, 20011);
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      SCOPED_TRACE(hwy::TargetName(target));
      hwy::SetSupportedTargetsForTest(target);
      hwy::GetChosenTarget().Update(target);
      expectBatchesEqualSingleQueries(field, points);
      for (std::size_t count = 0; count < 300; count += count < 12 ? 1 : 29)
        expectBatchesEqualSingleQueries(field, std::span(points).subspan(count, count));
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST(Field, refusesInvalidArrays) {
  const auto refuses = [](auto&& spoil) {
    FieldData data = steps();
    spoil(data);
    EXPECT_THROW(Field{std::move(data)}, Error);
  };
  EXPECT_NO_THROW(Field{steps()});
  refuses([](FieldData& d) { d.domain.setEmpty(); });
  refuses([](FieldData& d) { d.domain.max().x() = std::numeric_limits<double>::infinity(); });
  refuses([](FieldData& d) {
    d.domain = Box(Vector3::Constant(-1e308), Vector3::Constant(1e308));
  });  // The domain's size overflows.
  refuses([](FieldData& d) { d.grid = {0, 1, 1}; });
  refuses([](FieldData& d) { d.nodes.back() |= std::uint64_t{30} << 40; });
  refuses([](FieldData& d) { d.nodes.front() |= std::uint64_t{1} << (node::isLeaf(d.nodes.front()) ? 62 : 32); });
  refuses([](FieldData& d) { d.grid = {0xffffffff, 0xffffffff, 0xffffffff}; });
  refuses([](FieldData& d) { d.nodes.pop_back(); });
  refuses([](FieldData& d) { d.nodes[0] = node::internal(2); });  // Two nodes share their children.
  refuses([](FieldData& d) { d.nodes[1] = node::internal(1); });  // The node is its own child.
  refuses([](FieldData& d) { d.nodes[1] = node::internal(3); });  // The first child does not start a group.
  refuses([](FieldData& d) { d.nodes[1] = node::leaf(0, 0); });   // The group of children has no parent.
  refuses([](FieldData& d) { d.nodes[2] = node::leaf(0, 9); });   // The coefficient lies beyond the end.
  refuses([](FieldData& d) { d.nodes[2] = node::leaf(31, 0); });
  refuses([](FieldData& d) { std::get<0>(d.coefficients).values()[3] = std::nan(""); });
}

}  // namespace field_test
}  // namespace hpsdf
