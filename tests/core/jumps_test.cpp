#include "hpsdf/jumps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <numeric>
#include <set>

#include "basis/legendre.h"
#include "field/query/evaluate.h"
#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/face_steps.h"
#include "hpsdf/error.h"
#include "support/random_field.h"

namespace hpsdf {
namespace jumps_test {

/// Makes unit base cells along x with these coefficients; `children` adds a base cell that is split once.
FieldData row(const std::vector<std::vector<double>>& cells, const std::vector<std::vector<double>>& children = {}) {
  FieldData data;
  data.grid = {static_cast<std::uint32_t>(cells.size() + !children.empty()), 1, 1};
  data.domain = Box(Vector3(0, 0, 0), Vector3(data.grid[0], 1, 1));
  std::vector<double> coefficients;
  const auto add = [&](const std::vector<double>& polynomial) {
    int degree = 0;
    while (coefficientCount(degree) < static_cast<int>(polynomial.size())) ++degree;
    data.nodes.push_back(node::leaf(degree, static_cast<std::uint32_t>(coefficients.size())));
    coefficients.insert(coefficients.end(), polynomial.begin(), polynomial.end());
  };
  for (const auto& cell : cells) add(cell);
  if (!children.empty()) {
    data.nodes.push_back(node::internal(data.grid[0]));
    for (const auto& child : children) add(child);
  }
  data.coefficients = coefficients;
  return data;
}

// Coefficients of degree 1 multiply 1, w, v and u, where (u, v, w) = 2·(x − corner) − 1 in a unit cell.

TEST(Jumps, measuresKnownJumpsBetweenEqualCells) {
  // The leaves have the polynomials 1 + w and 3 + 2v, so that the jump is 2 + 2v − w.
  const Jumps jumps = findJumps(Field(row({{1, 1, 0, 0}, {3, 0, 2, 0}})));
  ASSERT_EQ(jumps.interfaces.size(), 1u);
  const Interface& face = jumps.interfaces[0];
  EXPECT_EQ(face.axis, 0);
  EXPECT_EQ(face.cells, (std::array<std::uint32_t, 2>{0, 1}));
  EXPECT_FALSE(face.hanging());
  EXPECT_DOUBLE_EQ(face.area, 1);
  EXPECT_NEAR(face.value.rms, std::sqrt(4 + 4.0 / 3 + 1.0 / 3), 1e-14);
  EXPECT_NEAR(face.value.max, 5, 1e-14);
  EXPECT_TRUE(face.worst.isApprox(Vector3(1, 1, 0), 1e-14)) << face.worst.transpose();
  EXPECT_TRUE(face.center.isApprox(Vector3(1, 0.5, 0.5), 1e-14));
  // In world coordinates, the gradients of the two polynomials are (0, 0, 2) and (0, 4, 0).
  EXPECT_NEAR(face.gradient.rms, std::sqrt(20.0), 1e-14);
  EXPECT_NEAR(face.gradient.max, std::sqrt(20.0), 1e-14);
  EXPECT_EQ(jumps.hanging, 0u);
  EXPECT_DOUBLE_EQ(jumps.area, 1);
  EXPECT_NEAR(jumps.value.rms, face.value.rms, 1e-15);
}

TEST(Jumps, measuresCurvedPolynomialsOfUnequalDegree) {
  // The leaves are L2(v) and 0: ∫ L2²/2 = 1/5, the jump is greatest at v = ±1, and its gradient is (0, 2·3v, 0).
  std::vector<double> quadratic(10, 0.0);
  quadratic[5] = 1;  // coefficients are ordered by degrees in u, v, w: 000 001 002 010 011 020 …
  const Jumps jumps = findJumps(Field(row({quadratic, {0}})));
  ASSERT_EQ(jumps.interfaces.size(), 1u);
  EXPECT_EQ(jumps.interfaces[0].degrees, (std::array<std::uint8_t, 2>{2, 0}));
  EXPECT_NEAR(jumps.value.rms, std::sqrt(1.0 / 5), 1e-14);
  EXPECT_NEAR(jumps.value.max, 1, 1e-14);
  EXPECT_NEAR(jumps.gradient.rms, 6 / std::sqrt(3.0), 1e-13);
  EXPECT_NEAR(jumps.gradient.max, 6, 1e-13);
}

TEST(Jumps, measuresKnownJumpsOnHangingFaces) {
  // The left leaf is 10 + u + v, i.e. 11 + v on the face; the right leaves have the constant values 0 to 7.
  std::vector<std::vector<double>> children;
  for (double child = 0; child < 8; ++child) children.push_back({child});
  const Jumps jumps = findJumps(Field(row({{10, 0, 1, 1}}, children)));
  ASSERT_EQ(jumps.interfaces.size(), 16u) << "four hanging faces and twelve inner ones";
  EXPECT_EQ(jumps.hanging, 4u);
  EXPECT_DOUBLE_EQ(jumps.area, 1 + 3);
  int hanging = 0, inner = 0;
  for (const Interface& face : jumps.interfaces) {
    if (face.hanging()) {
      ++hanging;
      EXPECT_EQ(face.axis, 0);
      EXPECT_EQ(face.cells[0], 0u);
      EXPECT_EQ(face.depths, (std::array<std::uint8_t, 2>{0, 1}));
      const int child = static_cast<int>(face.cells[1]) - 2;
      const double middle = 11 + (child & 2 ? 0.5 : -0.5) - child;
      EXPECT_NEAR(face.value.rms, std::sqrt(middle * middle + 0.25 / 3), 1e-13);
      EXPECT_NEAR(face.value.max, middle + 0.5, 1e-13);
      EXPECT_NEAR(face.worst.y(), child & 2 ? 1 : 0.5, 1e-14);
      EXPECT_NEAR(face.gradient.rms, std::sqrt(8.0), 1e-13);
      EXPECT_DOUBLE_EQ(face.area, 0.25);
    } else {
      ++inner;
      EXPECT_EQ(face.value.max, 1 << face.axis);
      EXPECT_NEAR(face.value.rms, 1 << face.axis, 1e-14);
      EXPECT_EQ(face.gradient.max, 0);
    }
  }
  EXPECT_EQ(hanging, 4);
  EXPECT_EQ(inner, 12);
}

/// A reference for the jump across an interface: all pairs of leaves that share a rectangle are integrated by a rule of
/// much higher order, slowly and simply.
struct ReferenceJump {
  Jump value, gradient;
};
std::map<std::array<std::uint32_t, 2>, ReferenceJump> referenceJumps(const Field& field) {
  std::vector<Cell> cells;
  field.forEachCell([&](const Cell& cell) { cells.push_back(cell); });
  const basis::QuadratureRule rule = basis::gaussLegendre(24);
  const auto at = [&](const Cell& cell, const Vector3& x) {
    const Vector3 half = cell.box.sizes() / 2, u = (x - cell.box.center()).cwiseQuotient(half);
    return withCoefficients(field.data(), field.data().nodes[cell.id], [&](const auto* c) {
      ValueAndGradient result = query::evaluateWithGradient(c, cell.degree, {u.x(), u.y(), u.z()});
      result.gradient = result.gradient.cwiseQuotient(half);
      return result;
    });
  };
  std::map<std::array<std::uint32_t, 2>, ReferenceJump> found;
  for (const Cell& below : cells)
    for (const Cell& above : cells)
      for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(below.box.max()[axis] - above.box.min()[axis]) > 1e-9) continue;
        Vector3 lo = below.box.min().cwiseMax(above.box.min()), hi = below.box.max().cwiseMin(above.box.max());
        lo[axis] = hi[axis] = above.box.min()[axis];
        const int b = (axis + 1) % 3, c = (axis + 2) % 3;
        if (hi[b] - lo[b] < 1e-9 || hi[c] - lo[c] < 1e-9) continue;
        ReferenceJump& jump = found[{below.id, above.id}];
        for (std::size_t i = 0; i < rule.points.size(); ++i)
          for (std::size_t j = 0; j < rule.points.size(); ++j) {
            Vector3 x = lo;
            x[b] += (hi[b] - lo[b]) * (rule.points[i] + 1) / 2;
            x[c] += (hi[c] - lo[c]) * (rule.points[j] + 1) / 2;
            const ValueAndGradient lower = at(below, x), upper = at(above, x);
            const double weight = rule.weights[i] * rule.weights[j] / 4;
            const double value = std::abs(lower.value - upper.value),
                         gradient = (lower.gradient - upper.gradient).norm();
            jump.value.rms += weight * value * value;
            jump.gradient.rms += weight * gradient * gradient;
            jump.value.max = std::max(jump.value.max, value);
            jump.gradient.max = std::max(jump.gradient.max, gradient);
          }
        jump.value.rms = std::sqrt(jump.value.rms);
        jump.gradient.rms = std::sqrt(jump.gradient.rms);
      }
  return found;
}

