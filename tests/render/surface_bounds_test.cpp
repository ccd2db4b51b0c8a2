#include "view/surface_bounds.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "support/random_field.h"

namespace hpsdf::render {
namespace surface_bounds_test {

// The values L_i, L_i' and L_i'' for i = 0..degree.
struct Legendre {
  Legendre(double x, int degree) : value(degree + 1), first(degree + 1), second(degree + 1) {
    const auto at = [](const std::vector<double>& v, int i) { return i < 0 ? 0.0 : v[i]; };
    value[0] = 1;
    for (int i = 1; i <= degree; ++i) {
      value[i] = ((2 * i - 1) * x * value[i - 1] - (i - 1) * at(value, i - 2)) / i;
      first[i] = (2 * i - 1) * value[i - 1] + at(first, i - 2);
      second[i] = (2 * i - 1) * first[i - 1] + at(second, i - 2);
    }
  }
  std::vector<double> value, first, second;
};

struct Local {
  double value = 0;
  Vector3 gradient = Vector3::Zero();
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();

  double steepestCurve() const {
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(hessian, Eigen::EigenvaluesOnly)
        .eigenvalues()
        .cwiseAbs()
        .maxCoeff();
  }
};

template <typename Visit>
void forEachTerm(int degree, const Visit& visit) {
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; j <= degree - i; ++j)
      for (int k = 0; k <= degree - i - j; ++k) visit(i, j, k);
}

Local evaluate(const double* c, int degree, const Vector3& local) {
  const Legendre x(local.x(), degree), y(local.y(), degree), z(local.z(), degree);
  Local result;
  forEachTerm(degree, [&](int i, int j, int k) {
    const double u = x.value[i], v = y.value[j], w = z.value[k];
    result.value += *c * u * v * w;
    result.gradient += *c * Vector3(x.first[i] * v * w, u * y.first[j] * w, u * v * z.first[k]);
    Eigen::Matrix3d h;
    h << x.second[i] * v * w, x.first[i] * y.first[j] * w, x.first[i] * v * z.first[k],  //
        x.first[i] * y.first[j] * w, u * y.second[j] * w, u * y.first[j] * z.first[k],   //
        x.first[i] * v * z.first[k], u * y.first[j] * z.first[k], u * v * z.second[k];
    result.hessian += *c++ * h;
  });
  return result;
}

Vector3 linearPart(const double* c, int degree) {
  Vector3 linear = Vector3::Zero();
  forEachTerm(degree, [&](int i, int j, int k) {
    if (i + j + k == 1) linear += *c * Vector3(i, j, k);
    ++c;
  });
  return linear;
}

// Evaluates the polynomial in the order of operations and the precision of shaders/field.glsl.
float evaluateSingle(const double* c, int degree, const Eigen::Vector3f& local) {
  const auto advance = [](float& value, float& before, float x, float i) {
    const float product = x * value;
    const float next = product + (product - before) * (i / (i + 1.0F));
    before = value;
    value = next;
  };
  float value = 0, x = 1, xBefore = 0;
  for (int i = 0; i <= degree; ++i) {
    float plane = 0, y = 1, yBefore = 0;
    for (int j = 0; j <= degree - i; ++j) {
      float line = 0, z = 1, zBefore = 0;
      for (int k = 0; k <= degree - i - j; ++k) {
        line += static_cast<float>(*c++) * z;
        advance(z, zBefore, local.z(), static_cast<float>(k));
      }
      plane += line * y;
      advance(y, yBefore, local.y(), static_cast<float>(j));
    }
    value += plane * x;
    advance(x, xBefore, local.x(), static_cast<float>(i));
  }
  return value;
}

// Without negative coefficients, all terms and their derivatives are greatest in the corner (1, 1, 1), where they add
// up: there the bounds are reached.
Field withoutNegatives(const Field& field) {
  FieldData data = field.data();
  for (double& c : std::get<FieldArray<double>>(data.coefficients).values()) c = std::abs(c);
  return Field(std::move(data));
}

template <typename Visit>
void forEachLeaf(const Field& field, const Visit& visit) {
  const std::vector<SurfaceBounds> bounds = surfaceBounds(field.data());
  ASSERT_EQ(bounds.size(), field.data().nodes.size());
  const auto& coefficients = std::get<FieldArray<double>>(field.data().coefficients).all();
  for (std::size_t n = 0; n < bounds.size(); ++n) {
    const std::uint64_t bits = field.data().nodes[n];
    if (node::isLeaf(bits)) visit(bounds[n], coefficients.data() + node::offset(bits), node::degree(bits));
  }
}

TEST(SurfaceBounds, holdAtEveryPointOfALeaf) {
  constexpr int kSteps = 6;
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Field field = randomField(
        seed, {.grid = {1, 1, 2}, .roughness = 2, .refinement = 0.3, .maxDepth = 1, .minDegree = 0, .maxDegree = 9});
    forEachLeaf(field, [&](const SurfaceBounds& bounds, const double* c, int degree) {
      const Vector3 linear = linearPart(c, degree);
      for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(bounds.linear[axis], static_cast<float>(linear[axis]));
      EXPECT_EQ(bounds.linear[3], static_cast<float>(c[0]));
      for (int i = 0; i <= kSteps; ++i)
        for (int j = 0; j <= kSteps; ++j)
          for (int k = 0; k <= kSteps; ++k) {
            const Vector3 point = Vector3(i, j, k) * (2.0 / kSteps) - Vector3::Ones();
            const Local here = evaluate(c, degree, point);
            ASSERT_GE(here.value, bounds.lo);
            ASSERT_LE(here.value, bounds.hi);
            ASSERT_LE(std::abs(here.value - (c[0] + linear.dot(point))), bounds.valueDeviation);
            ASSERT_LE((here.gradient - linear).norm(), bounds.gradientDeviation);
            ASSERT_LE(here.steepestCurve(), bounds.secondDerivative);
          }
    });
  }
}

