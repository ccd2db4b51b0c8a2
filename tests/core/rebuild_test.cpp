// Fields of changed meshes: what is kept of the earlier field, and that the rest is as a whole construction makes it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"
#include "rebuild/mesh_change.h"
#include "support/made_meshes.h"

namespace hpsdf {
namespace rebuild_test {

using rebuilding::changeBetween;
using rebuilding::hasHoles;
using rebuilding::MeshChange;
using support::joined;
using support::moved;

/// Pulls the vertices around the one that is farthest in a direction, within `radius`, further in this direction.
TriangleMesh pulled(TriangleMesh mesh, const Vector3& direction, double radius, double height) {
  const Vector3 place =
      *std::ranges::max_element(mesh.vertices, {}, [&](const Vector3& v) { return v.dot(direction); });
  for (Vector3& v : mesh.vertices) {
    const double distance = (v - place).norm() / radius;
    if (distance < 1) v += height * std::pow(1 - distance * distance, 2) * direction;
  }
  return mesh;
}

struct Case {
  TriangleMesh before, after;
  BuildOptions options;
  DistanceOptions signs = {};
};

Box domainOf(const Case& c) { return domainAround(boundingBox(c.before)); }
Field builtBefore(const Case& c) { return build(ExactDistance(c.before, c.signs), domainOf(c), c.options); }

/// Returns the greatest difference between a field and Φ at random points, and their RMS.
std::array<double, 2> errorsOf(const Field& field, const ExactDistance& exact, int count = 20000) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> share(0, 1);
  double greatest = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    Vector3 x;
    for (int axis = 0; axis < 3; ++axis)
      x[axis] = field.domain().min()[axis] + share(random) * field.domain().sizes()[axis];
    const double error = std::abs(field.value(x) - exact(x));
    greatest = std::max(greatest, error);
    squares += error * error;
  }
  return {greatest, std::sqrt(squares / count)};
}

/// Counts the leaves of the new field that have the cell, the degree and all values of a leaf of the earlier one.
std::uint64_t sameLeaves(const Field& before, const Field& now) {
  std::uint64_t same = 0;
  now.forEachCell([&](const Cell& cell) {
    const Vector3 centre = cell.box.center();
    const Cell old = before.cellAt(centre);
    if (old.depth != cell.depth || old.degree != cell.degree) return;
    for (const double u : {0.1, 0.5, 0.83})
      for (const double v : {0.17, 0.6}) {
        const Vector3 x = cell.box.min() + Vector3(u, v, 1 - u * v).cwiseProduct(cell.box.sizes());
        if (before.value(x) != now.value(x)) return;
      }
    ++same;
  });
  return same;
}

const BuildOptions kFine{.targetError = 1e-7, .grid = {4, 4, 4}, .strategy = Strategy::hp};

Case pulledTorus(const BuildOptions& options = kFine) {
  const TriangleMesh torus = shapes::mesh("torus,segments=128,sides=64");
  return {torus, pulled(torus, {0, 1, 0}, 0.16, 0.03), options};
}

TEST(Rebuild, keepsWhatTheChangeDoesNotReach) {
  const Case c = pulledTorus();
  const Field before = builtBefore(c);
  const ExactDistance exact(c.after);
  const RebuiltField rebuilt = rebuild(before, c.before, c.after, exact);
  const Field whole = build(exact, domainOf(c), c.options);
  EXPECT_GT(rebuilt.changedTriangles, 100u);
  EXPECT_GT(rebuilt.kept, rebuilt.leaves * 9 / 10);
  EXPECT_LT(rebuilt.kept, rebuilt.leaves);
  EXPECT_GE(sameLeaves(before, rebuilt.field), rebuilt.kept);
  EXPECT_LT(double(rebuilt.field.metadata().exactEvaluations), 0.15 * double(whole.metadata().exactEvaluations));
  EXPECT_LE(rebuilt.field.metadata().totalError, 1e-7);
  const auto [greatest, rms] = errorsOf(rebuilt.field, exact);
  const auto [greatestOfWhole, rmsOfWhole] = errorsOf(whole, exact);
  EXPECT_LT(rms, 1.1 * rmsOfWhole);
  EXPECT_LT(greatest, 2 * greatestOfWhole);
  // The earlier field is wrong where the torus was pulled, so that the comparison above can fail.
  EXPECT_GT(errorsOf(before, exact)[0], 5 * greatest);
}