TEST(Jumps, measuresEveryInterfaceOfARandomFieldOnce) {
  for (const bool single : {false, true}) {
    RandomFieldOptions options;
    options.domain = Box(Vector3(-1, 2, -3), Vector3(2, 4, 1));
    options.grid = {3, 2, 1};
    options.maxDepth = 3;
    options.refinement = 0.3;
    options.minDegree = 0;
    options.single = single;
    const Field field = randomField(7, options);
    const Jumps jumps = findJumps(field);
    const auto reference = referenceJumps(field);
    ASSERT_GT(jumps.hanging, 20u);
    ASSERT_EQ(jumps.interfaces.size(), reference.size());
    for (const Interface& face : jumps.interfaces) {
      ASSERT_TRUE(reference.contains(face.cells));
      const ReferenceJump& expected = reference.at(face.cells);
      EXPECT_NEAR(face.value.rms, expected.value.rms, 1e-12);
      EXPECT_NEAR(face.gradient.rms, expected.gradient.rms, 1e-11);
      EXPECT_GE(face.value.max, 0.9 * expected.value.max) << "sampled as densely as the degree asks";
      EXPECT_GE(face.gradient.max, 0.9 * expected.gradient.max);
      EXPECT_GE(face.value.max, face.value.rms);
    }
  }
}

