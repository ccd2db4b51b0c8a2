#include "contour/polygon_errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr std::size_t kErrorPointsAtOnce = 900;

/// A search for the greatest error of a triangle at the points of a lattice. A few points suffice in most triangles;
/// where the error is not far below the tolerance, more points are searched.
struct ErrorStage {
  int along;     ///< intervals of the lattice along each side
  double above;  ///< the least error known, in tolerances, with which this search is made
};
constexpr std::array<ErrorStage, 3> kErrorStages{{{2, 0}, {4, 0.25}, {10, 0.6}}};

/// Returns the points of a lattice in a triangle, as barycentric coordinates: multiples of 1/n, and the middle.
std::vector<Vector3> latticeOfTriangle(int n) {
  std::vector<Vector3> points;
  for (int i = 0; i <= n; ++i)
    for (int k = 0; i + k <= n; ++k) points.push_back(Vector3(i, k, n - i - k) / n);
  if (n % 3 != 0) points.push_back(Vector3::Constant(1.0 / 3));
  return points;
}

/// Raises the errors of polygons to the greatest magnitudes of the function at some points of each triangle.
class ErrorSearch {
 public:
  ErrorSearch(const ImplicitSurface& surface, const DualMesh& mesh, bool isOpen, const Progress& progress,
              std::span<CrossedEdge> edges)
      : surface_(surface), mesh_(mesh), isOpen_(isOpen), progress_(progress), edges_(edges) {}

  void search(std::span<const std::uint32_t> triangles, std::span<const Vector3> places) const {
    std::vector<double> errors(triangles.size());
    detail::forEachChunk(triangles.size(), kErrorPointsAtOnce / places.size(),
                         [&](std::size_t, std::size_t first, std::size_t count) {
                           progress_.throwIfCancelled();
                           searchSome(triangles.subspan(first, count), places, std::span(errors).subspan(first, count));
                         });
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      double& error = edges_[mesh_.edgeOfTriangle[triangles[i]]].polygon.error;
      error = std::max(error, errors[i]);
    }
  }

 private:
  void searchSome(std::span<const std::uint32_t> triangles, std::span<const Vector3> places,
                  std::span<double> errors) const {
    std::array<Vector3, kErrorPointsAtOnce> memory;
    std::array<double, kErrorPointsAtOnce> values;
    const std::span points = std::span(memory).first(places.size() * triangles.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Triangle& t = mesh_.triangles[triangles[i / places.size()]];
      const Vector3& place = places[i % places.size()];
      points[i] = place[0] * mesh_.vertices[t[0]] + place[1] * mesh_.vertices[t[1]] + place[2] * mesh_.vertices[t[2]];
    }
    const auto raise = [&](std::size_t i) {
      for (std::size_t k = 0; k < places.size(); ++k)
        errors[i] = std::max(errors[i], std::abs(values[places.size() * i + k]));
    };
    surface_.values(points, std::span(values).first(points.size()));
    for (std::size_t i = 0; i < triangles.size(); ++i) raise(i);
    if (!isOpen_) return;
    surface_.valuesWithoutWall(points, std::span(values).first(points.size()));
    for (std::size_t i = 0; i < triangles.size(); ++i)
      if (!surface_.isAtWall(edges_[mesh_.edgeOfTriangle[triangles[i]]].point)) raise(i);
  }

  const ImplicitSurface& surface_;
  const DualMesh& mesh_;
  bool isOpen_;
  const Progress& progress_;
  std::span<CrossedEdge> edges_;
};

}  // namespace

void measurePolygons(const ImplicitSurface& surface, const DualMesh& mesh, bool isOpen, double tolerance,
                     const Progress& progress, std::span<CrossedEdge> edges) {
  const auto polygonOf = [&](std::uint32_t n) -> PolygonState& { return edges[mesh.edgeOfTriangle[n]].polygon; };
  std::vector<std::uint32_t> changed;
  for (std::uint32_t n = 0; n < mesh.triangles.size(); ++n)
    if (polygonOf(n).isChanged) changed.push_back(n);
  for (const std::uint32_t n : changed) polygonOf(n).error = 0;
  const ErrorSearch search(surface, mesh, isOpen, progress, edges);
  for (const ErrorStage& stage : kErrorStages) {
    std::erase_if(changed, [&](std::uint32_t n) {
      const double error = polygonOf(n).error;
      return error > tolerance || error < stage.above * tolerance;
    });
    search.search(changed, latticeOfTriangle(stage.along));
  }
}

}  // namespace hpsdf::contouring
