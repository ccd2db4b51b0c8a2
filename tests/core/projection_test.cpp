#include "basis/projection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "field/query/evaluate.h"

namespace hpsdf {
namespace projection_test {

std::vector<double> randomCoefficients(int degree, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> c(coefficientCount(degree));
  for (double& value : c) value = uniform(random);
  return c;
}

/// Samples a polynomial on [-1, 1]³ at `points`, mapped to the box with the corner `lower` and the edge `size`.
std::vector<double> sampled(const std::vector<double>& c, int degree, const std::vector<Vector3>& points,
                            const Vector3& lower = {-1, -1, -1}, double size = 2) {
  std::vector<double> samples;
  for (const Vector3& point : points) {
    const Vector3 x = lower + (point + Vector3::Ones()) * (size / 2);
    samples.push_back(query::evaluate(c.data(), degree, {x.x(), x.y(), x.z()}));
  }
  return samples;
}

void expectNear(const std::vector<double>& a, const std::vector<double>& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], tolerance) << "coefficient " << i;
}

TEST(Projection, reproducesEveryPolynomialOfItsDegree) {
  for (const int degree : {1, 2, 3, 5, 9, 17, 30}) {
    const auto c = randomCoefficients(degree, 7);
    const auto project = basis::productProjection(basis::gaussLegendre(degree + 1), degree);
    expectNear((*project)(sampled(c, degree, project->points())), c, 1e-11);
  }
  for (int degree = 1; degree <= 6; ++degree) {
    const auto c = randomCoefficients(degree, 8);
    const auto project = basis::matrixProjection(*basis::compactCubature(2 * degree), degree);
    expectNear((*project)(sampled(c, degree, project->points())), c, 1e-13);
  }
}

TEST(Projection, lowerCoefficientsDoNotDependOnHigherOnes) {
  const auto c = randomCoefficients(5, 3);
  for (const auto& project :
       {basis::productProjection(basis::gaussLegendre(6), 3),
        basis::matrixProjection(*basis::compactCubature(8), 3)}) {  // Both rules are exact for degree 5 + 3.
    const auto fitted = (*project)(sampled(c, 5, project->points()));
    basis::forEachCoefficient(3, [&](int i, int j, int k, int index) {
      basis::forEachCoefficient(5, [&](int a, int b, int d, int other) {
        if (a == i && b == j && d == k) {
          EXPECT_NEAR(fitted[index], c[other], 1e-13);
        }
      });
    });
  }
}

TEST(Projection, meanSquareSatisfiesParsevalsIdentity) {
  const auto c = randomCoefficients(4, 11);
  double parseval = 0;
  basis::forEachCoefficient(
      4, [&](int i, int j, int k, int index) { parseval += c[index] * c[index] * basis::squaredNorm(i, j, k); });
  for (const auto& project :
       {basis::productProjection(basis::gaussLegendre(5), 4), basis::matrixProjection(*basis::compactCubature(8), 4)})
    EXPECT_NEAR(project->meanSquare(sampled(c, 4, project->points()), c), parseval, 1e-13);
}

TEST(Projection, joinedChildrenAreTheParent) {
  for (const int degree : {0, 1, 2, 5, 31}) {
    const auto c = randomCoefficients(std::min(degree, kMaxDegree), 13);
    const auto project = basis::productProjection(basis::gaussLegendre(degree + 1), degree);
    std::array<std::vector<double>, 8> children;
    for (int child = 0; child < 8; ++child) {
      const Vector3 lower(child & 1, child >> 1 & 1, child >> 2);
      children[child] =
          (*project)(sampled(c, std::min(degree, kMaxDegree), project->points(), lower - Vector3::Ones(), 1));
    }
    auto expected = c;  // c has no coefficients of degree 31
    if (degree > kMaxDegree)
      expected = basis::appendTopDegree(c, std::vector<double>(coefficientCount(degree), 0.0), degree);
    expectNear(basis::joined(children, degree), expected, 1e-10);
  }
}

/// No quadrature is exact for a function with a kink; still, the result must equal the projection of all samples.
TEST(Projection, joinedChildrenAreTheProjectionOfAllSamples) {
  const auto kink = [](const Vector3& x) { return std::abs(x.x() + 0.3 * x.y() - 0.2) + x.z() * x.x(); };
  constexpr int kDegree = 4;
  const auto project = basis::matrixProjection(*basis::compactCubature(9), kDegree);
  std::array<std::vector<double>, 8> children;
  std::vector<double> ofAllSamples(coefficientCount(kDegree), 0.0);
  for (int child = 0; child < 8; ++child) {
    const Vector3 centre((child & 1) - 0.5, (child >> 1 & 1) - 0.5, (child >> 2) - 0.5);
    std::vector<double> samples;
    for (std::size_t q = 0; q < project->points().size(); ++q) {
      const Vector3 x = centre + project->points()[q] / 2;
      samples.push_back(kink(x));
      double u[kDegree + 1], v[kDegree + 1], w[kDegree + 1];
      basis::legendreValues(x.x(), kDegree, u);
      basis::legendreValues(x.y(), kDegree, v);
      basis::legendreValues(x.z(), kDegree, w);
      const double weight = basis::compactCubature(9)->weights[q] / 64;
      basis::forEachCoefficient(kDegree, [&](int i, int j, int k, int index) {
        ofAllSamples[index] += weight * samples.back() * u[i] * v[j] * w[k] / basis::squaredNorm(i, j, k);
      });
    }
    children[child] = (*project)(samples);
  }
  expectNear(basis::joined(children, kDegree), ofAllSamples, 1e-14);
}

TEST(Projection, topDegreeErrorIsTheNormOfTheTopDegreeTerms) {
  const auto c = randomCoefficients(6, 5);
  double shell = 0;
  basis::forEachCoefficient(6, [&](int i, int j, int k, int index) {
    if (i + j + k == 6) shell += c[index] * c[index] * basis::squaredNorm(i, j, k);
  });
  EXPECT_NEAR(basis::topDegreeError(c.data(), 6, 2.5), 2.5 * shell, 1e-14);
}

TEST(Projection, appendingKeepsTheLowerCoefficients) {
  const auto lower = randomCoefficients(3, 1);
  const auto raised = randomCoefficients(4, 2);
  const auto both = basis::appendTopDegree(lower, raised, 4);
  std::size_t next = 0;
  basis::forEachCoefficient(4, [&](int i, int j, int k, int index) {
    EXPECT_EQ(both[index], i + j + k == 4 ? raised[index] : lower[next++]);
  });
}

TEST(Projection, droppingTheTopKeepsTheRest) {
  const auto c = randomCoefficients(5, 4);
  expectNear(basis::appendTopDegree(basis::truncated(c, 5, 4), c, 5), c, 0);
}

TEST(Evaluate, gradientMatchesCentralDifferences) {
  for (const int degree : {1, 2, 4, 12}) {
    const auto c = randomCoefficients(degree, 9);
    const std::array<double, 3> at = {0.3, -0.55, 0.81};
    const auto result = query::evaluateWithGradient(c.data(), degree, at);
    EXPECT_DOUBLE_EQ(result.value, query::evaluate(c.data(), degree, at));
    for (int axis = 0; axis < 3; ++axis) {
      auto above = at, below = at;
      above[axis] += 1e-6;
      below[axis] -= 1e-6;
      const double difference =
          (query::evaluate(c.data(), degree, above) - query::evaluate(c.data(), degree, below)) / 2e-6;
      EXPECT_NEAR(result.gradient[axis], difference, 1e-6 * (1 + std::abs(difference)));
    }
  }
}

}  // namespace projection_test
}  // namespace hpsdf