TEST(Jumps, areZeroInASmoothField) {
  // All cells represent the same function 1 + x + 2y + 3z.
  std::vector<std::vector<double>> cells, children;
  for (int n = 0; n < 2; ++n) cells.push_back({1 + n + 0.5 + 1 + 1.5, 1.5, 1, 0.5});
  for (int n = 0; n < 8; ++n)
    children.push_back(
        {1 + 2.25 + (n & 1) * 0.5 + 2 * (0.25 + (n >> 1 & 1) * 0.5) + 3 * (0.25 + (n >> 2) * 0.5), 0.75, 0.5, 0.25});
  const Jumps jumps = findJumps(Field(row(cells, children)));
  EXPECT_LT(jumps.value.max, 1e-14);
  EXPECT_LT(jumps.gradient.max, 1e-14);
}

TEST(Jumps, threadsDoNotChangeTheResult) {
  const Field field = randomField(8, {.grid = {4, 4, 4}, .maxDepth = 3});
  const Jumps one = findJumps(field, 1), two = findJumps(field, 2);
  ASSERT_EQ(one.interfaces.size(), two.interfaces.size());
  ASSERT_GT(one.interfaces.size(), 2000u);
  const auto same = [](double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
  };
  for (std::size_t n = 0; n < one.interfaces.size(); ++n) {
    const Interface &a = one.interfaces[n], &b = two.interfaces[n];
    ASSERT_EQ(a.cells, b.cells);
    ASSERT_TRUE(same(a.value.rms, b.value.rms) && same(a.value.max, b.value.max));
    ASSERT_TRUE(same(a.gradient.rms, b.gradient.rms) && same(a.gradient.max, b.gradient.max));
  }
  EXPECT_TRUE(same(one.value.rms, two.value.rms));
}

TEST(Jumps, areSortedAssignedToCellsAndCounted) {
  const Field field = randomField(9, {.grid = {3, 3, 3}, .maxDepth = 2});
  const Jumps jumps = findJumps(field);
  for (const JumpKind kind : {JumpKind::value, JumpKind::gradient}) {
    const auto worst = worstInterfaces(jumps, kind, 10);
    ASSERT_EQ(worst.size(), 10u);
    EXPECT_EQ(jumpOf(jumps.interfaces[worst[0]], kind).max,
              kind == JumpKind::value ? jumps.value.max : jumps.gradient.max);
    for (std::size_t n = 1; n < worst.size(); ++n)
      EXPECT_LE(jumpOf(jumps.interfaces[worst[n]], kind).max, jumpOf(jumps.interfaces[worst[n - 1]], kind).max);
    const auto ofCells = worstJumpOfCells(field, jumps, kind);
    for (const Interface& face : jumps.interfaces)
      for (const std::uint32_t cell : face.cells) EXPECT_GE(ofCells[cell], jumpOf(face, kind).max);
    EXPECT_EQ(*std::max_element(ofCells.begin(), ofCells.end()), jumpOf(jumps.interfaces[worst[0]], kind).max);
    std::size_t counted = 0;
    for (const auto& [decade, bin] : jumpHistogram(jumps, kind)) counted += bin.interfaces;
    EXPECT_EQ(counted, jumps.interfaces.size());
  }
  EXPECT_EQ(worstInterfaces(jumps, JumpKind::value, 1u << 30).size(), jumps.interfaces.size());
}

/// Makes a field whose leaves have different constants. It lies far from the origin, so that the coordinates of faces
/// are not representable.
Field steppedField() {
  const Vector3 corner(1e4, -3e4, 1 / 3.0);
  FieldData data =
      randomField(10, {.domain = Box(corner, corner + Vector3(0.7, 1.1, 0.9)), .grid = {3, 5, 7}, .maxDepth = 3})
          .data();
  auto& coefficients = std::get<FieldArray<double>>(data.coefficients).values();
  std::fill(coefficients.begin(), coefficients.end(), 0.0);
  double number = 0;
  for (const std::uint64_t bits : data.nodes)
    if (node::isLeaf(bits)) coefficients[node::offset(bits)] = std::sin(++number);
  return Field(std::move(data));
}

