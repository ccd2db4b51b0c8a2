// Distances of combined solids: against boundaries that are computed here in another way, closed forms, and properties.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/combine/combined_distance.h"
#include "hpsdf/detail/random_points.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/shapes.h"
#include "hpsdf/verify.h"
#include "support/made_meshes.h"
#include "support/random_expression.h"
#include "support/temporary_directory.h"
#include "support/test_mesh.h"

namespace hpsdf {
namespace combine_test {

using namespace combine;
using support::boxBetween;

// ---------------------------------------------------------------------------------------------------------------------
// Brute force: the boundary of Boolean expressions of convex solids, by clipping faces at planes, and the distance to
// all of its triangles.

struct Plane {
  Vector3 normal;
  double offset;

  double heightOf(const Vector3& x) const { return normal.dot(x) - offset; }
};

using Polygon = std::vector<Vector3>;

/// A convex solid, with the planes of its triangles.
struct ConvexSolid {
  TriangleMesh mesh;
  std::vector<Plane> planes = {};

  explicit ConvexSolid(TriangleMesh convex) : mesh(std::move(convex)) {
    for (const Triangle& triangle : mesh.triangles) {
      const auto [a, b, c] = cornersOf(mesh, triangle);
      const Vector3 normal = (b - a).cross(c - a).normalized();
      planes.push_back({normal, normal.dot(a)});
    }
  }

  bool contains(const Vector3& x) const {
    return std::ranges::all_of(planes, [&](const Plane& plane) { return plane.heightOf(x) < 0; });
  }
};

/// Returns the part of a convex polygon above a plane, or below it if `sign` is −1.
Polygon clipped(const Polygon& polygon, const Plane& plane, double sign) {
  Polygon part;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double atA = sign * plane.heightOf(a), atB = sign * plane.heightOf(b);
    if (atA >= 0) part.push_back(a);
    if ((atA > 0 && atB < 0) || (atA < 0 && atB > 0)) part.push_back(a + (b - a) * (atA / (atA - atB)));
  }
  return part.size() < 3 ? Polygon{} : part;
}

/// A Boolean function of whether a point is inside each solid.
using IsInside = std::function<bool(const std::vector<bool>& inside)>;

class BruteForce {
 public:
  BruteForce(std::vector<ConvexSolid> solids, IsInside isInside)
      : solids_(std::move(solids)), isInside_(std::move(isInside)) {
    for (std::size_t s = 0; s < solids_.size(); ++s)
      for (const Triangle& triangle : solids_[s].mesh.triangles) {
        const auto [a, b, c] = cornersOf(solids_[s].mesh, triangle);
        divide({a, b, c}, s, 0, std::vector<bool>(solids_.size()));
      }
  }

  double operator()(const Vector3& x) const {
    double least = std::numeric_limits<double>::infinity();
    for (const Polygon& polygon : boundary_)
      for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
        least = std::min(least, squaredDistance(x, polygon[0], polygon[i], polygon[i + 1]));
    std::vector<bool> inside;
    for (const ConvexSolid& solid : solids_) inside.push_back(solid.contains(x));
    return isInside_(inside) ? -std::sqrt(least) : std::sqrt(least);
  }

 private:
  /// Divides a part of a face of the solid `own` into parts that are inside or outside of each other solid, and keeps
  /// those that have the result on one side.
  void divide(const Polygon& polygon, std::size_t own, std::size_t next, std::vector<bool> inside) {
    if (polygon.empty()) return;
    if (next == own) return divide(polygon, own, next + 1, std::move(inside));
    if (next >= solids_.size()) {
      std::vector<bool> behind = inside;
      behind[own] = true;
      if (isInside_(inside) != isInside_(behind)) boundary_.push_back(polygon);
      return;
    }
    Polygon rest = polygon;
    for (const Plane& plane : solids_[next].planes) {
      divide(clipped(rest, plane, 1), own, next + 1, inside);
      rest = clipped(rest, plane, -1);
    }
    inside[next] = true;
    divide(rest, own, next + 1, std::move(inside));
  }

  static double squaredToSegment(const Vector3& x, const Vector3& a, const Vector3& b) {
    const Vector3 along = b - a;
    const double squared = along.squaredNorm();
    const double t = squared > 0 ? std::clamp((x - a).dot(along) / squared, 0.0, 1.0) : 0;
    return (a + t * along - x).squaredNorm();
  }

  static double squaredDistance(const Vector3& x, const Vector3& a, const Vector3& b, const Vector3& c) {
    const Vector3 normal = (b - a).cross(c - a);
    const bool projectsInside =
        normal.cross(b - a).dot(x - a) > 0 && normal.cross(c - b).dot(x - b) > 0 && normal.cross(a - c).dot(x - c) > 0;
    if (projectsInside) {
      const double height = normal.dot(x - a);
      return height * height / normal.squaredNorm();
    }
    return std::min({squaredToSegment(x, a, b), squaredToSegment(x, b, c), squaredToSegment(x, c, a)});
  }

