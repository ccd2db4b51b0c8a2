// Tests what measures and changes finished fields on fields with exact leaves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "basis/projection.h"
#include "field/query/evaluate.h"
#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/cubic_grid.h"
#include "hpsdf/detail/face_steps.h"
#include "hpsdf/detail/line.h"
#include "hpsdf/detail/triangle_list.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/jumps.h"
#include "hpsdf/safe_distance.h"
#include "hpsdf/shapes.h"
#include "hpsdf/verify.h"
#include "support/made_meshes.h"

namespace hpsdf {
namespace exact_leaf_analysis_test {

using support::placesIn;

/// Returns options for small fields whose exact leaves have polynomials of unequal degree and depth beside them.
BuildOptions hpx(double target = 1e-4) {
  return {.targetError = target,
          .grid = {3, 3, 3},
          .maxDegree = 4,
          .strategy = Strategy::hpx,
          .exactTriangles = 32,
          .coefficients = CoefficientType::float64};
}

struct Built {
  explicit Built(const BuildOptions& options = hpx(), const std::string& shape = "gear,teeth=4,segments=2",
                 const Vector3& at = {0, 0, 0})
      : mesh(support::moved(shapes::mesh(shape), at)), exact(mesh), field(build(exact, domainAround(mesh), options)) {}