/// Each leaf of the field is constant, so that a random point's step is the jump of the interface on which it lies.
TEST(FaceSteps, equalTheJumpsOfInterfaces) {
  const Field field = steppedField();
  const Jumps jumps = findJumps(field);
  ASSERT_GT(jumps.hanging, 100u);
  std::set<double> known, found;
  for (const Interface& face : jumps.interfaces) known.insert(face.value.max);
  constexpr std::size_t kSeeds = 300;
  for (std::size_t seed = 0; seed < kSeeds; ++seed) {
    const FaceSteps steps = stepsAcrossFaces(field, 1, seed, 1);
    ASSERT_EQ(steps.points, 1u);
    ASSERT_TRUE(known.contains(steps.value)) << seed;
    ASSERT_EQ(steps.gradient, 0);
    found.insert(steps.value);
  }
  EXPECT_GT(found.size(), kSeeds / 2) << "most points lie on different interfaces";
  EXPECT_EQ(stepsAcrossFaces(field, 100 * jumps.interfaces.size()).value, jumps.value.max);
}

TEST(Jumps, totalsNeedNoInterfaces) {
  const Field field = randomField(11, {.grid = {5, 4, 3}, .maxDepth = 3});
  const Jumps jumps = findJumps(field);
  for (const int threads : {1, 3}) {
    const JumpTotals totals = measureJumps(field, threads);
    EXPECT_EQ(totals.hanging, jumps.hanging);
    EXPECT_EQ(totals.area, jumps.area);
    EXPECT_EQ(totals.value.rms, jumps.value.rms);
    EXPECT_EQ(totals.value.max, jumps.value.max);
    EXPECT_EQ(totals.gradient.rms, jumps.gradient.rms);
    EXPECT_EQ(totals.gradient.max, jumps.gradient.max);
  }
}

TEST(FaceSteps, approachTheGreatestJumpFromRandomPoints) {
  const Field field = randomField(11, {.grid = {3, 3, 3}, .maxDepth = 2});
  const Jumps jumps = findJumps(field);
  const FaceSteps steps = stepsAcrossFaces(field, 50'000);
  EXPECT_GT(steps.value, 0.7 * jumps.value.max);
  EXPECT_LT(steps.value, 1.01 * jumps.value.max);
  EXPECT_GT(steps.gradient, 0.7 * jumps.gradient.max);
  EXPECT_LT(steps.gradient, 1.01 * jumps.gradient.max);
  const FaceSteps blended = stepsAcrossFaces(hpsdf::blended(field), 50'000);
  EXPECT_LT(blended.value, 1e-13);
  EXPECT_LT(blended.gradient, 1e-10);
  const FaceSteps one = stepsAcrossFaces(field, 9'999, 7, 1);
  const FaceSteps three = stepsAcrossFaces(field, 9'999, 7, 3);
  EXPECT_EQ(one.points, 9'999u);
  EXPECT_EQ(one.value, three.value);
  EXPECT_EQ(one.gradient, three.gradient);
  EXPECT_NE(one.value, stepsAcrossFaces(field, 9'999, 8).value);
}

TEST(FaceSteps, areZeroWithoutFacesAndCanBeCancelled) {
  EXPECT_EQ(stepsAcrossFaces(Field(row({{1}})), 100).points, 0u);
  const Field field = randomField(11, {.grid = {3, 3, 3}, .maxDepth = 2});
  EXPECT_THROW(stepsAcrossFaces(field, 100, 1, 2, {.report = {}, .cancelled = [] { return true; }}), Cancelled);
}

TEST(Jumps, oneCellHasNoInterfaces) {
  const Jumps jumps = findJumps(Field(row({{1}})));
  EXPECT_TRUE(jumps.interfaces.empty());
  EXPECT_EQ(jumps.value.rms, 0);
  EXPECT_TRUE(worstInterfaces(jumps, JumpKind::value, 3).empty());
}

TEST(Jumps, canBeCancelled) {
  const Field field = randomField(8, {.grid = {4, 4, 4}, .maxDepth = 3});
  std::atomic<int> asked = 0;
  EXPECT_THROW(findJumps(field, 2, {.report = {}, .cancelled = [&] { return ++asked > 3; }}), Cancelled);
  double last = 0;
  findJumps(field, 2, {.report = [&](std::string_view, double fraction) { last = fraction; }, .cancelled = {}});
  EXPECT_EQ(last, 1);
}

}  // namespace jumps_test
}  // namespace hpsdf