  std::vector<ConvexSolid> solids_;
  IsInside isInside_;
  std::vector<Polygon> boundary_;
};

TriangleMesh sphere(double radius, int subdivisions) {
  return shapes::mesh("sphere,radius=" + std::to_string(radius) + ",subdivisions=" + std::to_string(subdivisions));
}

TriangleMesh turned(TriangleMesh mesh, double degrees) {
  const Eigen::AngleAxisd turn(degrees * std::numbers::pi / 180, Vector3(1, 2, 3).normalized());
  for (Vector3& vertex : mesh.vertices) vertex = turn * vertex;
  return mesh;
}

struct BooleanCase {
  std::string name;
  std::vector<TriangleMesh> solids;
  std::function<Expression(const std::vector<TriangleMesh>& solids)> expression;
  IsInside isInside;
};

void PrintTo(const BooleanCase& one, std::ostream* out) { *out << one.name; }

std::vector<BooleanCase> booleanCases() {
  const TriangleMesh box = boxBetween({-1, -0.8, -0.6}, {0.9, 0.7, 0.8});
  const TriangleMesh other = support::moved(turned(box, 40), {0.7, 0.5, 0.3});
  const TriangleMesh ball = support::moved(turned(sphere(0.7, 2), 17), {0.4, 0.2, 0.3});
  const TriangleMesh pin = turned(boxBetween({-0.2, -0.25, -3}, {0.2, 0.15, 3}), 25);
  return {
      {"union",
       {box, other},
       [](const auto& s) { return unite(s[0], s[1]); },
       [](const auto& in) { return in[0] || in[1]; }},
      {"intersection",
       {box, ball},
       [](const auto& s) { return intersect(s[0], s[1]); },
       [](const auto& in) { return in[0] && in[1]; }},
      {"difference",
       {box, ball},
       [](const auto& s) { return subtract(s[0], s[1]); },
       [](const auto& in) { return in[0] && !in[1]; }},
      {"three",
       {box, ball, pin},
       [](const auto& s) { return subtract(unite(s[0], s[1]), s[2]); },
       [](const auto& in) { return (in[0] || in[1]) && !in[2]; }},
      {"four",
       {box, other, ball, pin},
       [](const auto& s) { return unite(subtract(s[0], s[1], s[2]), intersect(s[1], s[2], s[3])); },
       [](const auto& in) { return (in[0] && !in[1] && !in[2]) || (in[1] && in[2] && in[3]); }},
  };
}

class BooleanOfMeshes : public testing::TestWithParam<BooleanCase> {};

TEST_P(BooleanOfMeshes, hasTheDistanceToItsBoundary) {
  const BooleanCase& one = GetParam();
  const CombinedDistance distance(one.expression(one.solids));
  EXPECT_EQ(distance.exactness(), Exactness::everywhere);
  std::vector<ConvexSolid> solids;
  for (const TriangleMesh& mesh : one.solids) solids.emplace_back(mesh);
  const BruteForce exact(std::move(solids), one.isInside);
  const std::vector<Vector3> places = support::placesIn(Box(Vector3(-1.5, -1.5, -1.5), Vector3(2, 2, 2)), 10'000);
  std::vector<double> values(places.size());
  distance(places, values);
  double greatest = 0;
  int inside = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    greatest = std::max(greatest, std::abs(values[i] - exact(places[i])));
    inside += values[i] < 0;
  }
  EXPECT_LT(greatest, 1e-12);
  EXPECT_GT(inside, 100);
}

INSTANTIATE_TEST_SUITE_P(Cases, BooleanOfMeshes, testing::ValuesIn(booleanCases()),
                         [](const auto& one) { return one.param.name; });

/// Returns the greatest difference of two distances at random places around the box [-1, 1]³.
template <typename One, typename Other>
double greatestDifference(const One& one, const Other& other, double reach = 2, int count = 4000) {
  double greatest = 0;
  const Box box(Vector3::Constant(-reach), Vector3::Constant(reach));
  for (const Vector3& x : support::placesIn(box, count)) greatest = std::max(greatest, std::abs(one(x) - other(x)));
  return greatest;
}

TEST(Combine, coincidentFacesVanish) {
  const auto boxDistance = [](const Vector3& low, const Vector3& high) {
    return [low, high](const Vector3& x) { return shapes::boxDistance(x - (low + high) / 2, (high - low) / 2); };
  };
  const TriangleMesh left = boxBetween({-1, -1, -1}, {0, 1, 1}), right = boxBetween({0, -1, -1}, {1, 1, 1});
  const TriangleMesh whole = support::boxOfTwo();
  const auto wholeDistance = boxDistance({-1, -1, -1}, {1, 1, 1});
  EXPECT_LT(greatestDifference(CombinedDistance(unite(left, right)), wholeDistance), 1e-12);
  EXPECT_LT(greatestDifference(CombinedDistance(unite(whole, left)), wholeDistance), 1e-12);
  EXPECT_LT(greatestDifference(CombinedDistance(unite(whole, whole)), wholeDistance), 1e-12);
  EXPECT_LT(greatestDifference(CombinedDistance(intersect(whole, whole)), wholeDistance), 1e-12);
  EXPECT_LT(greatestDifference(CombinedDistance(subtract(whole, right)), boxDistance({-1, -1, -1}, {0, 1, 1})), 1e-12);
  // The same where the common plane is oblique, so that rounding decides on which side of each other the faces are.
  const auto oblique = [](const TriangleMesh& mesh) { return rotated(mesh, {1, 2, 3}, 33); };
  EXPECT_LT(greatestDifference(CombinedDistance(rotated(unite(oblique(left), oblique(right)), {1, 2, 3}, -33)),
                               wholeDistance),
            1e-12);
}

/// On the plane where two operands touch, a point is on the surface of each and in neither, yet deep inside their
/// union.
TEST(Combine, pointsWhereOperandsTouchAreInside) {
  const TriangleMesh left = boxBetween({-1, -1, -1}, {0, 1, 1}), right = boxBetween({0, -1, -1}, {1, 1, 1});
  TriangleMesh overlapping = boxBetween({-1, -1, -1}, {0.5, 1, 1});
  const TriangleMesh other = boxBetween({0, -1, -1}, {1, 1, 1});
  for (const Triangle& t : other.triangles) overlapping.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  overlapping.vertices.insert(overlapping.vertices.end(), other.vertices.begin(), other.vertices.end());
  std::vector<Vector3> lattice;
  for (int n = 0; n < 17 * 17 * 17; ++n)
    lattice.emplace_back(Vector3(n % 17 - 8, n / 17 % 17 - 8, n / 289 - 8) / 8 * 0.9375);
  for (const double degrees : {0.0, 33.0})
    for (const Expression& solid : {unite(left, right), Expression(overlapping)}) {
      const CombinedDistance combined(rotated(unite(solid, boxBetween({3, 3, 3}, {4, 4, 4})), {1, 2, 3}, degrees));
      std::vector<Vector3> places;
      for (const Vector3& x : lattice)
        places.push_back(Eigen::AngleAxisd(degrees * M_PI / 180, Vector3(1, 2, 3).normalized()) * x);
      std::vector<double> values(places.size());
      combined(places, values);
      for (std::size_t i = 0; i < places.size(); ++i) {
        const double exact = shapes::boxDistance(lattice[i], Vector3::Ones());
        EXPECT_NEAR(values[i], exact, 1e-12) << lattice[i].transpose();
        EXPECT_NEAR(combined(places[i]), exact, 1e-12) << lattice[i].transpose();
      }
    }
}

TEST(Combine, nothingLeftIsRefused) {
  const TriangleMesh box = support::boxOfTwo();
  const auto refusal = [](const Expression& expression) -> std::string {
    try {
      CombinedDistance distance(expression);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(subtract(box, box)), testing::HasSubstr("nothing is left"));
  EXPECT_THAT(refusal(intersect(box, moved(box, {5, 0, 0}))), testing::HasSubstr("nothing is left"));
  EXPECT_THAT(refusal(Expression::named("a.obj")), testing::HasSubstr("stands for nothing"));
  const auto stretched = [](Expression solid, int times, double factor) {
    for (int i = 0; i < times; ++i) solid = scaled(solid, factor);
    return solid;
  };
  EXPECT_THAT(refusal(stretched(box, 20, 1e12)), testing::HasSubstr("beyond 1e100"));
  EXPECT_THAT(refusal(stretched(box, 20, 1e-12)), testing::HasSubstr("below 1e-100"));
  EXPECT_THAT(refusal(unite(box, stretched(box, 1, 1e-10))), testing::HasSubstr("which rounding spoils beside"));
}

TEST(CombinedDistance, functionsThatAreKnownInABoxEndAtItsWalls) {
  const Box domain(Vector3(-1, -1, -1), Vector3(1, 1, 1));
  // The ball around (1, 0, 0) is known up to x = 1. Beyond the domain, the function answers what must not be used.
  const DistanceFunction ball(
      [&](const Vector3& x) { return domain.contains(x) ? (x - Vector3(1, 0, 0)).norm() - 0.5 : -1e9; },
      {.name = "ball.vti",
       .box = Box(Vector3(0.5, -0.5, -0.5), Vector3(1.5, 0.5, 0.5)),
       .exactness = Exactness::nowhere});
  const CombinedDistance distance(moved(Expression::within(domain, ball), {5, 0, 0}));
  EXPECT_EQ(distance.exactness(), Exactness::nowhere);
  EXPECT_TRUE(distance.source().box.isApprox(Box(Vector3(5.5, -0.5, -0.5), Vector3(6, 0.5, 0.5))));
  EXPECT_NEAR(distance({5.4, 0, 0}), 0.1, 1e-12);
  EXPECT_NEAR(distance({5.9, 0, 0}), -0.1, 1e-12) << "the wall is the surface";
  EXPECT_NEAR(distance({7, 0, 0}), 1, 1e-12);
  EXPECT_NEAR(distance({5, 3, 0}), std::hypot(2, std::sqrt(2) - 0.5), 1e-12);
}

TEST(CombinedDistance, aMeshThatIsNamedTwiceInOnePlaceCountsOnce) {
  const Expression box = shapes::mesh("box"), other = moved(box, {0.3, 0.2, 0.1});
  const CombinedDistance once(unite(box, other)), thrice(unite(box, other, box, intersect(other, other)));
  EXPECT_EQ(once.bytes(), thrice.bytes());
  EXPECT_EQ(once.boundary()->triangles, thrice.boundary()->triangles);
  EXPECT_EQ(CombinedDistance(unite(box, box)).boundary()->triangles, shapes::mesh("box").triangles);
}

TEST(CombinedDistance, refusesSolidsThatAreMovedTooFarForTheirSize) {
  const DistanceFunction ball = shapes::analytic("sphere");
  const auto load = [&](const std::string& name) -> Expression {
    if (name == "ball") return ball;
    return shapes::mesh("box");
  };
  const auto refusal = [&](const std::string& text) -> std::string {
    try {
      const CombinedDistance distance(withOperands(parseExpression(text), load));
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  };
  EXPECT_EQ(refusal("union(a, move(b, 1e6, 0, 0))"), "");
  EXPECT_THAT(refusal("union(a, move(b, 1e17, 0, 0))"),
              testing::StartsWith("expression: column 15: b: moves and scales put it at coordinates of 1e+17"));
  EXPECT_THAT(refusal("union(a, offset(b, 0.1), move(a, 1e12, 0, 0))"),
              testing::StartsWith("expression: column 31: a: "));
  EXPECT_THAT(refusal("move(ball, 0, 1e17, 0)"), testing::StartsWith("expression: column 6: ball: moves and scales"));
}

TEST(Combine, meshThatIntersectsItselfCountsAsItsOuterSurface) {
  const TriangleMesh one = sphere(0.8, 3), other = support::moved(turned(one, 20), {0.6, 0.2, 0.1});
  const CombinedDistance joined(Expression(support::joined(one, other)));
  EXPECT_EQ(joined.exactness(), Exactness::everywhere);
  EXPECT_LT(greatestDifference(joined, CombinedDistance(unite(one, other))), 1e-12);
}

TEST(Combine, transformsApplyFromTheInsideOut) {
  const Expression box = boxBetween({0, 0, 0}, {1, 1, 1});
  const CombinedDistance placed(moved(rotated(scaled(box, 2), {0, 0, 1}, 90), {0, 0, 3}));
  const auto expected = [](const Vector3& x) {
    return shapes::boxDistance(x - Vector3(-1, 1, 4), Vector3::Constant(1));
  };
  EXPECT_LT(greatestDifference(placed, expected, 5), 1e-14);
  const DistanceFunction function = [](const Vector3& x) {
    return shapes::boxDistance(x - Vector3::Constant(0.5), Vector3::Constant(0.5));
  };
  const CombinedDistance same(moved(rotated(scaled(function, 2), {0, 0, 1}, 90), {0, 0, 3}));
  EXPECT_LT(greatestDifference(same, expected, 5), 1e-14);
}

// ---------------------------------------------------------------------------------------------------------------------
// Closed forms

TEST(Combine, exactnessFollowsTheOperands) {
  const Expression box = shapes::analytic("box"), ball = shapes::analytic("sphere");
  const Expression field =
      build(shapes::analytic("sphere"), Box(Vector3::Constant(-2), Vector3::Constant(2)), {.targetError = 1e-2});
  const auto exactnessOf = [](const Expression& expression) { return CombinedDistance(expression).exactness(); };
  EXPECT_EQ(exactnessOf(box), Exactness::everywhere);
  EXPECT_EQ(exactnessOf(unite(box, ball)), Exactness::outside);
  EXPECT_EQ(exactnessOf(intersect(box, ball)), Exactness::inside);
  EXPECT_EQ(exactnessOf(subtract(box, ball)), Exactness::inside);
  EXPECT_EQ(exactnessOf(subtract(box, intersect(box, ball))), Exactness::nowhere);
  EXPECT_EQ(exactnessOf(offset(unite(box, ball), 0.1)), Exactness::outside);
  EXPECT_EQ(exactnessOf(offset(unite(box, ball), -0.1)), Exactness::nowhere);
  EXPECT_EQ(exactnessOf(offset(box, -0.1)), Exactness::inside);
  EXPECT_EQ(exactnessOf(shell(box, 0.1)), Exactness::outside);
  EXPECT_EQ(exactnessOf(shell(unite(box, ball), 0.1)), Exactness::nowhere);
  EXPECT_EQ(exactnessOf(smoothUnite(0.1, {box, ball})), Exactness::nowhere);
  EXPECT_EQ(exactnessOf(field), Exactness::nowhere);
  EXPECT_EQ(exactnessOf(unite(box, field)), Exactness::nowhere);
  EXPECT_EQ(exactnessOf(unite(support::boxOfTwo(), sphere(0.5, 2))), Exactness::everywhere);
  EXPECT_EQ(exactnessOf(support::openBox()), Exactness::nowhere);
  EXPECT_EQ(CombinedDistance(support::boxOfTwo(), {.insideTest = InsideTest::pseudonormal}).exactness(),
            Exactness::nowhere);
  EXPECT_EQ(CombinedDistance(support::boxOfTwo(), {.insideTest = InsideTest::winding}).exactness(),
            Exactness::everywhere);
  EXPECT_EQ(exactnessOf(DistanceFunction(CombinedDistance(unite(box, ball)))), Exactness::outside);
}

TEST(Combine, fingerprintsTellContentsFromEachOther) {
  const TriangleMesh box = shapes::mesh("box"), other = shapes::mesh("box,height=1.4");
  const Field field = build(shapes::analytic("sphere"), domainAround(boundingBox(box)), {.maxSteps = 2});
  const Field finer = build(shapes::analytic("sphere"), domainAround(boundingBox(box)), {.maxSteps = 9});
  EXPECT_EQ(fingerprint(Expression(box)), fingerprint(box));
  EXPECT_EQ(fingerprint(combine::unite(box, field)), fingerprint(combine::unite(Expression(box).renamed("b"), field)));
  const std::vector<Expression> all = {box,
                                       other,
                                       combine::unite(box, field),
                                       combine::unite(other, field),
                                       combine::unite(box, finer),
                                       combine::unite(field, box),
                                       combine::intersect(box, field),
                                       combine::offset(box, 0.1),
                                       combine::offset(box, 0.2),
                                       combine::shell(box, 0.1),
                                       combine::shell(box, 0.1, ShellSide::inward),
                                       combine::offset(shapes::analytic("sphere"), 0.1),
                                       combine::offset(shapes::analytic("torus"), 0.1)};
  std::set<std::uint64_t> found;
  for (const Expression& expression : all) found.insert(fingerprint(expression));
  EXPECT_EQ(found.size(), all.size());
  EXPECT_EQ(CombinedDistance(all[2]).source().fingerprint, fingerprint(all[2]));
}

TEST(Combine, shellsHaveTheirMaterialOnTheSide) {
  const DistanceFunction ball = [](const Vector3& x) { return x.norm() - 1; };
  const auto radii = [&](ShellSide side) {
    const CombinedDistance wall(shell(ball, 0.2, side));
    EXPECT_NEAR(wall(Vector3(3, 0, 0)), 2 - 0.1 * static_cast<int>(side), 1e-14);
    std::vector<bool> inside;
    for (const double radius : {0.75, 0.85, 0.95, 1.05, 1.15, 1.25}) inside.push_back(wall(Vector3(0, radius, 0)) < 0);
    return inside;
  };
  EXPECT_EQ(radii(ShellSide::inward), (std::vector{false, true, true, false, false, false}));
  EXPECT_EQ(radii(ShellSide::centred), (std::vector{false, false, true, true, false, false}));
  EXPECT_EQ(radii(ShellSide::outward), (std::vector{false, false, false, true, true, false}));
}

TEST(Combine, smoothUnionIsLowerByAQuarterOfItsRadius) {
  const DistanceFunction ball = [](const Vector3& x) { return x.norm() - 1; };
  const CombinedDistance sharp(unite(ball, ball)), smooth(smoothUnite(0.4, {ball, ball}));
  EXPECT_NEAR(smooth(Vector3(2, 0, 0)), sharp(Vector3(2, 0, 0)) - 0.1, 1e-14);
  const CombinedDistance far(smoothUnite(0.4, {ball, moved(ball, {9, 0, 0})}));
  EXPECT_EQ(far(Vector3(1.5, 0, 0)), 0.5);
  const CombinedDistance cut(smoothSubtract(0.4, {ball, ball})), common(smoothIntersect(0.4, {ball, ball}));
  EXPECT_NEAR(common(Vector3(2, 0, 0)), 1.1, 1e-14);
  EXPECT_NEAR(cut(Vector3(1, 0, 0)), 0.1, 1e-14);
}

/// The distance to the union of two balls of radius 0.7 about (±0.4, 0, 0), exact on both sides.
double twoBalls(const Vector3& x) {
  constexpr double kRadius = 0.7, kAside = 0.4;
  const double along = std::abs(x.x()), across = std::hypot(x.y(), x.z());
  const double rim = std::sqrt(kRadius * kRadius - kAside * kAside);  // radius of the circle in which the spheres meet
  const double toSphere = std::hypot(along - kAside, across) - kRadius;
  // The nearest point of the nearer sphere is beyond the plane between them unless the point is within a cone there.
  const bool facesRim = (kAside - along) * rim > across * kAside && along <= kAside;
  if (toSphere < 0 && facesRim) return -std::hypot(along, across - rim);
  return toSphere;
}

struct Accuracy {
  double rms = 0, inside = 0;  ///< RMS error over the domain and over its points inside, over the estimate
};

/// Builds a field and compares it with a closed form at random points. The errors are multiples of the RMS error that
/// the target error stands for, which depends on the size of the surface.
Accuracy accuracyOf(const DistanceFunction& distance, const std::function<double(const Vector3&)>& closedForm) {
  const Box domain(Vector3::Constant(-1.25), Vector3::Constant(1.25));
  const Field field = build(distance, domain, {.targetError = 1e-7});
  detail::Random random(3, 0);
  double squares = 0, squaresInside = 0;
  int inside = 0;
  constexpr int kPoints = 40'000;
  for (int i = 0; i < kPoints; ++i) {
    const Vector3 x = random.inBox(domain);
    const double wanted = closedForm(x), error = field.value(x) - wanted;
    squares += error * error;
    if (wanted < 0) squaresInside += error * error, ++inside;
  }
  const double estimate = field.metadata().rmsEstimate(domain);
  return {std::sqrt(squares / kPoints) / estimate, std::sqrt(squaresInside / inside) / estimate};
}

/// The errors of combinations keep to their target error as those of a sphere do.
TEST(Combine, fieldsAreAsAccurateAsASpheresAtTheSameTarget) {
  const auto ballFunction = [](const Vector3& x) { return x.norm() - 0.7; };
  const DistanceFunction ball(ballFunction, Source{.box = Box(Vector3::Constant(-0.7), Vector3::Constant(0.7))});
  const double ofSphere = accuracyOf(ball, ballFunction).rms;

  const TriangleMesh fine = sphere(0.7, 5);
  const Expression balls = unite(moved(fine, {0.4, 0, 0}), moved(fine, {-0.4, 0, 0}));
  const Accuracy ofUnion = accuracyOf(CombinedDistance(balls), twoBalls);
  EXPECT_LT(ofUnion.rms, 1.5 * ofSphere);
  EXPECT_LT(ofUnion.inside, 2 * ofSphere);

  const Accuracy ofShell =
      accuracyOf(CombinedDistance(shell(shapes::analytic("torus,major=0.7,minor=0.3"), 0.1)),
                 [](const Vector3& x) { return std::abs(shapes::torusDistance(x, 0.7, 0.3)) - 0.05; });
  EXPECT_LT(ofShell.rms, 1.5 * ofSphere);

  const Accuracy ofOffset =
      accuracyOf(CombinedDistance(offset(boxBetween({-0.7, -0.5, -0.4}, {0.7, 0.5, 0.4}), 0.2)), [](const Vector3& x) {
        return shapes::boxDistance(x, {0.7, 0.5, 0.4}) - 0.2;
      });
  EXPECT_LT(ofOffset.rms, 1.5 * ofSphere);
  RecordProperty("sphere", std::to_string(ofSphere));
  RecordProperty("union", std::to_string(ofUnion.rms));
  RecordProperty("union-inside", std::to_string(ofUnion.inside));
  RecordProperty("shell", std::to_string(ofShell.rms));
  RecordProperty("offset", std::to_string(ofOffset.rms));
}

// ---------------------------------------------------------------------------------------------------------------------
// Fields, gradients and other properties

TEST(Combine, fieldsAreLowerBoundsBeyondTheirDomains) {
  const auto ballFunction = [](const Vector3& x) { return x.norm() - 0.7; };
  const Expression field = build(ballFunction, Box(Vector3::Constant(-1), Vector3::Constant(1)), {.targetError = 1e-8});
  const CombinedDistance united(unite(moved(field, {-2, 0, 0}), moved(field, {2, 0, 0})));
  for (const Vector3& x : support::placesIn(Box(Vector3(-4, -2, -2), Vector3(4, 2, 2)), 5000)) {
    const double exact = std::min((x - Vector3(2, 0, 0)).norm(), (x + Vector3(2, 0, 0)).norm()) - 0.7;
    if (exact < 0) continue;
    EXPECT_LT(united(x), exact + 1e-3);
    EXPECT_GT(united(x), 0.7 * exact - 1e-3);
  }
  const Box box = united.source().box;
  EXPECT_TRUE(box.contains(Box(Vector3(-2.7, -0.7, -0.7), Vector3(2.7, 0.7, 0.7))));
}

TEST(Combine, fieldsEndAtTheWallsOfTheirDomains) {
  const auto ballFunction = [](const Vector3& x) { return x.norm() - 0.7; };
  const Field half = build(ballFunction, Box(Vector3(-1, -1, -1), Vector3(0.2, 1, 1)), {.targetError = 1e-9});
  const CombinedDistance grown(offset(half, 0.1));
  EXPECT_NEAR(grown({0.1, 0, 0}), -0.1 - 0.1, 1e-3) << "the wall is the nearest surface";
  EXPECT_NEAR(grown({0.5, 0.1, 0}), 0.3 - 0.1, 1e-12) << "outside the wall";
  EXPECT_NEAR(grown({-0.9, 0, 0}), 0.2 - 0.1, 1e-3) << "the ball";
  const ValueAndGradient atWall = [&] {
    const Vector3 x(0.15, 0.05, 0);
    double value = 0;
    Vector3 gradient;
    grown.withGradients({&x, 1}, {&value, 1}, {&gradient, 1});
    return ValueAndGradient{value, gradient};
  }();
  EXPECT_EQ(atWall.gradient, Vector3(1, 0, 0));
  EXPECT_NEAR(grown.source().box.max().x(), 0.3, 1e-9);
}

std::vector<Expression> someSolids() {
  return {support::moved(turned(sphere(0.6, 2), 10), {0.1, 0, 0}), turned(support::boxOfTwo(), 30),
          shapes::mesh("torus,segments=24,sides=12"), shapes::mesh("gear")};
}

/// Returns the values of a Boolean expression of placed leaves by minimum and maximum.
std::vector<double> byValues(const Expression& part, std::span<const Vector3> places) {
  const Expression::Node& node = part.node();
  std::vector<double> values(places.size());
  const bool isBoolean = node.operation == Operation::unite || node.operation == Operation::intersect ||
                         node.operation == Operation::subtract;
  if (!isBoolean) {
    CombinedDistance distance(part);
    distance(places, values);
    return values;
  }
  values = byValues(node.operands[0], places);
  for (std::size_t k = 1; k < node.operands.size(); ++k) {
    const std::vector<double> others = byValues(node.operands[k], places);
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = node.operation == Operation::unite       ? std::min(values[i], others[i])
                  : node.operation == Operation::intersect ? std::max(values[i], others[i])
                                                           : std::max(values[i], -others[i]);
  }
  return values;
}

/// Compares a Boolean expression of meshes with its values by minimum and maximum: these are 0 at all corners of the
/// boundary. At other places signs agree, magnitudes are no less, and are the distances to the boundary. Returns the
/// number of places inside.
int expectBoolean(const Expression& expression, const CombinedDistance& combined, std::span<const Vector3> places) {
  const ExactDistance toBoundary(*combined.boundary(), {.insideTest = InsideTest::pseudonormal});
  std::vector<double> values(places.size()), magnitudes(places.size());
  combined(places, values);
  toBoundary(places, magnitudes);
  const std::vector<double> bounds = byValues(expression, places);
  const auto isBeside = [](double value) { return std::abs(value) > 1e-12; };
  EXPECT_EQ(std::ranges::count_if(byValues(expression, combined.boundary()->vertices), isBeside), 0);
  int wrong = 0, inside = 0, nearer = 0, different = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    inside += values[i] < 0;
    wrong += (values[i] < 0) != (bounds[i] < 0) && std::abs(values[i]) > 1e-12;
    nearer += std::abs(values[i]) < std::abs(bounds[i]) - 1e-12;
    different += std::abs(values[i]) != std::abs(magnitudes[i]);
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(nearer, 0);
  EXPECT_EQ(different, 0);
  return inside;
}

TEST(Combine, randomBooleansHaveTheSignsOfTheirOperands) {
  int refused = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Expression expression = randomExpression(seed, someSolids(), {.isBooleanOnly = true});
    try {
      const CombinedDistance combined(expression);
      expectBoolean(expression, combined, support::placesIn(combined.source().box, 500, seed));
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("nothing is left"));
      ++refused;
    }
  }
  EXPECT_LT(refused, 6);
}

TEST(Combine, gradientsLeadToTheSurfaceAndValuesAreLipschitz) {
  const Expression a = turned(sphere(0.8, 3), 10), b = moved(support::boxOfTwo(), {0.8, 0.3, 0.2});
  const Expression field = build([](const Vector3& x) { return x.norm() - 0.7; },
                                 Box(Vector3::Constant(-1), Vector3::Constant(1)), {.targetError = 1e-10});
  for (const Expression& expression :
       {unite(a, b), subtract(b, a), offset(intersect(a, b), 0.1), shell(unite(a, b), 0.2, ShellSide::inward),
        smoothUnite(0.3, {a, b}), smoothSubtract(0.2, {rotated(scaled(field, 1.5), {1, 1, 0}, 50), b})}) {
    SCOPED_TRACE(textOf(expression));
    const CombinedDistance distance(expression);
    ASSERT_TRUE(distance.hasGradients());
    const std::vector<Vector3> places = support::placesIn(Box(Vector3::Constant(-2), Vector3::Constant(2)), 2000);
    std::vector<double> values(places.size()), again(places.size());
    std::vector<Vector3> gradients(places.size());
    distance.withGradients(places, values, gradients);
    distance(places, again);
    EXPECT_EQ(values, again);
    int steep = 0, wrong = 0;
    constexpr double kStep = 1e-6;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (i > 0) steep += std::abs(values[i] - values[i - 1]) > (places[i] - places[i - 1]).norm() + 1e-4;
      const Vector3 direction = Vector3(0.3, -0.5, 0.8).normalized();
      const double slope =
          (distance(places[i] + kStep * direction) - distance(places[i] - kStep * direction)) / (2 * kStep);
      wrong += std::abs(slope - gradients[i].dot(direction)) > 1e-4;
    }
    EXPECT_EQ(steep, 0);
    EXPECT_LT(wrong, 20);  // a few places lie at kinks
  }
}