// The field c·L_1·L_1 of two coordinates has a single second derivative, the mixed one.
TEST(SurfaceBounds, holdForMixedDerivatives) {
  for (int missing = 0; missing < 3; ++missing) {
    std::vector<double> c;
    forEachTerm(2, [&](int i, int j, int k) {
      const std::array<int, 3> powers = {i, j, k};
      c.push_back(i + j + k == 2 && powers[missing] == 0 && *std::ranges::max_element(powers) == 1 ? 0.7 : 0.0);
    });
    FieldData data{.domain = Box(Vector3::Zero(), Vector3::Ones()),
                   .nodes = {node::leaf(2, 0)},
                   .coefficients = c,
                   .metadata = {}};
    const SurfaceBounds bounds = surfaceBounds(Field(std::move(data)).data()).front();
    const Local corner = evaluate(c.data(), 2, Vector3::Ones());
    EXPECT_NEAR(corner.steepestCurve(), 0.7, 1e-12);
    EXPECT_GE(bounds.secondDerivative, corner.steepestCurve());
    EXPECT_LE(bounds.secondDerivative, 1.5 * corner.steepestCurve());
    EXPECT_GE(bounds.gradientDeviation, corner.gradient.norm());
  }
}

TEST(SurfaceBounds, areReachedUpToRounding) {
  constexpr double kSlack = 1 + 2e-5;
  for (const int degree : {0, 1, 2, 3, 5, 8, 13, 30}) {
    const Field field =
        withoutNegatives(randomField(degree, {.refinement = 0, .minDegree = degree, .maxDegree = degree}));
    forEachLeaf(field, [&](const SurfaceBounds& bounds, const double* c, int p) {
      const Local corner = evaluate(c, p, Vector3::Ones());
      const double bend = (corner.gradient - linearPart(c, p)).norm();
      const double slack = (kSlack - 1) * corner.value;
      EXPECT_GE(bounds.hi, corner.value);
      EXPECT_LE(bounds.hi, corner.value + slack);
      EXPECT_LE(bounds.lo, 2 * c[0] - corner.value);
      EXPECT_GE(bounds.lo, 2 * c[0] - corner.value - slack);
      const double rest = corner.value - c[0] - linearPart(c, p).sum();
      EXPECT_GE(bounds.valueDeviation, rest);
      EXPECT_LE(bounds.valueDeviation, rest + slack);
      EXPECT_GE(bounds.gradientDeviation, bend);
      EXPECT_LE(bounds.gradientDeviation, bend * kSlack + slack);
      EXPECT_GE(bounds.secondDerivative, corner.hessian.norm());
      EXPECT_LE(bounds.secondDerivative, corner.hessian.norm() * kSlack + slack);
      EXPECT_LE(bounds.secondDerivative, std::sqrt(3) * corner.steepestCurve() * kSlack + slack);
    });
  }
}

