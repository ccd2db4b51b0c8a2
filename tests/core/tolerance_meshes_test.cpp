// Tests fields that are built within smaller tolerances, or of more distances, than those of tolerance_test.cpp.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"
#include "support/made_meshes.h"
#include "support/tolerance_checks.h"

namespace hpsdf {
namespace {

TEST(ToleranceOfMeshes, isKept) {
  for (const char* shape : {"torus,segments=24,sides=12", "gear,teeth=5", "gear,teeth=9"}) {
    const TriangleMesh mesh = shapes::mesh(shape);
    const ExactDistance distance(mesh);
    for (const double tolerance : {0.03, 0.006}) {
      SCOPED_TRACE(std::string(shape) + ", tolerance " + std::to_string(tolerance));
      const Field field = build(distance, domainAround(mesh), {.tolerance = tolerance});
      EXPECT_LE(support::greatestRatio(field, distance, mesh), 1);
      EXPECT_LE(field.metadata().measuredError, tolerance);
    }
  }
}

TEST(ToleranceOfMeshes, seesKinksWhereTheErrorIsGreaterElsewhereInTheCell) {
  for (int i = 0; i < 40; ++i)
    for (const double tolerance : {0.005, 0.01, 0.02, 0.04, 0.08}) {
      const double at = -0.975 + i * 0.05;
      EXPECT_LE(support::greatestRatioOnLine(support::halfway(2, at), tolerance, {0.1, 0.3, 0}, 2), 1)
          << "kink at " << at << ", tolerance " << tolerance;
    }
}

/// A plate lies in a single plane of the base grid's cells, which a sample of every so many cells must not prefer.
TEST(ToleranceOfMeshes, foretellsBytesOfAPlateInAFineGrid) {
  TriangleMesh bumpy;  // 25 x 25 vertices in the plane x = 0, moved by a few thousandths, on both sides
  bumpy.name = "plate";
  constexpr std::uint32_t kSide = 25;
  for (const double side : {-0.02, 0.02})
    for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
      const double y = -0.9 + 1.8 * (i % kSide) / (kSide - 1), z = -0.9 + 1.8 * (i / kSide) / (kSide - 1);
      bumpy.vertices.emplace_back(side + 0.01 * std::sin(9 * y) * std::cos(7 * z), y, z);
    }
  for (const std::uint32_t first : {0U, kSide * kSide})
    for (std::uint32_t y = 0; y + 1 < kSide; ++y)
      for (std::uint32_t z = 0; z + 1 < kSide; ++z) {
        const std::uint32_t a = first + z * kSide + y, b = a + 1, c = a + kSide, d = c + 1;
        const bool isFront = first > 0;
        bumpy.triangles.push_back(isFront ? Triangle{a, b, d} : Triangle{a, d, b});
        bumpy.triangles.push_back(isFront ? Triangle{a, d, c} : Triangle{a, c, d});
      }
  const ExactDistance distance(bumpy);
  const Box domain(Vector3::Constant(-1), Vector3::Constant(1));
  for (const std::uint32_t grid : {14U, 15U}) {
    double foretold = 0;
    const Progress progress{.forecast = [&](const Forecast& forecast) { foretold = forecast.bytes; }};
    const Field field = build(distance, domain, {.grid = {grid, grid, grid}, .tolerance = 0.009}, progress);
    EXPECT_GT(foretold, 0.5 * double(field.bytes())) << grid;
    EXPECT_LT(foretold, 1.5 * double(field.bytes())) << grid;
  }
}

}  // namespace
}  // namespace hpsdf