TEST(Combine, resultsDoNotDependOnThreadsAndFilesKeepTheExactness) {
  const Expression expression = subtract(unite(sphere(0.7, 3), moved(turned(sphere(0.7, 3), 30), {0.5, 0.1, 0})),
                                         boxBetween({-0.2, -0.2, -2}, {0.3, 0.3, 2}));
  const auto fieldWith = [&](int threads) {
    const CombinedDistance distance(expression, {.threads = threads});
    return build(distance, domainAround(distance.source().box, DomainShape::cube, 0.1),
                 {.targetError = 1e-4, .threads = threads});
  };
  const Field one = fieldWith(1), three = fieldWith(3);
  EXPECT_EQ(one.data().nodes, three.data().nodes);
  EXPECT_EQ(one.data().coefficients, three.data().coefficients);
  const support::TemporaryDirectory folder;
  for (const bool compress : {false, true}) {
    const auto file = folder.path() / "c.hpsdf";
    save(one, file, {.compress = compress});
    const Field loaded = load(file);
    EXPECT_EQ(loaded.metadata().source.exactness, Exactness::everywhere);
    EXPECT_EQ(loaded.metadata().source.name, textOf(expression));
    EXPECT_EQ(loaded.data().nodes, one.data().nodes);
  }
  save(build([](const Vector3& x) { return x.norm() - 0.5; }, one.domain(), {.targetError = 1e-2}),
       folder.path() / "p");
  EXPECT_EQ(load(folder.path() / "p").metadata().source.exactness, std::nullopt);
}

// ---------------------------------------------------------------------------------------------------------------------
// Meshes of the collection

TEST(Combine, meshesOfTheCollection) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const auto meshOf = [](const char* name) { return normalized(importMesh(support::testMesh(name)).mesh); };
  const TriangleMesh bunny = meshOf("paper/bunny_69k.obj");
  for (const Expression& expression : {subtract(meshOf("cad/fandisk.obj"), moved(sphere(0.4, 5), {0.3, 0.1, 0.05})),
                                       unite(bunny, moved(rotated(bunny, {1, 2, 3}, 70), {0.2, 0.1, 0}))}) {
    SCOPED_TRACE(textOf(expression));
    const CombinedDistance combined(expression);
    EXPECT_GT(expectBoolean(expression, combined, support::placesIn(combined.source().box, 4000)), 200);
  }
}

}  // namespace combine_test
}  // namespace hpsdf
