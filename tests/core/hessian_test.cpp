// Second derivatives of fields: compared with central differences of gradients, and with closed forms in exact leaves.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "field/query/quantized.h"
#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/triangle_list.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"
#include "support/made_meshes.h"
#include "support/random_field.h"

namespace hpsdf {
namespace hessian_test {

using Eigen::Matrix3d;
using HessianAt = std::function<Matrix3d(const Vector3&)>;

/// Returns the Hessian as the central difference of gradients.
Matrix3d centralDifference(const Field& field, const Vector3& x, double step) {
  Matrix3d hessian;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3 above = x + step * Vector3::Unit(axis), below = x - step * Vector3::Unit(axis);
    hessian.col(axis) =
        (field.valueAndGradient(above).gradient - field.valueAndGradient(below).gradient) / (above[axis] - below[axis]);
  }
  return hessian;
}

/// The comparison of Hessians with central differences.
struct Comparison {
  double deviation = 0;  ///< greatest relative difference
  int curved = 0;        ///< points at which the Hessian is not 0
};

/// Compares Hessians with central differences of the gradient. Steps are so short that no face of a cell and no other
/// kink of the gradient comes between the two gradients at any of the points below.
Comparison compare(const Field& field, const std::vector<Vector3>& points, const HessianAt& hessianAt) {
  constexpr double kStep = 2e-6;
  const double size = field.domain().sizes().norm();
  Comparison found;
  for (const Vector3& x : points) {
    const Cell cell = field.cellAt(x);
    double step = kStep * cell.box.sizes().minCoeff();
    if (cell.degree == kExactDegree) step = std::min(step, 5e-3 * std::abs(field.value(x)));
    const Matrix3d expected = centralDifference(field, x, step), hessian = hessianAt(x);
    const double scale = expected.norm() + field.valueAndGradient(x).gradient.norm() / size;
    found.deviation = std::max(found.deviation, (hessian - expected).norm() / scale);
    found.curved += !hessian.isZero(0);
  }
  return found;
}

Field quantized(const Field& field, double step) {
  FieldData data = field.data();
  query::take(*query::quantized(data, std::vector<double>(data.nodes.size(), step)), data);
  return Field(std::move(data));
}

/// Returns a random field with cells of several depths and degrees that are not cubes.
Field irregular(bool single, int maxDegree = 8) {
  return randomField(7, {.domain = Box(Vector3(-1, -0.5, -2), Vector3(1, 1, 1)),
                         .grid = {2, 1, 3},
                         .refinement = 0.35,
                         .maxDepth = 3,
                         .maxDegree = maxDegree,
                         .single = single});
}

Field hpxOf(const TriangleMesh& mesh, const DistanceOptions& options = {}, double blend = 0) {
  const ExactDistance distance(mesh, options);
  const Field field = build(distance, domainAround(mesh), {.targetError = 1e-4, .strategy = Strategy::hpx});
  return blend > 0 ? blended(field, blend) : field;
}

TriangleMesh overlappingBoxes() {
  return support::joined(support::boxOfTwo(), support::moved(support::boxOfTwo(), {0.7, 0.6, 0.5}));
}

Field fieldOf(const std::string& kind) {
  if (kind == "double") return irregular(false);
  if (kind == "float") return irregular(true);
  if (kind == "quantized") return quantized(irregular(false), 1e-7);
  if (kind == "wide") return quantized(irregular(false), 1e-9);
  if (kind == "highDegree") return irregular(false, 20);
  if (kind == "blended") return blended(irregular(false), 0.2);
  if (kind == "blendedQuantized") return blended(quantized(irregular(false, 5), 1e-7), 0.25);
  if (kind == "exact") return hpxOf(shapes::mesh("gear"));
  if (kind == "exactBlended") return hpxOf(shapes::mesh("gear"), {}, 0.1);
  if (kind == "shell") return hpxOf(support::openBox(), {.insideTest = InsideTest::shell, .thickness = 0.1});
  return hpxOf(overlappingBoxes());
}

/// Returns whether two results have the same value and gradient, to the bit.
bool areSame(const ValueGradientHessian& a, const ValueAndGradient& b) {
  const auto isSame = [](double p, double q) {
    return std::bit_cast<std::uint64_t>(p) == std::bit_cast<std::uint64_t>(q) || (std::isnan(p) && std::isnan(q));
  };
  return isSame(a.value, b.value) && isSame(a.gradient.x(), b.gradient.x()) && isSame(a.gradient.y(), b.gradient.y()) &&
         isSame(a.gradient.z(), b.gradient.z());
}

class Hessian : public testing::TestWithParam<std::string> {
 protected:
  const Field field_ = fieldOf(GetParam());
  const std::vector<Vector3> points_ = support::placesIn(field_.domain(), 3000);  // some lie outside the domain
};

TEST_P(Hessian, isTheDerivativeOfTheGradient) {
  const auto hessianAt = [&](const Vector3& x) { return field_.valueGradientHessian(x).hessian; };
  const Comparison found = compare(field_, points_, hessianAt);
  std::ostringstream deviation;
  deviation << found.deviation;
  RecordProperty("deviation", deviation.str());
  EXPECT_LT(found.deviation, 1e-6);
  EXPECT_GT(found.curved, 500);
}

TEST_P(Hessian, thatIsSlightlyWrongIsFound) {
  const std::vector<Vector3> some(points_.begin(), points_.begin() + 500);
  for (int entry = 0; entry < 9; ++entry) {
    const auto wrong = [&](const Vector3& x) {
      Matrix3d hessian = field_.valueGradientHessian(x).hessian;
      hessian(entry) *= 1 + 1e-4;
      return hessian;
    };
    EXPECT_GT(compare(field_, some, wrong).deviation, 1e-5) << entry;
  }
}

TEST_P(Hessian, comesWithTheValueAndGradientOfOtherQueries) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity(), kNan = std::numeric_limits<double>::quiet_NaN();
  std::vector<Vector3> points = points_;
  field_.forEachCell([&](const Cell& cell) { points.push_back(cell.box.min()); });
  for (const Vector3& x :
       {Vector3(1e300, 0, -1e300), Vector3(kInfinity, 0, 0), Vector3(kNan, 0, 0), Vector3(0, -kInfinity, kInfinity)})
    points.push_back(x);
  std::vector<ValueGradientHessian> all(points.size());
  field_.valuesGradientsHessians(points, all);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_TRUE(areSame(all[i], field_.valueAndGradient(points[i]))) << points[i].transpose();
    ASSERT_TRUE(areSame(field_.valueGradientHessian(points[i]), field_.valueAndGradient(points[i])));
    if (!points[i].allFinite()) continue;
    ASSERT_EQ(all[i].hessian, all[i].hessian.transpose()) << points[i].transpose();
  }
  EXPECT_TRUE(field_.valueGradientHessian({kInfinity, 0, 0}).hessian.hasNaN());
}

