#include "field/cells/part_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "basis/coefficient_cube.h"
#include "hpsdf/distance_function.h"

namespace hpsdf::detail {
namespace part_bounds_test {

double sphere(const Vector3& x) { return (x - Vector3(0.1, -0.2, 0.3)).norm() - 0.5; }

/// A polynomial with random coefficients, which are smaller for terms of higher degree, over a random box.
BoxPolynomial randomPolynomial(std::mt19937_64& random, int degree) {
  std::uniform_real_distribution<double> number(-1, 1);
  const auto vector = [&] { return Vector3(number(random), number(random), number(random)); };
  BoxPolynomial polynomial{std::vector<double>(basis::cubeIndex(degree, degree, degree, degree) + 1, 0.0), degree, {}};
  basis::forEachCoefficient(degree, [&](int i, int j, int k, int) {
    polynomial.cube[basis::cubeIndex(i, j, k, degree)] = number(random) * std::pow(0.3, i + j + k);
  });
  const Vector3 center = vector(), half = Vector3::Constant(0.1) + 0.2 * vector().cwiseAbs();
  polynomial.part = partOf(polynomial.cube, degree, center, half);
  return polynomial;
}

double legendre(int degree, double t) { return std::legendre(static_cast<unsigned>(degree), t); }

/// Returns the polynomial's value at a point with coordinates from −1 to 1 in the box.
double valueAt(const BoxPolynomial& polynomial, const Vector3& local) {
  double value = 0;
  // std::legendre takes no negative arguments in every library, hence L_i(−t) = (−1)^i L_i(t).
  const auto factor = [](int i, double t) { return t < 0 && i % 2 == 1 ? -legendre(i, -t) : legendre(i, std::abs(t)); };
  basis::forEachCoefficient(polynomial.degree, [&](int i, int j, int k, int) {
    value += polynomial.cube[basis::cubeIndex(i, j, k, polynomial.degree)] * factor(i, local[0]) * factor(j, local[1]) *
             factor(k, local[2]);
  });
  return value;
}

/// Calls f(local, world) for the points of a lattice of 9³ points in a part, which includes its corners.
template <typename F>
void forEachPoint(const Part& part, const F& f) {
  for (int n = 0; n < 9 * 9 * 9; ++n) {
    const Vector3 local = Vector3(n % 9, n / 9 % 9, n / 81) / 4 - Vector3::Ones();
    f(local, part.center + local.cwiseProduct(part.half));
  }
}

TEST(PartBounds, coneBoundIsAnUpperBoundAndTightForLinearPolynomials) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int n = 0; n < 300; ++n) {
    const BoxPolynomial polynomial = randomPolynomial(random, n % 4 + 1);
    const Vector3 y(number(random), number(random), number(random));
    for (const double sign : {1.0, -1.0}) {
      double greatest = -1e300;
      forEachPoint(polynomial.part, [&](const Vector3& local, const Vector3& x) {
        greatest = std::max(greatest, sign * valueAt(polynomial, local) + (x - y).norm());
      });
      const double bound = coneBound(polynomial.part, sign, y);
      ASSERT_GE(bound, greatest - 1e-12) << n;
      if (polynomial.degree == 1) {
        ASSERT_NEAR(bound, greatest, 1e-12) << n;
      }
    }
  }
}

/// Leaves of different degrees share the evaluations of the distance. No leaf's bounds depend on the others.
TEST(PartBounds, leavesBoundedTogetherHaveTheBoundsThatEachHasAlone) {
  std::mt19937_64 random(2);
  std::vector<BoxPolynomial> leaves;
  for (const int degree : {2, 0, 5, 3, 1}) leaves.push_back(randomPolynomial(random, degree));
  const DistanceFunction distance(sphere);
  const Box domain(Vector3::Constant(-1.5), Vector3::Constant(1.5));
  const LegendreRows lower = legendreOfPart(-0.5, 0.5, kMaxDegree), upper = legendreOfPart(0.5, 0.5, kMaxDegree);
  const ErrorQuestion question{48, distance, domain, lower, upper};
  const std::vector<ErrorBound> together = boundErrors(leaves, question);
  ASSERT_EQ(together.size(), leaves.size());
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    const ErrorBound alone = boundErrors({&leaves[n], 1}, question).front();
    EXPECT_EQ(together[n].error, alone.error);
    EXPECT_EQ(together[n].slope, alone.slope);
    EXPECT_EQ(together[n].evaluations, 48U);
    double greatest = 0;
    forEachPoint(leaves[n].part, [&](const Vector3& local, const Vector3& x) {
      greatest = std::max(greatest, std::abs(valueAt(leaves[n], local) - sphere(x)));
    });
    EXPECT_GE(together[n].error, greatest - 1e-12);
    EXPECT_LT(together[n].error, 1.3 * greatest) << "the error of a random polynomial is bounded well";
  }
  EXPECT_TRUE(boundErrors({}, question).empty());
}

}  // namespace part_bounds_test
}  // namespace hpsdf::detail