// The shaders compute the field in single precision, so that the bounds must include its rounding errors.
TEST(SurfaceBounds, holdForValuesInSinglePrecision) {
  int leaves = 0;
  for (const int degree : {0, 1, 2, 4, 7, 12, 20, 30}) {
    const Field field = withoutNegatives(
        randomField(100 + degree, {.grid = {3, 3, 3}, .refinement = 0, .minDegree = degree, .maxDegree = degree}));
    forEachLeaf(field, [&](const SurfaceBounds& bounds, const double* c, int p) {
      ++leaves;
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3f at(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
        const float value = evaluateSingle(c, p, at);
        EXPECT_GE(value, bounds.lo) << "degree " << p;
        EXPECT_LE(value, bounds.hi) << "degree " << p;
        const auto& [x, y, z, middle] = bounds.linear;
        EXPECT_LE(std::abs(value - (at.dot(Eigen::Vector3f(x, y, z)) + middle)), bounds.valueDeviation)
            << "degree " << p;
      }
    });
  }
  EXPECT_EQ(leaves, 8 * 27);
}

TEST(SurfaceBounds, ofANodeContainThoseOfItsChildren) {
  const Field field = randomField(5, {.refinement = 0.5, .maxDepth = 3});
  const std::vector<SurfaceBounds> bounds = surfaceBounds(field.data());
  int internal = 0;
  for (std::size_t n = 0; n < bounds.size(); ++n) {
    const std::uint64_t bits = field.data().nodes[n];
    if (node::isLeaf(bits)) {
      EXPECT_GE(bounds[n].gradientDeviation, 0);
      continue;
    }
    ++internal;
    const auto children = std::span(bounds).subspan(node::firstChild(bits), 8);
    EXPECT_EQ(bounds[n].lo, std::ranges::min(children, {}, &SurfaceBounds::lo).lo);
    EXPECT_EQ(bounds[n].hi, std::ranges::max(children, {}, &SurfaceBounds::hi).hi);
    EXPECT_EQ(bounds[n].gradientDeviation, -1);
  }
  EXPECT_GT(internal, 20);
}

// Unpacks bounds as shaders/field.glsl does: two 16-bit floats in one integer.
SurfaceBounds unpacked(std::uint32_t packed) {
  return {std::bit_cast<float>(packed << 16), std::bit_cast<float>(packed & 0xffff0000U), 0, 0, 0, {}};
}

TEST(PackOutwards, containsTheRangeAndLittleMore) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> mantissa(-1, 1);
  std::uniform_int_distribution<int> exponent(-140, 120);
  for (int i = 0; i < 100000; ++i) {
    float lo = std::ldexp(mantissa(random), exponent(random)), hi = std::ldexp(mantissa(random), exponent(random));
    if (lo > hi) std::swap(lo, hi);
    const SurfaceBounds range = unpacked(packOutwards(lo, hi));
    ASSERT_LE(range.lo, lo);
    ASSERT_GE(range.hi, hi);
    const auto unit = [](float x) { return std::abs(x) / 128 + std::numeric_limits<float>::min() / 128; };
    ASSERT_GE(range.lo, lo - unit(lo));
    ASSERT_LE(range.hi, hi + unit(hi));
  }
}

TEST(PackOutwards, keepsNumbersThatFit) {
  for (const auto& [lo, hi] : {std::pair(0.0F, 0.0F), {-1.0F, 1.0F}, {-0.375F, -0.25F}, {1024.0F, 1.5e30F}}) {
    const float shortHi = std::bit_cast<float>(std::bit_cast<std::uint32_t>(hi) & 0xffff0000U);
    const SurfaceBounds range = unpacked(packOutwards(lo, shortHi));
    EXPECT_EQ(range.lo, lo);
    EXPECT_EQ(range.hi, shortHi);
  }
}

}  // namespace surface_bounds_test
}  // namespace hpsdf::render