INSTANTIATE_TEST_SUITE_P(Kinds, Hessian,
                         testing::Values("double", "float", "quantized", "wide", "highDegree", "blended",
                                         "blendedQuantized", "exact", "exactBlended", "shell", "overlap"),
                         [](const auto& kind) { return kind.param; });

TEST(Hessians, ofBlendedFieldsHaveTheDerivativesOfTheWeights) {
  const Field sharp = irregular(false), smooth = blended(sharp, 0.2);
  const std::vector<Vector3> points = support::placesIn(smooth.domain(), 3000);
  EXPECT_GT(compare(smooth, points, [&](const Vector3& x) { return sharp.valueGradientHessian(x).hessian; }).deviation,
            1e-2);
}

/// Returns a field of one exact leaf, whose list has all triangles of a mesh in all octants.
Field allExact(const TriangleMesh& mesh) {
  FieldData data;
  data.domain = Box(Vector3::Constant(-2), Vector3::Constant(2));
  data.nodes = {node::exactLeaf(ExactSign::pseudonormal, 0)};
  data.exact.vertices = mesh.vertices;
  data.exact.triangles = mesh.triangles;
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  std::vector<std::uint32_t>& list = data.exact.lists;
  list.assign(TriangleListView::runsAt(count), 0xffffffff);
  list[0] = count;
  for (std::uint32_t first = 0; first < count; first += triangle_run::kMostLength)
    list.push_back(triangle_run::packed(first, std::min(triangle_run::kMostLength, count - first)));
  list.back() |= triangle_run::kLast;
  return Field(std::move(data));
}

