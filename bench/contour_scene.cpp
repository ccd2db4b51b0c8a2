#include "contour_scene.h"

#include <algorithm>
#include <cmath>

#include "hpsdf/continuity.h"

namespace hpsdf::bench {
namespace {

/// Returns the vertices of a mesh, and random points of its triangles, uniformly distributed in area.
std::vector<Vector3> pointsOf(const TriangleMesh& mesh) {
  constexpr std::size_t kCount = 400'000;
  std::vector<double> areas;
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    areas.push_back((b - a).cross(c - a).norm());
  }
  std::mt19937_64 random(2026);
  std::discrete_distribution<std::size_t> byArea(areas.begin(), areas.end());
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Vector3> points = mesh.vertices;
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto [a, b, c] = cornersOf(mesh, mesh.triangles[byArea(random)]);
    const double root = std::sqrt(uniform(random)), share = uniform(random);
    points.emplace_back((1 - root) * a + root * (1 - share) * b + root * share * c);
  }
  return points;
}

double greatestDistance(const TriangleMesh& from, const ExactDistance& to) {
  const std::vector<Vector3> points = pointsOf(from);
  std::vector<double> distances(points.size());
  to(points, distances);
  double greatest = 0;
  for (const double distance : distances) greatest = std::max(greatest, std::abs(distance));
  return greatest;
}

}  // namespace

const Field& contourField() {
  static const Field field = blended(build(bunnyDistance(), paperDomain(), {.targetError = 1e-7}));
  return field;
}

void countMesh(benchmark::State& state, const TriangleMesh& mesh) {
  state.counters["triangles"] = double(mesh.triangles.size());
  state.counters["hausdorff"] =
      std::max(greatestDistance(mesh, bunnyDistance()), greatestDistance(bunny(), ExactDistance(mesh)));
}

}  // namespace hpsdf::bench