/// The steps of quantized coefficients stay, too: a leaf that is kept twice is still the same.
TEST(Rebuild, keepsLeavesAgain) {
  const Case c = pulledTorus();
  const Field before = builtBefore(c);
  ASSERT_EQ(precisionName(before), "quantized");
  const Field once = rebuild(before, c.before, c.after, ExactDistance(c.after)).field;
  const TriangleMesh third = pulled(c.after, {0, -1, 0}, 0.16, 0.03);
  const RebuiltField twice = rebuild(once, c.after, third, ExactDistance(third));
  EXPECT_GE(sameLeaves(once, twice.field), twice.kept);
  EXPECT_GT(sameLeaves(before, twice.field), twice.leaves * 7 / 10);
  EXPECT_EQ(precisionName(twice.field), "quantized");
}

TEST(Rebuild, keepsExactLeaves) {
  BuildOptions options = kFine;
  options.strategy = Strategy::hpx;
  options.targetError = 1e-6;
  const TriangleMesh gear = shapes::mesh("gear");
  Case c{gear, gear, options};
  const Box box = boundingBox(gear);
  for (Vector3& v : c.after.vertices)
    if (v.x() > box.max().x() - 0.02 * box.sizes().x()) v.x() -= 0.01 * box.sizes().x();
  const Field before = builtBefore(c);
  ASSERT_GT(statistics(before).exact.leaves, 100u);
  const ExactDistance exact(c.after);
  const RebuiltField rebuilt = rebuild(before, c.before, c.after, exact);
  EXPECT_GT(rebuilt.kept, rebuilt.leaves / 2);
  EXPECT_GE(sameLeaves(before, rebuilt.field), rebuilt.kept);
  const auto [greatest, rms] = errorsOf(rebuilt.field, exact);
  const auto [greatestOfWhole, rmsOfWhole] = errorsOf(build(exact, domainOf(c), options), exact);
  EXPECT_LT(rms, 1.2 * rmsOfWhole);
  EXPECT_LT(greatest, 2 * greatestOfWhole);
}

TEST(Rebuild, theResultDoesNotDependOnThreads) {
  const Case c = pulledTorus();
  const Field before = builtBefore(c);
  const ExactDistance exact(c.after);
  const Field one = rebuild(before, c.before, c.after, exact, {.threads = 1}).field;
  const Field two = rebuild(before, c.before, c.after, exact, {.threads = 2}).field;
  EXPECT_EQ(one.data().nodes, two.data().nodes);
  EXPECT_EQ(one.data().coefficients, two.data().coefficients);
}

/// Triangles in another order and with other numbers are the same mesh.
TEST(Rebuild, equalMeshesGiveTheSameField) {
  Case c = pulledTorus({.targetError = 1e-5, .grid = {3, 3, 3}});
  c.after = c.before;
  std::ranges::reverse(c.after.triangles);
  for (Triangle& t : c.after.triangles) std::rotate(t.begin(), t.begin() + 1, t.end());
  const Field before = builtBefore(c);
  const RebuiltField rebuilt = rebuild(before, c.before, c.after, ExactDistance(c.after));
  EXPECT_EQ(rebuilt.changedTriangles, 0u);
  EXPECT_EQ(rebuilt.kept, rebuilt.leaves);
  EXPECT_EQ(rebuilt.field.data().nodes, before.data().nodes);
  EXPECT_EQ(rebuilt.field.data().coefficients, before.data().coefficients);
  EXPECT_EQ(rebuilt.field.metadata().source.fingerprint, fingerprint(c.after));
}

