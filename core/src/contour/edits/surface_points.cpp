#include <array>
#include <cmath>
#include <cstdint>

#include "contour/edits/improvement.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

/// Barycentric coordinates of the points of a triangle that are moved to the surface.
const std::array<Vector3, 4> kPlacesInTriangle = {
    Vector3(1.0 / 3, 1.0 / 3, 1.0 / 3), Vector3(2.0 / 3, 1.0 / 6, 1.0 / 6), Vector3(1.0 / 6, 2.0 / 3, 1.0 / 6),
    Vector3(1.0 / 6, 1.0 / 6, 2.0 / 3)};

/// Moves points along the gradient to the surface, and sets whether they reached it.
void moveToSurface(const ImplicitSurface& surface, double accuracy, std::span<Vector3> points, std::span<bool> isOnIt) {
  constexpr int kSteps = 4;
  std::vector<ValueAndGradient> found(points.size());
  for (int step = 0; step <= kSteps; ++step) {
    surface.valuesAndGradients(points, found);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& [value, gradient] = found[i];
      isOnIt[i] = std::abs(value) <= accuracy;
      const double squared = gradient.squaredNorm();
      if (!isOnIt[i] && step < kSteps && squared > 0.01) points[i] -= gradient * (value / squared);
    }
  }
}

}  // namespace

EditedMesh editedMesh(const ImplicitSurface& surface, const EditLimits& limits, TriangleMesh mesh) {
  constexpr std::size_t kAtOnce = 64, kPlaces = kPlacesInTriangle.size();
  std::vector<Vector3> moved(kPlaces * mesh.triangles.size());
  std::vector<char> counts(moved.size());
  detail::forEachChunk(mesh.triangles.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    const std::span points = std::span(moved).subspan(kPlaces * first, kPlaces * count);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto [a, b, c] = cornersOf(mesh, mesh.triangles[first + i / kPlaces]);
      const Vector3& place = kPlacesInTriangle[i % kPlaces];
      points[i] = place[0] * a + place[1] * b + place[2] * c;
    }
    std::array<bool, kPlaces * kAtOnce> isOnIt;
    moveToSurface(surface, limits.accuracy, points, std::span(isOnIt).first(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto [a, b, c] = cornersOf(mesh, mesh.triangles[first + i / kPlaces]);
      const std::array<Vector3, 3> corners = {a, b, c};
      const double squared = NearTriangles({&corners, 1}).nearestTo(points[i]).second;
      counts[kPlaces * first + i] = isOnIt[i] && squared <= limits.tolerance * limits.tolerance ? 1 : 0;
    }
  });
  std::vector<Vector3> points;
  std::vector<std::uint32_t> triangleOf;
  std::vector<bool> isListed(mesh.vertices.size());
  const auto add = [&](const Vector3& point, std::uint32_t triangle) {
    points.push_back(point);
    triangleOf.push_back(triangle);
  };
  for (std::uint32_t n = 0; n < mesh.triangles.size(); ++n) {
    for (std::size_t k = 0; k < kPlaces; ++k)
      if (counts[kPlaces * n + k] != 0) add(moved[kPlaces * n + k], n);
    for (const std::uint32_t vertex : mesh.triangles[n]) {
      if (!isListed[vertex]) add(mesh.vertices[vertex], n);
      isListed[vertex] = true;
    }
  }
  return {std::move(mesh.vertices), std::move(mesh.triangles), std::move(points), std::move(triangleOf)};
}

}  // namespace hpsdf::contouring