  TriangleMesh mesh;
  ExactDistance exact;
  Field field;
};

bool isExact(const Field& field, std::uint32_t cell) { return node::isExact(field.data().nodes[cell]); }

/// Counts the interfaces of each kind by the number of their exact sides.
std::array<int, 3> kindsOf(const Field& field, const Jumps& jumps) {
  std::array<int, 3> kinds{};
  for (const Interface& face : jumps.interfaces)
    ++kinds[int(isExact(field, face.cells[0])) + int(isExact(field, face.cells[1]))];
  return kinds;
}

TEST(ExactLeafJumps, areMeasuredByPoints) {
  for (const double blend : {0.0, 0.1}) {
    const Field field = blended(Built().field, blend);
    const Jumps jumps = findJumps(field);
    const std::array<int, 3> kinds = kindsOf(field, jumps);
    for (const int count : kinds) EXPECT_GT(count, 10);
    for (const Interface& face : jumps.interfaces)
      for (int side = 0; side < 2; ++side)
        EXPECT_EQ(face.degrees[side] == kExactDegree, isExact(field, face.cells[side]));
    const GridFrame& frame = field.lookupGrid().frame;
    for (const Interface& face : jumps.interfaces) {
      // Points so close to the face on either side that the field's slope does not matter.
      const double step = 1e-9 * frame.size[face.axis];
      const double below = field.value(face.worst - step * Vector3::Unit(face.axis));
      const double above = field.value(face.worst + step * Vector3::Unit(face.axis));
      const bool isInside =
          (face.worst - field.domain().center()).cwiseAbs().maxCoeff() < 0.49 * field.domain().sizes().minCoeff();
      const bool isCorner = (face.worst - face.center).cwiseAbs().maxCoeff() >
                            0.499 * query::cellSize(field.data(), std::max(face.depths[0], face.depths[1])).x();
      if (!isInside || isCorner) continue;
      EXPECT_NEAR(std::abs(above - below), face.value.max, 1e-7);
      EXPECT_LE(face.value.rms, face.value.max * (1 + 1e-12));
    }
  }
}

TEST(ExactLeafJumps, vanishBetweenExactLeaves) {
  const Built built;
  double between = 0, beside = 0;
  for (const Interface& face : findJumps(built.field).interfaces) {
    const bool first = isExact(built.field, face.cells[0]), second = isExact(built.field, face.cells[1]);
    if (first && second) between = std::max(between, face.value.max);
    if (first != second) beside = std::max(beside, face.value.max);
  }
  EXPECT_LT(between, 1e-12);
  EXPECT_GT(beside, 1e-6);
}

/// Measures Σ w_F ∫ jump² dA over all interfaces F of a polynomial, where w_F is the width of the smaller cell.
double jumpEnergy(const Field& field) {
  double sum = 0;
  for (const Interface& face : findJumps(field).interfaces) {
    if (isExact(field, face.cells[0]) && isExact(field, face.cells[1])) continue;
    const double width = query::cellSize(field.data(), std::max(face.depths[0], face.depths[1]))[face.axis];
    sum += width * face.area * face.value.rms * face.value.rms;
  }
  return sum;
}

/// Computes ‖f − g‖² over the polynomials of two fields with the same leaves.
double squaredDistance(const Field& field, const Field& other) {
  double sum = 0;
  field.forEachCell([&](const Cell& cell) {
    if (cell.degree == kExactDegree) return;
    const auto at = [&](const Field& one) {
      return &std::get<FieldArray<double>>(one.data().coefficients).all()[node::offset(one.data().nodes[cell.id])];
    };
    basis::forEachCoefficient(cell.degree, [&](int i, int j, int k, int index) {
      const double d = at(field)[index] - at(other)[index];
      sum += d * d * basis::squaredNorm(i, j, k) * query::cellSize(field.data(), cell.depth).prod();
    });
  });
  return sum;
}

TEST(ExactLeafContinuity, isAMinimumOfTheFunctional) {
  BuildOptions options = hpx(1e-2);
  options.grid = {4, 4, 4};
  options.maxDepth = 1;
  options.exactTriangles = 8;
  const Built built(options, "sphere,subdivisions=0");
  const Field& field = built.field;
  ASSERT_GT(kindsOf(field, findJumps(field))[1], 10);
  constexpr double kWeight = 0.3, kStep = 1e-3;
  const auto functional = [&](const Field& of) { return jumpEnergy(of) + kWeight * squaredDistance(of, field); };
  const Field made = weaklyContinuous(field, {.weight = kWeight, .tolerance = 1e-13}).field;
  const double least = functional(made);
  EXPECT_LT(least, 0.9 * functional(field));
  const auto& c = std::get<FieldArray<double>>(made.data().coefficients).all();
  const auto moved = [&](std::size_t n, double by) {
    FieldData data = made.data();
    std::get<FieldArray<double>>(data.coefficients).values()[n] += by;
    return functional(Field(std::move(data)));
  };
  for (std::size_t n = 0; n < c.size(); n += 1 + c.size() / 40) {  // central differences of a quadratic are exact
    const double up = moved(n, kStep), down = moved(n, -kStep);
    EXPECT_NEAR(up, down, 1e-11) << n;
    EXPECT_GT(up, least);
    EXPECT_GT(down, least);
  }
}

TEST(ExactLeafContinuity, leavesExactLeavesAlone) {
  const Built built;
  const Field made = weaklyContinuous(built.field, {.weight = 0.1}).field;
  EXPECT_EQ(made.data().exact.lists, built.field.data().exact.lists);
  EXPECT_LT(jumpEnergy(made), 0.5 * jumpEnergy(built.field));
  int exact = 0;
  for (const Vector3& x : placesIn(made.domain(), 2000)) {
    if (made.cellAt(x).degree != kExactDegree || !made.domain().contains(x)) continue;
    ++exact;
    ASSERT_EQ(made.value(x), built.field.value(x));
  }
  EXPECT_GT(exact, 50);
  EXPECT_GT(made.metadata().totalError, built.field.metadata().totalError);
  const Field alone = weaklyContinuous(built.field, {.weight = 0.1}, 1).field;
  EXPECT_EQ(alone.data().coefficients, made.data().coefficients);
}

TEST(ExactLeafContinuity, changesNothingNearTheSurface) {
  for (const CoefficientType type : {CoefficientType::float64, CoefficientType::float32}) {
    BuildOptions options = hpx();
    options.coefficients = type;
    options.exactTriangles = 6;
    const Built built(options);
    const Field made = weaklyContinuous(built.field, {.weight = 0.1}).field;
    int planes = 0;
    for (const Vector3& place : placesIn(made.domain(), 5000)) {
      const Vector3 x = place - (1 - 1e-3) * (place - built.exact.closestPoint(place).point);
      const Cell cell = made.cellAt(x);
      if (!made.domain().contains(x) || cell.degree == kExactDegree || std::abs(built.exact(x)) > 0.009) continue;
      ++planes;
      EXPECT_NEAR(made.value(x), built.exact(x), type == CoefficientType::float32 ? 1e-6 : 1e-12);
    }
    EXPECT_GT(planes, 100) << "where the surface is plane, leaves are linear polynomials";
  }
}

TEST(ExactLeafContinuity, isAppliedDuringTheConstruction) {
  BuildOptions options = hpx();
  options.continuityWeight = 0.1;
  const Built plain, weak(options);
  EXPECT_EQ(weak.field.data().coefficients, weaklyContinuous(plain.field, {.weight = 0.1}).field.data().coefficients);
}

/// Compares errors and slopes with the bounds at 4³ points of each leaf. Returns the number of exact leaves.
int checkBounds(const Field& field, const ExactDistance& exact) {
  int leaves = 0;
  field.forEachCell([&](const Cell& cell) {
    leaves += cell.degree == kExactDegree;
    const CellBound bound = field.data().bounds[cell.id];
    for (int n = 0; n < 64; ++n) {
      const Vector3 share(n % 4 / 3.0, n / 4 % 4 / 3.0, n / 16 / 3.0);
      // Points are moved slightly into the leaf, because on its faces rounding would decide which leaf they belong to.
      const Vector3 inner = Vector3::Constant(1e-9) + share * (1 - 2e-9);
      const Vector3 x = cell.box.min() + inner.cwiseProduct(cell.box.sizes());
      const auto [value, gradient] = field.valueAndGradient(x);
      EXPECT_LE(std::abs(value - exact(x)), bound.error) << x.transpose();
      EXPECT_LE(gradient.norm(), bound.slope) << x.transpose();
    }
  });
  return leaves;
}

/// Returns the greatest error bound of the exact leaves.
double greatestBound(const Field& field) {
  double greatest = 0;
  field.forEachCell([&](const Cell& cell) {
    if (cell.degree == kExactDegree) greatest = std::max(greatest, double(field.data().bounds[cell.id].error));
  });
  return greatest;
}

/// Returns the number of exact leaves whose error bound is below a limit.
int leavesWithin(const Field& field, double limit) {
  int leaves = 0;
  field.forEachCell([&](const Cell& cell) {
    leaves += cell.degree == kExactDegree && double(field.data().bounds[cell.id].error) < limit;
  });
  return leaves;
}

TEST(ExactLeafBounds, areRoundingErrors) {
  BuildOptions options = hpx();
  options.bounds = true;
  const Built built(options);
  const int leaves = checkBounds(built.field, built.exact);
  EXPECT_GT(leaves, 50);
  EXPECT_LT(greatestBound(built.field), 1e-10);
  EXPECT_GT(greatestBound(built.field), 0);
  options.bounds = false;
  const std::uint64_t before = Built(options).field.metadata().exactEvaluations;
  EXPECT_EQ(built.field.metadata().exactEvaluations - before,
            48 * (statistics(built.field).leaves - static_cast<std::size_t>(leaves)));
}

TEST(ExactLeafBounds, knowTheRoundingOfVertices) {
  const Vector3 far(1000, 0, 0);
  BuildOptions options = hpx();
  options.bounds = true;
  options.coefficients = CoefficientType::float32;
  const Built built(options, "sphere,subdivisions=1", far);
  ASSERT_TRUE(std::holds_alternative<std::vector<Eigen::Vector3f>>(built.field.data().exact.vertices));
  EXPECT_GT(checkBounds(built.field, built.exact), 10);
  EXPECT_GT(greatestBound(built.field), 1e-5) << "a float near 1000 is rounded by 3e-5";
  EXPECT_LT(greatestBound(built.field), 1e-4);
}

TEST(ExactLeafBounds, holdInBlendZones) {
  for (const double blend : {0.04, 0.25}) {
    BuildOptions options = hpx();
    options.grid = {5, 5, 5};
    options.exactWithin = 0.2;
    const Built before(options, "sphere,subdivisions=1");
    options.blend = blend;
    options.bounds = true;
    const Built built(options, "sphere,subdivisions=1");
    const int leaves = checkBounds(built.field, built.exact);
    EXPECT_GT(leaves, 50);
    EXPECT_GT(leavesWithin(built.field, 1e-9), 10) << "those that touch exact leaves alone";
    EXPECT_LT(leavesWithin(built.field, 1e-9), leaves) << "others touch polynomials";
    const Field later = withBounds(blended(before.field, blend), built.exact);
    EXPECT_GT(checkBounds(later, built.exact), 50);
    EXPECT_LT(leavesWithin(later, 1e-9), leavesWithin(built.field, 1e-9)) << "lists that were made without blending";
  }
}

TEST(ExactLeafBounds, holdInBlendZonesOfShells) {
  const TriangleMesh mesh = support::openBox();
  const ExactDistance exact(mesh, {.insideTest = InsideTest::shell, .thickness = 0.1});
  BuildOptions options = hpx();
  options.blend = 0.1;
  options.bounds = true;
  EXPECT_GT(checkBounds(build(exact, domainAround(mesh), options), exact), 10);
  options.blend = 0;
  EXPECT_GT(checkBounds(withBounds(blended(build(exact, domainAround(mesh), options), 0.1), exact), exact), 10);
}

TEST(ExactLeafBounds, giveSafeDistances) {
  BuildOptions options = hpx();
  options.bounds = true;
  const Built built(options);
  int useful = 0;
  for (const Vector3& x : placesIn(built.field.domain(), 3000)) {
    const double safe = safeDistance(built.field, x), exact = std::abs(built.exact(x));
    ASSERT_LE(safe, exact);
    useful += safe > 0.99 * exact;
  }
  EXPECT_GT(useful, 100);
  const SafeTrace trace = safeTrace(built.field, Vector3(2, 0.3, 0.1), Vector3(-1, 0, 0), 1e-6);
  EXPECT_TRUE(trace.mayTouch);
  EXPECT_LT(std::abs(built.exact(Vector3(2 - trace.length, 0.3, 0.1))), 1e-5) << "it ends at the surface";
}

TEST(ExactLeafExport, samplesTheExactDistance) {
  const Built built;
  const CubicGrid grid = sampleCubicGrid(built.field, {12, 12, 12});
  int exact = 0;
  for (int n = 0; n < 13 * 13 * 13; ++n) {
    const Vector3 x = grid.domain.min() + grid.cellSize().cwiseProduct(Vector3(n % 13, n / 13 % 13, n / 169));
    if (built.field.cellAt(x).degree != kExactDegree) continue;
    ++exact;
    ASSERT_NEAR(grid.nodes[static_cast<std::size_t>(n)], built.exact(x), 1e-12);
  }
  EXPECT_GT(exact, 50);
  EXPECT_GT(measureCubicGrid(grid, built.field, 1000, 1).everywhere.rms, 0);
}

TEST(ExactLeafLine, goesThroughExactLeaves) {
  for (const double blend : {0.0, 0.1}) {
    const Field field = blended(Built().field, blend);
    const Vector3 from = field.domain().min() - Vector3(0.1, 0, 0), to = field.domain().max();
    const Line line = sampleLine(field, from, to, 500);
    int exact = 0;
    for (const LineSample& sample : line.samples) {
      const auto& cell = line.pieces[sample.piece].cell;
      exact += cell && cell->degree == kExactDegree;
      EXPECT_NEAR(sample.value, field.value(sample.point), blend > 0 ? 1e-9 : 0.05);
    }
    EXPECT_GT(exact, 10);
    double greatest = 0;
    for (const LineJump& jump : jumpsAlong(line)) greatest = std::max(greatest, std::abs(jump.value));
    EXPECT_LT(greatest, blend > 0 ? 1e-9 : 0.05);
  }
}

TEST(ExactLeafSteps, areSmallInBlendedFields) {
  BuildOptions options = hpx();
  options.blend = 0.1;
  const Built built(options);
  const Jumps jumps = findJumps(built.field);
  EXPECT_LT(jumps.value.max, 1e-9);
  EXPECT_LT(stepsAcrossFaces(built.field, 5000, 1).value, 1e-9);
  EXPECT_GT(stepsAcrossFaces(Built().field, 5000, 1).value, 1e-5);
}

TEST(ExactLeafVerification, findsHardlyAnyErrorNearTheSurface) {
  BuildOptions options = hpx();
  options.bounds = true;
  const Built built(options);
  const DistanceFunction distance(built.exact);
  const auto normal = [&](const Vector3& x, double at) -> Vector3 {
    return (x - built.exact.closestPoint(x).point) * (at < 0 ? -1 : 1);
  };
  const VerifiedSurface surface{distance, normal, built.mesh};
  const Verification found = verify(built.field, surface, {.points = 4000, .near = 0.004, .anglePoints = 2000});
  EXPECT_LT(found.nearSurface.error.max, 1e-10);
  EXPECT_LT(found.nearSurface.gradient.maxAngleDegrees, 1e-3);
  EXPECT_EQ(found.nearSurface.signs.mismatches, 0u);
  EXPECT_GT(found.uniform.error.max, 1e-6);
  ASSERT_TRUE(found.bounds);
  EXPECT_EQ(found.bounds->violations, 0u);
}

/// A sphere so far from the origin that rounding its vertices changes more than rounding the coefficients.
Built farSphere(CoefficientType type, double distance, double maxError) {
  BuildOptions options = hpx();
  options.targetError = 0;
  options.maxError = maxError;
  options.coefficients = type;
  return Built(options, "sphere,subdivisions=1", Vector3(distance, 500, 0));
}

TEST(ExactLeafRounding, isPartOfTheFigures) {
  constexpr double kMaxError = 0.02;
  for (const bool isNegligible : {true, false}) {
    const double distance = isNegligible ? 1000 : 20000;
    const Built precise = farSphere(CoefficientType::float64, distance, kMaxError);
    const Built rounded = farSphere(CoefficientType::float32, distance, kMaxError);
    EXPECT_EQ(precise.field.metadata().roundingRms, 0);
    const auto& vertices = std::get<std::vector<Eigen::Vector3d>>(precise.field.data().exact.vertices);
    const auto& floats = std::get<std::vector<Eigen::Vector3f>>(rounded.field.data().exact.vertices);
    ASSERT_EQ(vertices.size(), floats.size());
    double change = 0, volume = 0;
    for (std::size_t n = 0; n < vertices.size(); ++n)
      change = std::max(change, (vertices[n] - floats[n].cast<double>()).norm());
    ASSERT_GT(change, 1e-8 * distance);
    rounded.field.forEachCell([&](const Cell& cell) { volume += cell.degree == kExactDegree ? cell.box.volume() : 0; });
    const double share = volume / rounded.field.domain().volume();
    EXPECT_NEAR(rounded.field.metadata().roundingRms, change * std::sqrt(share), 0.01 * change);
    for (const Vector3& x : placesIn(rounded.field.domain(), 500))
      EXPECT_LE(std::abs(rounded.field.value(x) - precise.field.value(x)), 1.01 * change);
    const double added = rounded.field.metadata().measuredError - precise.field.metadata().measuredError;
    EXPECT_NEAR(added, isNegligible ? 0 : change, 1e-9) << "less than a hundredth of the maximum error is left out";
  }
}

TEST(ExactLeafRounding, decidesAboutFloats) {
  for (const double distance : {0.0, 20000.0}) {
    BuildOptions options = hpx();
    options.coefficients = CoefficientType::automatic;
    const Built built(options, "sphere,subdivisions=1", Vector3(distance, 0, 0));
    EXPECT_EQ(precisionName(built.field), "quantized");
    EXPECT_EQ(std::holds_alternative<std::vector<Eigen::Vector3f>>(built.field.data().exact.vertices), distance == 0);
  }
}

TEST(ExactLeafRounding, turnsNoTriangle) {
  // A needle whose height is less than the distance between two floats would turn, and signs beside it would be wrong.
  TriangleMesh mesh = support::moved(shapes::mesh("sphere,subdivisions=1"), Vector3(100, 100, 100));
  const Triangle split = mesh.triangles.back();
  const auto [a, b, c] = cornersOf(mesh, split);
  const auto needle = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back((a + b) / 2 + 1e-7 * (c - (a + b) / 2));
  mesh.triangles.back() = {split[0], split[1], needle};
  mesh.triangles.push_back({split[1], split[2], needle});
  mesh.triangles.push_back({split[2], split[0], needle});
  const ExactDistance exact(mesh, {.insideTest = InsideTest::pseudonormal});
  BuildOptions options = hpx();
  options.coefficients = CoefficientType::float32;
  const Field field = build(exact, domainAround(mesh), options);
  EXPECT_TRUE(field.singlePrecision());
  EXPECT_TRUE(std::holds_alternative<std::vector<Eigen::Vector3d>>(field.data().exact.vertices));
  for (const Vector3& x : placesIn(field.domain(), 2000))
    if (field.domain().contains(x) && field.cellAt(x).degree == kExactDegree) {
      ASSERT_NEAR(field.value(x), exact(x), 1e-9);
    }
}

TEST(ExactLeafRounding, looksAtEveryCoordinate) {
  TriangleMesh mesh = shapes::mesh("box,width=2,height=2,depth=2");
  for (Vector3& x : mesh.vertices) x.x() += x.y() / 3;  // y and z are floats, x is not
  const ExactDistance exact(mesh);
  const Field field = build(exact, domainAround(mesh), hpx());
  EXPECT_TRUE(std::holds_alternative<std::vector<Eigen::Vector3d>>(field.data().exact.vertices));
}

TEST(ExactLeafBuild, statisticsCountTheTrianglesOfLists) {
  const Built built(hpx());
  const Field& field = built.field;
  std::vector<std::size_t> lists;
  std::set<std::uint32_t> triangles;
  field.forEachCell([&](const Cell& cell) {
    if (cell.degree != kExactDegree) return;
    lists.push_back(0);
    forEachTriangle(field.data().exact, field.data().nodes[cell.id], [&](std::uint32_t triangle) {
      ++lists.back();
      triangles.insert(triangle);
    });
  });
  std::ranges::sort(lists);
  const ExactLeafStatistics figures = statistics(field).exact;
  EXPECT_EQ(figures.leaves, lists.size());
  EXPECT_EQ(figures.triangles, triangles.size());
  EXPECT_EQ(figures.medianList, lists[lists.size() / 2]);
  EXPECT_EQ(figures.longestList, lists.back());
  const FieldBytes bytes = field.bytesOfParts();
  EXPECT_GT(bytes.exactTriangles, 12 * triangles.size());
  EXPECT_EQ(bytes.nodes + bytes.coefficients + bytes.exactTriangles + bytes.lookupGrid, field.bytes());
}

/// Settings of the construction that could disagree with exact leaves.
std::vector<BuildOptions> everyWay() {
  std::vector<BuildOptions> ways(9, hpx());
  ways[1].criterion = Criterion::optimal;
  ways[2].enrich = true;
  ways[3].targetError = NearFarError{1e-2, 3e-2};
  ways[4].targetError = 0, ways[4].maxError = 0.05;
  ways[5].band = 0.2;
  ways[6].targetError = 0, ways[6].maxBytes = 60000;
  ways[7].targetError = 0, ways[7].maxBytes = 60000, ways[7].criterion = Criterion::optimal;
  ways[8].targetError = NearFarError{1e-2, 1e-2}, ways[8].criterion = Criterion::optimal, ways[8].enrich = true,
  ways[8].continuityWeight = 1, ways[8].blend = 0.1, ways[8].bounds = true;
  return ways;
}

TEST(ExactLeafBuild, isExactInEveryWay) {
  for (const BuildOptions& options : everyWay()) {
    const Built built(options);
    const FieldStatistics figures = statistics(built.field);
    EXPECT_GT(figures.degreeLeaves.at(kExactDegree), 50u);
    EXPECT_GT(figures.coefficients, 0u);
    int exact = 0;
    for (const Vector3& x : placesIn(built.field.domain(), 2000)) {
      if (!built.field.domain().contains(x) || built.field.cellAt(x).degree != kExactDegree) continue;
      ++exact;
      if (options.blend > 0) continue;
      ASSERT_NEAR(built.field.value(x), built.exact(x), options.maxBytes ? 1e-6 : 1e-12);
    }
    EXPECT_GT(exact, 20);
    EXPECT_LE(built.field.bytes(), options.maxBytes.value_or(built.field.bytes()));
    EXPECT_LE(built.field.metadata().measuredError, options.maxError);
    EXPECT_GT(built.field.metadata().totalError, 0);
  }
}

TEST(ExactLeafBuild, reachesItsErrors) {
  BuildOptions options = hpx();
  options.targetError = NearFarError{.near = 1e-2, .far = 3e-2, .nearDistance = 0.1};
  const Built built(options);
  double near = 0, far = 0;
  int nearCount = 0, farCount = 0;
  for (const Vector3& x : placesIn(built.field.domain(), 20000)) {
    if (!built.field.domain().contains(x)) continue;
    const double distance = built.exact(x), error = built.field.value(x) - distance;
    const bool isNear = std::abs(distance) < 0.1;
    (isNear ? near : far) += error * error;
    ++(isNear ? nearCount : farCount);
  }
  EXPECT_LT(std::sqrt(near / nearCount), 1e-2);
  EXPECT_LT(std::sqrt(far / farCount), 1.2 * 3e-2);
}

/// Fields stay within the limit of bytes, or are refused.
TEST(ExactLeafBuild, countsTheBytesOfTriangles) {
  int built = 0, refused = 0;
  const TriangleMesh mesh = shapes::mesh("gear,teeth=4,segments=2");
  const ExactDistance exact(mesh);
  for (const Criterion criterion : {Criterion::paper, Criterion::optimal})
    for (const CoefficientType type : {CoefficientType::automatic, CoefficientType::float64})
      for (const double blend : {0.0, 0.1})
        for (const std::uint64_t bytes : {4000u, 16000u, 20000u, 24000u, 28000u, 32000u, 60000u}) {
          BuildOptions options = hpx();
          options.targetError = 0;
          options.maxBytes = bytes;
          options.criterion = criterion;
          options.coefficients = type;
          options.blend = blend;
          try {
            const Field field = build(exact, domainAround(mesh), options);
            EXPECT_LE(field.bytes(), bytes);
            EXPECT_FALSE(field.data().exact.empty());
            ++built;
          } catch (const Error& error) {
            const std::string text = error.what();
            EXPECT_TRUE(text.find("exact-triangles") != std::string::npos || bytes < 10000u) << text;
            EXPECT_EQ(text.find('\n'), std::string::npos);
            ++refused;
          }
        }
  EXPECT_GT(built, 10);
  EXPECT_GT(refused, 5);
}

}  // namespace exact_leaf_analysis_test
}  // namespace hpsdf