/// A change of all triangles leaves nothing, and the result is that of a whole construction.
TEST(Rebuild, withoutAnythingKeptItIsAWholeConstruction) {
  Case c = pulledTorus({.targetError = 1e-5, .grid = {3, 3, 3}});
  for (Vector3& v : c.after.vertices) v *= 0.99;
  const Field before = builtBefore(c);
  const ExactDistance exact(c.after);
  const RebuiltField rebuilt = rebuild(before, c.before, c.after, exact);
  const Field whole = build(exact, before.domain(), c.options);
  EXPECT_EQ(rebuilt.kept, 0u);
  EXPECT_EQ(rebuilt.field.data().nodes, whole.data().nodes);
  EXPECT_EQ(rebuilt.field.data().coefficients, whole.data().coefficients);
}

/// A body that moves leaves the signs inside of another one alone.
TEST(Rebuild, bodiesMayMove) {
  const TriangleMesh ball = shapes::mesh("sphere,subdivisions=4");
  const Case c{joined(ball, moved(ball, {4, 0, 0}, 0.3)), joined(ball, moved(ball, {3.8, 0.5, 0}, 0.3)), kFine};
  const Field before = builtBefore(c);
  const ExactDistance exact(c.after);
  const RebuiltField rebuilt = rebuild(before, c.before, c.after, exact);
  EXPECT_GT(rebuilt.kept, 1000u);
  EXPECT_GE(sameLeaves(before, rebuilt.field), rebuilt.kept);
  EXPECT_LT(errorsOf(rebuilt.field, exact)[0], 0.02);
}

/// A wall around everything, far away, changes winding numbers of points near unchanged triangles.
TEST(Rebuild, signsAreCheckedWhereWindingNumbersDecide) {
  const TriangleMesh ball = shapes::mesh("sphere,subdivisions=2"), small = moved(ball, {0, 0, 0}, 0.2);
  const TriangleMesh half = moved(ball, {0.1, 0, 0}, 0.2);  // overlaps the small one, so that winding numbers decide
  const TriangleMesh around = moved(ball, {0, 0, 0}, 1);
  const TriangleMesh inner = joined(small, half);
  const BuildOptions options{.targetError = 1e-4, .grid = {4, 4, 4}, .strategy = Strategy::hp};
  const Box domain = domainAround(boundingBox(around));
  const Field before = build(ExactDistance(inner), domain, options);
  ASSERT_EQ(before.metadata().source.insideTest, InsideTest::winding);
  const TriangleMesh after = joined(inner, around);
  const ExactDistance exact(after);
  const RebuiltField rebuilt = rebuild(before, inner, after, exact);
  EXPECT_FALSE(rebuilt.signsChange);
  for (const Vector3& x : {Vector3(0.45, 0, 0), Vector3(0, 0.4, 0.1), Vector3(-0.3, 0.2, 0), Vector3(0.1, 0, 0)})
    EXPECT_NEAR(rebuilt.field.value(x), exact(x), 0.02) << x.transpose();
  EXPECT_LT(rebuilt.field.value({0.45, 0, 0}), 0);
  EXPECT_GT(before.value({0.45, 0, 0}), 0);
}

TEST(Rebuild, holesThatWindingNumbersCloseLeaveNothing) {
  const TriangleMesh closed = shapes::mesh("sphere,subdivisions=3");
  TriangleMesh open = closed;
  open.triangles.resize(open.triangles.size() - 8);
  TriangleMesh wider = open;
  wider.triangles.resize(open.triangles.size() - 8);
  const BuildOptions options{.targetError = 1e-5, .grid = {3, 3, 3}, .strategy = Strategy::hp};
  const Box domain = domainAround(boundingBox(open), DomainShape::cube, 0.2);
  const Field before = build(ExactDistance(open), domain, options);
  const ExactDistance exact(wider);
  const RebuiltField rebuilt = rebuild(before, open, wider, exact);
  EXPECT_TRUE(rebuilt.signsChange);
  EXPECT_EQ(rebuilt.kept, 0u);
  EXPECT_EQ(rebuilt.field.data().coefficients, build(exact, domain, options).data().coefficients);
  EXPECT_TRUE(rebuild(before, open, closed, ExactDistance(closed)).signsChange);
}