TEST(Hessians, ofExactLeavesAreThoseOfPlanesCylindersAndSpheres) {
  for (const double sign : {1.0, -1.0}) {
    const TriangleMesh box = support::boxOfTwo();
    const Field field = allExact(sign > 0 ? box : support::reversed(box));
    const auto expect = [&](const Vector3& x, const Matrix3d& expected) {
      const Matrix3d hessian = field.valueGradientHessian(x).hessian;
      EXPECT_LT((hessian - sign * expected).norm(), 1e-9) << x.transpose() << "\n" << hessian;
    };
    const Vector3 across = Vector3(3, 4, 0).normalized(), corner = Vector3(1, 2, 2) / 3;
    const Matrix3d alongZ = Vector3::UnitZ() * Vector3::UnitZ().transpose();
    const Matrix3d one = Matrix3d::Identity();
    expect({1.1, 0.3, 0.4}, Matrix3d::Zero());
    expect({0.9, 0.3, 0.4}, Matrix3d::Zero());
    expect(Vector3(1, 1, 0.3) + 0.1 * across, (one - alongZ - across * across.transpose()) / 0.1);
    expect(Vector3(1, 1, 1) + 0.2 * corner, (one - corner * corner.transpose()) / 0.2);
    // A side of the box has two triangles, whose common edge does not curve.
    for (const double t : {-0.5, 0.25, 0.5}) {
      expect({1.25, t, t}, Matrix3d::Zero());
      expect({1.25, t, -t}, Matrix3d::Zero());
    }
    // On the surface itself the Hessian is 0, also where it does not exist.
    for (const Vector3& x : {Vector3(1, 0.3, 0.1), Vector3(1, 1, 0.5), Vector3(1, 1, 1)}) expect(x, Matrix3d::Zero());
  }
}

TEST(Hessians, atAVertexWithinAnEdgeAreThoseOfTheEdge) {
  const TriangleMesh mesh = support::boxOfTwo();
  TriangleMesh divided;  // each triangle in four, by the middles of its sides
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    const auto at = [&](const Vector3& x) {
      const auto found = std::ranges::find(divided.vertices, x);
      const auto index = static_cast<std::uint32_t>(found - divided.vertices.begin());
      if (found == divided.vertices.end()) divided.vertices.push_back(x);
      return index;
    };
    const std::uint32_t ab = at((a + b) / 2), bc = at((b + c) / 2), ca = at((c + a) / 2);
    for (const Triangle& part :
         {Triangle{at(a), ab, ca}, Triangle{at(b), bc, ab}, Triangle{at(c), ca, bc}, Triangle{ab, bc, ca}})
      divided.triangles.push_back(part);
  }
  const Field field = allExact(divided);
  const auto hessianAt = [&](const Vector3& x) { return field.valueGradientHessian(x).hessian; };
  const Vector3 across = Vector3(3, 4, 0).normalized(), around(-across.y(), across.x(), 0);
  EXPECT_LT((hessianAt(Vector3(1, 1, 0) + 0.1 * across) - around * around.transpose() / 0.1).norm(), 1e-9);
  EXPECT_LT(hessianAt({1.25, 0, 0}).norm(), 1e-9);
}

TEST(Hessians, outsideOfTheDomainAreThoseOfTheDistanceToIt) {
  const Field field = irregular(false);
  const Vector3 high = field.domain().max(), inside(high.x() - 0.3, high.y() - 0.2, high.z() - 0.1);
  const Vector3 x = high + Vector3(0.3, 0.4, 0), fromEdge(0.6, 0.8, 0);
  Matrix3d expected = (Matrix3d::Identity() - fromEdge * fromEdge.transpose()) / 0.5;
  expected(2, 2) = field.valueGradientHessian(high).hessian(2, 2);
  EXPECT_LT((field.valueGradientHessian(x).hessian - expected).norm(), 1e-12);
  // Beyond a face, the second derivatives along the face remain.
  const Vector3 beyond(high.x() + 1e5, inside.y(), inside.z());
  Matrix3d along = field.valueGradientHessian({high.x(), inside.y(), inside.z()}).hessian;
  along.row(0).setZero();
  along.col(0).setZero();
  EXPECT_EQ(field.valueGradientHessian(beyond).hessian, along);
}

}  // namespace hessian_test
}  // namespace hpsdf
