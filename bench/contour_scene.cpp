#include "contour_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hpsdf/continuity.h"
#include "hpsdf/detail/exact_samples.h"
#include "support/combined_contours.h"

namespace hpsdf::bench {
namespace {

/// Returns the vertices of a mesh, and random points of its triangles, uniformly distributed in area.
std::vector<Vector3> pointsOf(const TriangleMesh& mesh) {
  std::vector<Vector3> points = sampleSurface(mesh, boundingBox(mesh), {.count = 400'000, .seed = 2026});
  points.insert(points.end(), mesh.vertices.begin(), mesh.vertices.end());
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

const std::vector<TriangleMesh>& combinedContours() {
  static const std::vector<TriangleMesh> meshes = [] {
    std::vector<TriangleMesh> made;
    for (auto& one : support::contoursOfCombinations(10)) made.push_back(std::move(one.contour.mesh));
    return made;
  }();
  return meshes;
}

void countMesh(benchmark::State& state, const TriangleMesh& mesh) {
  state.counters["triangles"] = double(mesh.triangles.size());
  state.counters["hausdorff"] =
      std::max(greatestDistance(mesh, bunnyDistance()), greatestDistance(bunny(), ExactDistance(mesh)));
}

}  // namespace hpsdf::bench