/// Holes do not matter to a shell, which has no signs.
TEST(Rebuild, shellsMayHaveHoles) {
  const DistanceOptions wall{.insideTest = InsideTest::shell, .thickness = 0.05};
  Case c = pulledTorus({.targetError = 1e-5, .grid = {4, 4, 4}, .strategy = Strategy::hp});
  c.signs = wall;
  for (TriangleMesh* mesh : {&c.before, &c.after})
    std::erase_if(mesh->triangles, [&](const Triangle& t) { return c.before.vertices[t[0]].y() < 0; });
  const Field before = builtBefore(c);
  const ExactDistance exact(c.after, wall);
  const RebuiltField rebuilt = rebuild(before, c.before, c.after, exact);
  EXPECT_FALSE(rebuilt.signsChange);
  EXPECT_GT(rebuilt.changedTriangles, 0u);
  EXPECT_LT(rebuilt.kept, rebuilt.leaves);
  EXPECT_GT(rebuilt.kept, rebuilt.leaves / 2);
  EXPECT_GE(sameLeaves(before, rebuilt.field), rebuilt.kept);
  EXPECT_LT(errorsOf(rebuilt.field, exact)[1], 1.2 * errorsOf(build(exact, domainOf(c), c.options), exact)[1]);
}

/// The space around a mesh is inside if its signed volume is negative, however far from a change.
TEST(Rebuild, anotherOrientationChangesAllSigns) {
  const TriangleMesh inward = support::reversed(moved(shapes::mesh("sphere,subdivisions=3"), {0, 0, 0}, 0.3));
  const TriangleMesh after = joined(inward, moved(shapes::mesh("sphere,subdivisions=1"), {1.2, 0, 0}, 0.6));
  const Box domain = domainAround(boundingBox(after));
  const BuildOptions options{.targetError = 1e-4, .grid = {3, 3, 3}, .strategy = Strategy::hp};
  for (const InsideTest test : {InsideTest::automatic, InsideTest::winding}) {
    const Field before = build(ExactDistance(inward, {.insideTest = test}), domain, options);
    const ExactDistance exact(after, {.insideTest = test});
    const RebuiltField rebuilt = rebuild(before, inward, after, exact);
    EXPECT_TRUE(rebuilt.signsChange);
    EXPECT_LT(before.value({-0.4, 0, 0}), 0);
    EXPECT_GT(rebuilt.field.value({-0.4, 0, 0}), 0);
  }
}

/// Stages after the refinement leave kept leaves alone, and pruning makes the new cells as coarse as the others.
TEST(Rebuild, prunedAndBlendedFields) {
  BuildOptions options = kFine;
  options.targetError = 1e-6;
  options.criterion = Criterion::optimal;
  options.blend = kDefaultBlend;
  const Case c = pulledTorus(options);
  const Field before = builtBefore(c);
  const ExactDistance exact(c.after);
  const RebuiltField rebuilt = rebuild(before, c.before, c.after, exact);
  const Field whole = build(exact, domainOf(c), options);
  EXPECT_GT(rebuilt.kept, rebuilt.leaves / 2);
  EXPECT_EQ(rebuilt.field.data().blend, kDefaultBlend);
  EXPECT_LE(rebuilt.field.metadata().totalError, 1.02e-6);
  EXPECT_LT(double(rebuilt.field.bytes()), 1.1 * double(whole.bytes()));
  EXPECT_LT(errorsOf(rebuilt.field, exact)[1], 1.2 * errorsOf(whole, exact)[1]);
}

/// A field that ended before its target error is not built further than it was.
TEST(Rebuild, aimsAtTheErrorThatWasReached) {
  Case c = pulledTorus();
  c.options.maxSteps = 200;
  const Field before = builtBefore(c);
  ASSERT_GT(before.metadata().totalError, 1e-6);
  const RebuiltField rebuilt = rebuild(before, c.before, c.after, ExactDistance(c.after));
  EXPECT_LE(rebuilt.field.metadata().totalError, 1.02 * before.metadata().totalError);
  EXPECT_LT(statistics(rebuilt.field).leaves, 2 * rebuilt.leaves);
}

