// Tests fields that are built within a tolerance.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "field/cells/cell_bounds.h"
#include "field/cells/surface_points.h"
#include "field/tolerance/cell_lattice.h"
#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/exact_samples.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"
#include "hpsdf/verify.h"
#include "support/made_meshes.h"
#include "support/tolerance_checks.h"

namespace hpsdf {
namespace tolerance_test {

using support::greatestRatio;
using support::greatestRatioOnLine;
using support::halfway;

TEST(Tolerance, allowsMoreFarFromTheSurface) {
  const AllowedError allowed{.tolerance = 0.5, .within = 2};
  EXPECT_EQ(allowed.at(0), 0.5);
  EXPECT_EQ(allowed.at(-2), 0.5);
  EXPECT_DOUBLE_EQ(allowed.at(-12), 0.6);
  EXPECT_DOUBLE_EQ(allowed.at(12), 0.6);
}

TEST(Tolerance, isKept) {
  for (const char* shape : {"torus,segments=16,sides=8", "gear,teeth=3"}) {
    const TriangleMesh mesh = shapes::mesh(shape);
    const ExactDistance distance(mesh);
    std::size_t before = 0;
    for (const double tolerance : {0.04, 0.015}) {
      SCOPED_TRACE(std::string(shape) + ", tolerance " + std::to_string(tolerance));
      const Field field = build(distance, domainAround(mesh), {.tolerance = tolerance});
      EXPECT_LE(greatestRatio(field, distance, mesh), 1);
      EXPECT_LE(field.metadata().measuredError, tolerance);
      EXPECT_EQ(field.metadata().settings.tolerance, tolerance);
      EXPECT_GT(field.bytes(), before) << "a smaller tolerance takes more bytes";
      before = field.bytes();
      const Measurement measured = measure(field, distance);
      EXPECT_LE(measured.toleranceRatio, 1);
      EXPECT_GT(measured.toleranceRatio, 0.2) << "the tolerance is made use of";
      EXPECT_EQ(measured.beyondTolerance, 0U);
    }
  }
}

TEST(Tolerance, seesKinksThatPassBetweenThePoints) {
  const Box domain(Vector3::Constant(-1), Vector3::Constant(1));
  for (const double at : {1.0, 0.714}) {
    SCOPED_TRACE(at);
    const auto ridge = [&](const Vector3& x) { return 0.5 - std::abs(x.y() + x.z() - at) / std::sqrt(2.0); };
    const double tolerance = 0.1373;
    const Field field = build(ridge, domain, {.grid = {1, 1, 1}, .tolerance = tolerance, .within = 10});
    double worst = 0;
    for (double y = -1; y <= 1; y += 0.01)
      for (double z = -1; z <= 1; z += 0.01)
        worst = std::max(worst, std::abs(field.value({0.1, y, z}) - ridge({0.1, y, z})));
    EXPECT_LE(worst, tolerance);
  }
}

TEST(Tolerance, seesKinksWhereTheErrorIsGreaterElsewhereInTheCell) {
  for (const double at : {-0.975, -0.625, -0.275, 0.075, 0.425, 0.775})
    for (const double tolerance : {0.01, 0.04}) {
      EXPECT_LE(greatestRatioOnLine(halfway(2, at), tolerance, {0.1, 0.3, 0}, 2), 1)
          << "kink at " << at << ", tolerance " << tolerance;
    }
}

TEST(Tolerance, seesKinksBesideFacesOfACell) {
  for (const auto& [at, tolerance] : {std::pair(0.98125, 0.025), {0.96875, 0.04}, {0.01875, 0.025}, {0.95625, 0.06}})
    for (const double side : {1, -1})
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_LE(greatestRatioOnLine(halfway(axis, side * at), tolerance, {0.1, 0.3, 0.2}, axis), 1)
            << "kink at " << side * at << " on axis " << axis << ", tolerance " << tolerance;
}

/// Halfway between two thin wires, the distance is curved on both sides of its kink, and bends elsewhere.
TEST(Tolerance, seesKinksWhereTheDistanceIsCurved) {
  const auto wires = [](const Vector3& x) {
    return std::min(std::hypot(x.y() + 1.3421, x.z() + 3.3505), std::hypot(x.y() + 0.2485, x.z() + 3.3505));
  };
  for (const double tolerance : {0.0075, 0.0078, 0.008, 0.0083})
    EXPECT_LE(greatestRatioOnLine(wires, tolerance, {0.1, 0, -1}, 1), 1) << "tolerance " << tolerance;
}

TEST(Tolerance, isKeptAtAnyScale) {
  const TriangleMesh mesh = shapes::mesh("gear,teeth=3");
  const TriangleMesh large = support::moved(mesh, {1e4, 0, 0}, 1000);
  const ExactDistance distance(mesh), distanceOfLarge(large);
  const Field field = build(distance, domainAround(mesh), {.tolerance = 0.03});
  const Field fieldOfLarge = build(distanceOfLarge, domainAround(large), {.tolerance = 30});
  EXPECT_NEAR(double(fieldOfLarge.bytes()) / double(field.bytes()), 1, 0.1);
  EXPECT_LE(greatestRatio(fieldOfLarge, distanceOfLarge, large), 1);
}

/// Single-precision coordinates would be 1e-3 apart there, a fifth of the tolerance.
TEST(Tolerance, isKeptFarFromTheOrigin) {
  const TriangleMesh mesh = support::moved(shapes::mesh("gear,teeth=5"), {1e4, -1e4, 1e4}, 0.5);
  const ExactDistance distance(mesh);
  const Field field = build(distance, domainAround(mesh), {.tolerance = 0.005});
  EXPECT_LE(greatestRatio(field, distance, mesh), 1);
  EXPECT_LE(field.metadata().measuredError, 0.005);
  EXPECT_EQ(measure(field, distance).beyondTolerance, 0U);
}

TEST(Tolerance, takesExactLeavesWhereTheseAreSmaller) {
  const TriangleMesh mesh = support::boxOfTwo();
  const ExactDistance distance(mesh);
  const Field field = build(distance, domainAround(mesh), {.tolerance = 1e-3});
  EXPECT_GT(statistics(field).exact.leaves, 100U);
  EXPECT_LT(field.bytes(), 12'000U);
  const DistanceFunction withoutTriangles([&](const Vector3& x) { return distance(x); }, distance.source());
  const Field polynomials = build(withoutTriangles, domainAround(mesh), {.tolerance = 2e-2});
  EXPECT_EQ(statistics(polynomials).exact.leaves, 0U);
  EXPECT_GT(polynomials.bytes(), 2 * field.bytes());
  EXPECT_LE(greatestRatio(polynomials, withoutTriangles, mesh), 1);
}

TEST(Tolerance, doesNotDependOnThreads) {
  const TriangleMesh mesh = shapes::mesh("gear,teeth=3");
  const ExactDistance distance(mesh);
  const Field one = build(distance, domainAround(mesh), {.tolerance = 0.03, .threads = 1});
  const Field all = build(distance, domainAround(mesh), {.tolerance = 0.03});
  EXPECT_EQ(one.data().nodes, all.data().nodes);
  EXPECT_EQ(one.data().coefficients, all.data().coefficients);
  EXPECT_EQ(one.data().exact.lists, all.data().exact.lists);
}

/// A slot that is far narrower than the points of the lattice are apart, in a block that a few large cells cover.
TEST(Tolerance, seesNarrowSlots) {
  for (const double width : {0.01, 0.003}) {
    TriangleMesh mesh = support::boxBetween({-1, -1, -1}, {-width / 2, 1, 1});
    mesh = support::joined(std::move(mesh), support::boxBetween({width / 2, -1, -1}, {1, 1, 1}));
    mesh = support::joined(std::move(mesh), support::boxBetween({-width, -1, -1.5}, {width, 1, -0.9}));
    const ExactDistance distance(mesh);
    const Field field = build(distance, domainAround(mesh), {.tolerance = width / 8});
    EXPECT_LE(greatestRatio(field, distance, mesh), 1) << width;
    for (const Vector3& x : support::placesIn(Box(Vector3(-width / 8, -0.8, -0.7), Vector3(width / 8, 0.8, 0.8)), 1000))
      EXPECT_GT(field.value(x), 0) << x.transpose();
  }
}

TEST(Tolerance, includesBlending) {
  const TriangleMesh mesh = shapes::mesh("gear,teeth=5");
  const ExactDistance distance(mesh);
  const Field field = build(distance, domainAround(mesh), {.tolerance = 0.01, .blend = 0.04});
  EXPECT_EQ(field.data().blend, 0.04);
  EXPECT_LE(greatestRatio(field, distance, mesh), 1);
}

/// The checks of the construction do not hold for a field that was changed afterwards.
TEST(Tolerance, isForgottenWhenTheFieldIsChanged) {
  const TriangleMesh mesh = support::boxOfTwo();
  const ExactDistance distance(mesh);
  Field field = build(distance, domainAround(mesh), {.grid = {2, 2, 2}, .tolerance = 0.1, .certified = true});
  field = withMeasurement(field, measure(field, distance, {.points = 100}));
  EXPECT_FALSE(field.metadata().hasEstimate());
  const Field smooth = weaklyContinuous(field).field;
  for (const Field& changed : {smooth, blended(field), blended(smooth), weaklyContinuous(blended(field)).field}) {
    const FieldMetadata& metadata = changed.metadata();
    EXPECT_EQ(metadata.settings.tolerance, 0);
    EXPECT_EQ(metadata.settings.within, 0);
    EXPECT_FALSE(metadata.settings.certified);
    EXPECT_EQ(metadata.measuredError, 0);
    EXPECT_FALSE(metadata.measurement);
    EXPECT_FALSE(metadata.hasEstimate());
    EXPECT_EQ(metadata.totalError, 0) << "the change alone is no estimate of the error";
  }
  EXPECT_TRUE(build(distance, domainAround(mesh), {.grid = {2, 2, 2}, .maxSteps = 0}).metadata().hasEstimate());
}

TEST(Tolerance, takesDoubleWhereFloatIsTooCoarse) {
  const TriangleMesh mesh = support::moved(support::boxOfTwo(), {1e5, 0, 0});
  const auto distance = [](const Vector3& x) { return (x - Vector3(1e5, 0, 0)).norm() - 1 + 1e6; };
  const Box domain = domainAround(mesh);
  EXPECT_FALSE(build(distance, domain, {.tolerance = 1e-3}).singlePrecision());
  const auto near = [](const Vector3& x) { return (x - Vector3(1e5, 0, 0)).norm() - 1; };
  EXPECT_EQ(precisionName(build(near, domain, {.tolerance = 1e-3})), "quantized");
}

/// No polynomial can follow a distance that jumps.
TEST(Tolerance, saysWhereItCannotBeKept) {
  const auto distance = [](const Vector3& x) { return x.norm() - 0.8 + (x.z() > 0.05 ? 0.2 : 0); };
  const Box domain(Vector3::Constant(-1), Vector3::Constant(1));
  const Field field = build(distance, domain, {.tolerance = 0.02});
  EXPECT_GT(field.metadata().measuredError, 0.02);
  const Measurement measured = measure(field, distance);
  EXPECT_GT(measured.beyondTolerance, 0U);
  EXPECT_LT(double(measured.beyondTolerance), 0.05 * double(measured.points)) << "only beside the jump";
  EXPECT_GT(measured.toleranceRatio, 1);
}

TEST(Tolerance, foretellsBytesOnceAndEarly) {
  const TriangleMesh mesh = shapes::mesh("gear,teeth=5");
  const ExactDistance distance(mesh);
  std::vector<Forecast> forecasts;
  double fraction = 0, fractionThen = 1;
  const Progress progress{.report = [&](std::string_view, double done) { fraction = done; },
                          .forecast =
                              [&](const Forecast& forecast) {
                                forecasts.push_back(forecast);
                                fractionThen = fraction;
                              }};
  const Field field = build(distance, domainAround(mesh), {.tolerance = 5e-3}, progress);
  ASSERT_EQ(forecasts.size(), 1U);
  EXPECT_LE(fractionThen, 0.1);
  EXPECT_GT(forecasts[0].seconds, 0);
  EXPECT_GT(forecasts[0].bytes, double(field.bytes()) / 2);
  EXPECT_LT(forecasts[0].bytes, double(field.bytes()) * 2);
}

TEST(Tolerance, isRefusedEarlyWhereMemoryIsShort) {
  const TriangleMesh mesh = shapes::mesh("torus,segments=24,sides=12");
  const ExactDistance distance(mesh);
  const BuildOptions options{.tolerance = 1e-6, .memoryLimit = distance.bytes() + 200'000};
  double fraction = 0;
  try {
    build(distance, domainAround(mesh), options,
          {.report = [&](std::string_view, double done) { fraction = std::max(fraction, done); }});
    FAIL() << "expected an error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("allowed"), std::string::npos) << error.what();
  }
  EXPECT_LT(fraction, 0.1);
}

TEST(Tolerance, canBeCertified) {
  const TriangleMesh mesh = shapes::mesh("torus,segments=12,sides=6");
  const ExactDistance distance(mesh);
  const double tolerance = 0.04;
  const BuildOptions checked{.tolerance = tolerance}, certified{.tolerance = tolerance, .certified = true};
  const Field field = build(distance, domainAround(mesh), certified);
  EXPECT_TRUE(field.metadata().settings.certified);
  EXPECT_LE(field.metadata().measuredError, tolerance);
  EXPECT_LE(greatestRatio(field, distance, mesh), 1);
  EXPECT_GT(field.bytes(), build(distance, domainAround(mesh), checked).bytes());
}

/// The bound of a constant is proven where the distance stays below the allowed error, and nowhere else.
TEST(Tolerance, isProvenOnlyWhereItHolds) {
  const auto plane = [](const Vector3& x) { return x.z(); };
  const DistanceFunction distance(plane);
  const Box cell(Vector3::Constant(-1), Vector3::Constant(1)), domain(Vector3::Constant(-9), Vector3::Constant(9));
  std::atomic<std::uint64_t> evaluations = 0;
  const auto isProven = [&](const std::vector<double>& coefficients, int degree, double tolerance) {
    return detail::isProvenWithin({coefficients, degree, cell, domain, distance}, {tolerance, 10}, 0, evaluations);
  };
  EXPECT_FALSE(isProven({0}, 0, 0.99)) << "the error is 1 at the upper and the lower face";
  EXPECT_TRUE(isProven({0}, 0, 1.5));
  EXPECT_TRUE(isProven({0, 1, 0, 0}, 1, 0.2)) << "the distance itself";
  EXPECT_FALSE(isProven({0.25, 1, 0, 0}, 1, 0.2));
  EXPECT_GT(evaluations, 0U);
}

TEST(Tolerance, goesWithoutOtherGoals) {
  const auto distance = [](const Vector3& x) { return x.norm() - 1; };
  const Box domain(Vector3::Constant(-1.1), Vector3::Constant(1.1));
  EXPECT_THROW(build(distance, domain, {.tolerance = -1}), Error);
  EXPECT_THROW(build(distance, domain, {.maxError = 0.1, .tolerance = 0.1}), Error);
  EXPECT_THROW(build(distance, domain, {.tolerance = 0.1, .maxBytes = 1'000'000}), Error);
  EXPECT_THROW(build(distance, domain, {.tolerance = 0.1, .band = 0.1}), Error);
  EXPECT_THROW(build(distance, domain, {.tolerance = 0.1, .certified = true, .blend = 0.04}), Error);
  EXPECT_THROW(buildResumably(distance, domain, {.tolerance = 0.1}, {.file = "state"}), Error);
}

TEST(CellLattice, fitsPolynomialsExactly) {
  for (const double reach : {1.0, 1.08}) {
    const detail::CellLattice lattice(reach);
    ASSERT_EQ(lattice.points().size(), 512U);
    EXPECT_EQ(lattice.pointsBetween().size(), 729U);
    std::vector<double> samples;
    for (const Vector3& x : lattice.points())
      samples.push_back(1 + x.x() * x.y() * x.z() - std::pow(x.x(), 5) + 2 * x.y() * x.y());
    const std::vector<double> values = lattice.valuesOf(lattice.fit(samples, 5), 5);
    for (std::size_t i = 0; i < samples.size(); ++i) EXPECT_NEAR(values[i], samples[i], 1e-12);
    double greatest = 0;
    for (const Vector3& x : lattice.points()) greatest = std::max(greatest, x.cwiseAbs().maxCoeff());
    EXPECT_DOUBLE_EQ(greatest, reach);
    for (const auto& [a, b] : lattice.neighbours())
      EXPECT_NEAR((lattice.points()[a] - lattice.points()[b]).norm(), lattice.spacing(), 1e-12);
  }
}

/// Checks that lines go through all points along each axis, each from one end of the lattice to the other.
void checkLines(std::span<const detail::CellLattice::Line> lines, std::span<const Vector3> points, double reach,
                double spacing, double spacingAtEnds) {
  std::set<std::pair<int, std::uint32_t>> seen;
  for (const auto& [axis, line] : lines) {
    EXPECT_EQ(points[line.front()][axis], -reach);
    EXPECT_NEAR(points[line.back()][axis], reach, 1e-15);
    for (std::size_t i = 0; i < line.size(); ++i) {
      EXPECT_TRUE(seen.insert({axis, line[i]}).second) << "two lines along one axis share a point";
      if (i == 0) continue;
      const bool isAtEnd = i == 1 || i + 1 == line.size();
      const Vector3 step = (isAtEnd ? spacingAtEnds : spacing) * Vector3::Unit(axis);
      EXPECT_LT((points[line[i]] - points[line[i - 1]] - step).norm(), 1e-12);
    }
  }
  EXPECT_EQ(seen.size(), 3 * points.size());
}

TEST(CellLattice, hasLinesOfPoints) {
  for (const double reach : {1.0, 1.08}) {
    const detail::CellLattice lattice(reach);
    checkLines(lattice.lines(), lattice.points(), reach, lattice.spacing(), lattice.spacing());
    checkLines(lattice.linesBetween(), lattice.pointsBetween(), reach, lattice.spacing(), lattice.spacing() / 2);
  }
}

TEST(SurfaceInCells, clipsTriangles) {
  const TriangleMesh mesh = support::boxOfTwo();
  const ExactDistance distance(mesh);
  const detail::SurfaceInCells surface(distance.triangleSearch());
  const Box cell(Vector3(0.5, 0.25, 0.25), Vector3(1.5, 0.5, 0.5));  // one face of the box cuts this cell
  std::size_t count = 0;
  Box reached;
  surface.forEachIn(cell, [&](const Vector3& point) {
    ++count;
    reached.extend(point);
    EXPECT_NEAR(point.x(), 1, 1e-12);
    EXPECT_NEAR(distance(point), 0, 1e-12);
  });
  EXPECT_GE(count, 5U);
  EXPECT_TRUE(reached.min().isApprox(Vector3(1, 0.25, 0.25), 1e-9));
  EXPECT_TRUE(reached.max().isApprox(Vector3(1, 0.5, 0.5), 1e-9));
}

}  // namespace tolerance_test
}  // namespace hpsdf
