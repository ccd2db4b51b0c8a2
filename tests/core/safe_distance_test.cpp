#include "hpsdf/safe_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"

namespace hpsdf {
namespace safe_distance_test {

using Phi = std::function<double(const Vector3&)>;

/// Signed distance to two spheres; it has a kink halfway between them.
double spheres(const Vector3& x) {
  return std::min((x - Vector3(0.5, 0.1, 0)).norm() - 0.4, (x + Vector3(0.5, 0, 0.2)).norm() - 0.35);
}
double box(const Vector3& x) { return shapes::boxDistance(x, {0.7, 0.4, 0.9}); }
Box cube() { return Box(Vector3::Constant(-1.1), Vector3::Constant(1.1)); }

struct BoundCheck {
  int violations = 0;
  double medianBound = 0, medianWorst = 0;  ///< medians over leaves
};

/// Checks the bounds at 5³ points of every leaf, including its corners.
BoundCheck checkBounds(const Field& field, const Phi& phi) {
  BoundCheck check;
  std::vector<double> bounds, worst;
  field.forEachCell([&](const Cell& cell) {
    const CellBound bound = field.data().bounds[cell.id];
    double greatest = 0;
    for (int n = 0; n < 125; ++n) {
      const Vector3 share(n % 5 / 4.0, n / 5 % 5 / 4.0, n / 25 / 4.0);
      // Points are moved slightly into the leaf, because on its faces rounding would decide which leaf they belong to.
      const Vector3 inner = Vector3::Constant(1e-9) + share * (1 - 2e-9);
      const Vector3 x = cell.box.min() + inner.cwiseProduct(cell.box.sizes());
      const auto [value, gradient] = field.valueAndGradient(x);
      greatest = std::max(greatest, std::abs(value - phi(x)));
      check.violations += gradient.norm() > bound.slope;
    }
    check.violations += greatest > bound.error;
    bounds.push_back(bound.error);
    worst.push_back(greatest);
  });
  const auto median = [](std::vector<double>& numbers) {
    std::ranges::nth_element(numbers, numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2));
    return numbers[numbers.size() / 2];
  };
  check.medianBound = median(bounds);
  check.medianWorst = median(worst);
  return check;
}

TEST(SafeDistance, boundsHoldAndAreTight) {
  const ExactDistance gear(shapes::mesh("gear"));
  for (const Phi& phi : {Phi(spheres), Phi(box)})
    for (const double target : {1e-5, 1e-7}) {
      const Field field = build(phi, cube(), {.targetError = target, .bounds = true});
      EXPECT_EQ(checkBounds(field, phi).violations, 0);
    }
  const BuildOptions options{.targetError = 1e-5, .strategy = Strategy::hp, .bounds = true};
  const Field field = build(gear, domainAround(gear.source().box), options);
  const BoundCheck found = checkBounds(field, [&](const Vector3& x) { return gear(x); });
  EXPECT_EQ(found.violations, 0);
  EXPECT_LT(found.medianBound, 4 * found.medianWorst);
}

TEST(SafeDistance, checkFindsBoundsThatAreTooLow) {
  FieldData data = build(spheres, cube(), {.targetError = 1e-5, .bounds = true}).data();
  for (CellBound& bound : data.bounds) bound.error /= 100;
  EXPECT_GT(checkBounds(Field(data), spheres).violations, 100);
  data = build(spheres, cube(), {.targetError = 1e-5, .bounds = true}).data();
  for (CellBound& bound : data.bounds) bound.slope *= 0.9f;
  EXPECT_GT(checkBounds(Field(data), spheres).violations, 100);
}

TEST(SafeDistance, boundsHoldForContinuousFieldsToo) {
  const Field weak = build(spheres, cube(), {.targetError = 1e-5, .continuityWeight = 0.5, .bounds = true});
  EXPECT_EQ(checkBounds(weak, spheres).violations, 0);
  for (const double blend : {0.04, 0.25}) {
    const Field exact =
        build(spheres, cube(), {.targetError = 1e-5, .grid = {16, 16, 16}, .blend = blend, .bounds = true});
    const BoundCheck found = checkBounds(exact, spheres);
    EXPECT_EQ(found.violations, 0);
    EXPECT_LT(found.medianBound, 3.5 * checkBounds(withBounds(blended(exact, 0), spheres), spheres).medianBound);
  }
  EXPECT_TRUE(blended(weak).data().bounds.empty()) << "the bounds do not hold for the blended field";
}

TEST(SafeDistance, boundsTakeFewDistancesAndAreTheSameForAnyNumberOfThreads) {
  const BuildOptions unbounded{.targetError = 1e-6};
  BuildOptions bounded = unbounded;
  bounded.bounds = true;
  const Field before = build(spheres, cube(), unbounded), after = build(spheres, cube(), bounded);
  EXPECT_LT(double(after.metadata().exactEvaluations), 1.5 * double(before.metadata().exactEvaluations));
  EXPECT_EQ(before.data().nodes, after.data().nodes);
  const auto same = [&](const Field& other) {
    return std::ranges::equal(after.data().bounds, other.data().bounds, [](const CellBound& a, const CellBound& b) {
      return a.error == b.error && a.slope == b.slope;
    });
  };
  bounded.threads = 1;
  EXPECT_TRUE(same(build(spheres, cube(), bounded)));
  EXPECT_TRUE(same(withBounds(before, spheres, 3)));
  EXPECT_EQ(withBounds(before, spheres).metadata().exactEvaluations, after.metadata().exactEvaluations);
  EXPECT_FALSE(same(withBounds(before, box))) << "another surface has other bounds";
}

TEST(SafeDistance, neverExceedsTheDistanceToTheSurface) {
  const Field field = build(spheres, cube(), {.targetError = 1e-6, .grid = {24, 24, 24}, .bounds = true});
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> coordinate(-1.5, 1.5);
  int useful = 0;
  for (int n = 0; n < 20000; ++n) {
    const Vector3 x(coordinate(random), coordinate(random), coordinate(random));
    const double safe = safeDistance(field, x);
    ASSERT_LE(safe, std::abs(spheres(x)));
    useful += safe > 0.8 * std::abs(spheres(x));
  }
  EXPECT_GT(useful, 8000);
}

TEST(SafeDistance, raysNeverPassThroughTheSurface) {
  const Field field = build(spheres, cube(), {.targetError = 1e-6, .grid = {24, 24, 24}, .bounds = true});
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  const auto direction = [&] { return Vector3(normal(random), normal(random), normal(random)).normalized(); };
  int touches = 0, leaves = 0;
  for (int n = 0; n < 2000; ++n) {
    const Vector3 origin = 2.5 * direction();
    const Vector3 towards = (0.6 * direction() - origin).normalized();
    const SafeTrace trace = safeTrace(field, origin, towards, 1e-3);
    for (int step = 0; step <= 200; ++step) ASSERT_GT(spheres(origin + step / 200.0 * trace.length * towards), 0) << n;
    (trace.mayTouch ? touches : leaves) += 1;
    if (trace.mayTouch) {
      EXPECT_LT(spheres(origin + trace.length * towards), 0.1) << "it stops near the surface";
    }
  }
  EXPECT_GT(touches, 100);
  EXPECT_GT(leaves, 100);
  EXPECT_FALSE(safeTrace(field, {3, 3, 3}, {1, 0, 0}, 1e-3).mayTouch) << "past the domain";
}

/// Far from the domain, rounding of points on the ray exceeds the slack of 1e-3; the ray must still end.
TEST(SafeDistance, raysFromFarAwayEnd) {
  const Field field = build(spheres, cube(), {.targetError = 1e-6, .grid = {24, 24, 24}, .bounds = true});
  const auto from = [&](double far) { return safeTrace(field, {far, 0.5, 0.5}, {-1, 0, 0}, 1e-3); };
  EXPECT_FALSE(from(1e6).mayTouch);
  EXPECT_NEAR(from(1e6).length, 1e6 + 1.1, 1e-9);
  EXPECT_TRUE(from(8e15).mayTouch);
  EXPECT_LT(from(8e15).steps, 10);
}

/// The subtracted error bound belongs to the leaf that contains the point, with and without blending.
TEST(SafeDistance, isTheValueLessTheBound) {
  for (const double blend : {0.0, 0.1}) {
    const Field field =
        build(spheres, cube(), {.targetError = 1e-6, .grid = {24, 24, 24}, .blend = blend, .bounds = true});
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> coordinate(-1.1, 1.1);
    for (int n = 0; n < 20000; ++n) {
      const Vector3 x(coordinate(random), coordinate(random), coordinate(random));
      const double certain = std::abs(field.value(x)) - double(boundAt(field, x)->error);
      ASSERT_EQ(safeDistance(field, x), std::max(0.0, certain));
    }
  }
}

TEST(SafeDistance, refusesFieldsWithoutBoundsAndBadArguments) {
  const Field field = build(spheres, cube(), {.targetError = 1e-4});
  EXPECT_FALSE(boundAt(field, {0, 0, 0}));
  EXPECT_THROW(safeDistance(field, {0, 0, 0}), Error);
  EXPECT_THROW(safeTrace(field, {0, 0, 0}, {1, 0, 0}, 1e-3), Error);
  const Field bounded = withBounds(field, spheres);
  EXPECT_TRUE(boundAt(bounded, {0, 0, 0}));
  EXPECT_THROW(safeTrace(bounded, {0, 0, 0}, {0, 0, 0}, 1e-3), Error);
  EXPECT_THROW(safeTrace(bounded, {0, 0, 0}, {1, 0, 0}, 0), Error);
  EXPECT_THROW(withBounds(field, [](const Vector3&) { return std::nan(""); }), Error);
}

}  // namespace safe_distance_test
}  // namespace hpsdf