/// A body that appears where Φ was smooth has hardly a share in the error of the earlier field.
TEST(Rebuild, bodiesMayAppearInEmptySpace) {
  const TriangleMesh ball = shapes::mesh("sphere,subdivisions=5");
  const Case c{ball,
               joined(ball, moved(shapes::mesh("sphere,subdivisions=3"), {1.2, 1.2, 1.2}, 0.1)),
               {.targetError = 1e-6, .grid = {4, 4, 4}, .strategy = Strategy::hp}};
  const Box domain = domainAround(boundingBox(c.before), DomainShape::cube, 0.5);
  const Field before = build(ExactDistance(c.before), domain, c.options);
  const ExactDistance exact(c.after);
  const RebuiltField rebuilt = rebuild(before, c.before, c.after, exact);
  const Field whole = build(exact, domain, c.options);
  EXPECT_GT(rebuilt.kept, 0u);
  EXPECT_LE(rebuilt.field.metadata().totalError, 1.02e-6);
  EXPECT_LT(statistics(rebuilt.field).leaves, 4 * statistics(whole).leaves);
  EXPECT_LT(errorsOf(rebuilt.field, exact)[1], 1.5 * errorsOf(whole, exact)[1]);
}

std::string errorOf(const Field& field, const TriangleMesh& before, const TriangleMesh& after) {
  try {
    rebuild(field, before, after, ExactDistance(after));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Rebuild, refusesWhatItCannotUpdate) {
  using testing::HasSubstr;
  const TriangleMesh ball = shapes::mesh("sphere,subdivisions=2"), other = moved(ball, {0.01, 0, 0});
  const Box domain = domainAround(boundingBox(ball));
  const auto built = [&](const BuildOptions& options) { return build(ExactDistance(ball), domain, options); };
  const BuildOptions coarse{.targetError = 1e-4, .grid = {2, 2, 2}};
  EXPECT_THAT(errorOf(built(coarse), other, ball), HasSubstr("is not the mesh of the field"));
  EXPECT_THAT(errorOf(built(coarse), ball, moved(ball, {1, 0, 0})), HasSubstr("leaves the domain"));
  BuildOptions options = coarse;
  EXPECT_THAT(errorOf(built({.grid = {2, 2, 2}, .tolerance = 0.01}), ball, other), HasSubstr("within a tolerance"));
  options.maxBytes = 20000;
  EXPECT_THAT(errorOf(built(options), ball, other), HasSubstr("limit of bytes"));
  options = coarse;
  options.continuityWeight = 2.5;
  EXPECT_THAT(errorOf(built(options), ball, other), HasSubstr("weakly continuous"));
}

TEST(MeshChange, findsTrianglesOfOneMeshOnly) {
  const TriangleMesh ball = shapes::mesh("sphere,subdivisions=2");
  EXPECT_TRUE(changeBetween(ball, ball).triangles.triangles.empty());

  TriangleMesh longer = ball;
  longer.vertices[0] *= 1.1;
  const auto around =
      std::ranges::count_if(ball.triangles, [](const Triangle& t) { return std::ranges::find(t, 0u) != t.end(); });
  const MeshChange change = changeBetween(ball, longer);
  EXPECT_EQ(change.removed, std::size_t(around));
  EXPECT_EQ(change.triangles.triangles.size(), std::size_t(2 * around));
  EXPECT_FALSE(hasHoles(longer));

  TriangleMesh twice = ball;  // counts as often as it is there
  twice.triangles.push_back(ball.triangles[5]);
  EXPECT_EQ(changeBetween(ball, twice).triangles.triangles.size(), 1u);
  EXPECT_EQ(changeBetween(twice, ball).removed, 1u);
  EXPECT_TRUE(hasHoles(twice));

  TriangleMesh turned = ball;  // a triangle that faces the other way is another one
  std::swap(turned.triangles[7][1], turned.triangles[7][2]);
  EXPECT_EQ(changeBetween(ball, turned).triangles.triangles.size(), 2u);
  EXPECT_TRUE(hasHoles(turned));
}

}  // namespace rebuild_test
}  // namespace hpsdf
