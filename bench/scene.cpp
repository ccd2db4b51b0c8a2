#include "scene.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"
#include "support/near_points.h"

namespace hpsdf::bench {

TriangleMesh testMesh(const std::string& name) {
  const char* folder = std::getenv("HPSDF_MESHES");
  if (folder == nullptr) throw Error("HPSDF_MESHES is not set to a folder of test meshes");
  return normalized(importMesh(std::filesystem::path(folder) / name).mesh);
}

const TriangleMesh& bunny() {
  static const TriangleMesh mesh = testMesh("paper/bunny_69k.obj");
  return mesh;
}

const ExactDistance& bunnyDistance() {
  static const ExactDistance distance(bunny());
  return distance;
}

const Field& bunnyField() {
  static const Field field = build(bunnyDistance(), paperDomain(), {.targetError = 1e-6});
  return field;
}

const Field& floatBunnyField() {
  static const Field field =
      build(bunnyDistance(), paperDomain(), {.targetError = 1e-6, .coefficients = CoefficientType::float32});
  return field;
}

const Field& armadilloField() {
  static const Field field =
      build(ExactDistance(testMesh("paper/armadillo_100k.obj")), paperDomain(), {.targetError = 1e-6});
  return field;
}

Box paperDomain() { return Box(Vector3::Constant(-1.1), Vector3::Constant(1.1)); }

std::vector<Vector3> uniformPoints(std::size_t count) {
  std::mt19937_64 random(2016);
  std::uniform_real_distribution<double> uniform(-1.1, 1.1);
  std::vector<Vector3> points(count);
  for (Vector3& x : points)
    for (double& coordinate : x) coordinate = uniform(random);
  return points;
}

std::vector<Vector3> nearPoints(std::size_t count, double reach) { return support::pointsNear(bunny(), count, reach); }

double rmsError(const std::vector<Vector3>& points, const std::vector<double>& values) {
  std::vector<double> exact(points.size());
  bunnyDistance()(points, exact);
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) sum += (values[i] - exact[i]) * (values[i] - exact[i]);
  return std::sqrt(sum / double(points.size()));
}

}  // namespace hpsdf::bench
