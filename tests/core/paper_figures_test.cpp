// Compares fields of the paper's meshes with its Table 1 and with a plain implementation of the paper (numbers of
// leaves), and the measured error with the estimate that steers the construction.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"
#include "support/temporary_directory.h"
#include "support/test_mesh.h"

namespace hpsdf {
namespace paper_figures_test {

Box paperDomain() { return Box(Vector3::Constant(-1.1), Vector3::Constant(1.1)); }

TriangleMesh paperMesh(const char* name) {
  return normalized(importMesh(support::testMesh(std::filesystem::path("paper") / name)).mesh);
}

struct TrueError {
  double rms = 0;
  double largest = 0;
  double weighted = 0;  ///< ∫ κ (f − Φ)² over the domain, with the weight κ evaluated at every point
};

/// Measures the error at independent random points, uniform in the domain.
TrueError measure(const Field& field, const ExactDistance& distance, double nearness) {
  constexpr std::size_t kSamples = 200000;
  std::mt19937_64 random(2016);
  std::uniform_real_distribution<double> uniform(-1.1, 1.1);
  std::vector<Vector3> points(kSamples);
  for (Vector3& x : points)
    for (double& coordinate : x) coordinate = uniform(random);
  std::vector<double> exact(kSamples);
  distance(points, exact);
  TrueError result;
  const double diagonal = paperDomain().diagonal().norm();
  for (std::size_t i = 0; i < kSamples; ++i) {
    const double error = field.value(points[i]) - exact[i];
    result.rms += error * error / kSamples;
    result.largest = std::max(result.largest, std::abs(error));
    result.weighted += std::pow(1 - std::abs(exact[i]) / diagonal, nearness) * error * error / kSamples;
  }
  result.rms = std::sqrt(result.rms);
  result.weighted *= paperDomain().sizes().prod();
  return result;
}

TEST(PaperFigures, bunny) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const TriangleMesh mesh = paperMesh("bunny_69k.obj");
  const ExactDistance distance(mesh);
  BuildOptions options{.targetError = 1e-6, .estimator = Estimator::embedded, .coefficients = CoefficientType::float64};
  const Field field = build(distance, paperDomain(), options);
  const FieldStatistics s = statistics(field);
  EXPECT_NEAR(double(s.leaves), 54935, 0.03 * 54935);  // the paper: 55k
  EXPECT_LE(field.metadata().exactEvaluations, 5'100'000u);

  support::TemporaryDirectory folder;
  save(field, folder / "bunny.hpsdf");
  EXPECT_LE(std::filesystem::file_size(folder / "bunny.hpsdf"), 8.4e6);  // the paper: 8.4 MB

  const TrueError error = measure(field, distance, options.nearness);
  EXPECT_LE(error.weighted, 1.3e-6);
  EXPECT_LE(error.rms, 4.2e-4);
  EXPECT_LE(error.largest, 3e-2);  // a wrong sign would cause an error as large as the domain

  options.coefficients = CoefficientType::automatic;
  const Field quantized = build(distance, paperDomain(), options);
  EXPECT_EQ(precisionName(quantized), "quantized");
  EXPECT_EQ(statistics(quantized).leaves, s.leaves);
  EXPECT_LE(quantized.bytes(), 1.6e6);
  EXPECT_NEAR(measure(quantized, distance, options.nearness).rms, error.rms, 0.01 * error.rms);
}

TEST(PaperFigures, bunnyByDefault) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const ExactDistance distance(paperMesh("bunny_69k.obj"));
  const BuildOptions options{.targetError = 1e-6};
  const Field field = build(distance, paperDomain(), options);
  EXPECT_LE(field.metadata().exactEvaluations, 2'150'000u);  // by values alone 4.43 million
  EXPECT_LE(field.bytes(), 4.25e6);
  const TrueError error = measure(field, distance, options.nearness);
  EXPECT_LE(error.rms, 3.8e-4);
  EXPECT_LE(error.largest, 3e-2);
}

TEST(PaperFigures, bunnyByProductsOfGaussRules) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const ExactDistance distance(paperMesh("bunny_69k.obj"));
  const BuildOptions options{.targetError = 1e-6, .estimator = Estimator::embedded, .cubature = CubatureKind::product};
  const Field field = build(distance, paperDomain(), options);
  EXPECT_NEAR(double(statistics(field).leaves), 54935, 0.02 * 54935);
  EXPECT_LE(field.metadata().exactEvaluations, 11'000'000u);
}

TEST(PaperFigures, bunnyByThePapersSettings) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const ExactDistance distance(paperMesh("bunny_69k.obj"));
  BuildOptions options = paperOptions();
  options.targetError = 1e-5;  // ten times the error of the paper's bunny, so that the test takes a tenth of the time
  const Field field = build(distance, paperDomain(), options);
  EXPECT_LE(field.metadata().totalError, 1e-5);
  EXPECT_LE(measure(field, distance, options.nearness).weighted, 1.3e-5);
}

TEST(PaperFigures, dragon) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const ExactDistance distance(paperMesh("dragon_80k.obj"));
  const BuildOptions options{
      .targetError = 1e-7, .grid = {10, 10, 10}, .estimator = Estimator::embedded, .cubature = CubatureKind::product};
  const Field field = build(distance, paperDomain(), options);
  EXPECT_NEAR(double(statistics(field).leaves), 298542, 0.02 * 298542);  // the paper: 299k
}

}  // namespace paper_figures_test
}  // namespace hpsdf
