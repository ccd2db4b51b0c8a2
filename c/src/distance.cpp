#include <algorithm>
#include <vector>

#include "arguments.h"
#include "call.h"
#include "handles.h"

using namespace hpsdf;

namespace hpsdf::c {
namespace {

static_assert(HPSDF_INSIDE_AUTOMATIC == int(InsideTest::automatic) &&
              HPSDF_INSIDE_PSEUDONORMAL == int(InsideTest::pseudonormal) &&
              HPSDF_INSIDE_WINDING == int(InsideTest::winding) && HPSDF_INSIDE_SHELL == int(InsideTest::shell) &&
              HPSDF_INSIDE_OUTER_HULL == int(InsideTest::outerHull));

DistanceOptions distanceOptions(hpsdf_inside_test insideTest, double thickness, int threads) {
  const int test = insideTest;
  if (test < HPSDF_INSIDE_AUTOMATIC || test > HPSDF_INSIDE_OUTER_HULL)
    throw ArgumentError("inside_test", "expected a constant of hpsdf_inside_test");
  if (threads < 0) throw Error(ErrorKind::option, "threads", "expected a number from 0 up");
  return {.insideTest = static_cast<InsideTest>(test), .thickness = thickness, .threads = threads};
}

/// The arrays for the results of closest points. Those that are empty are left out.
struct ClosestArrays {
  std::span<double> distances;
  std::span<Vector3> points;
  std::span<std::uint32_t> triangles;
  std::span<Vector3> barycentric;

  void set(std::size_t i, const ClosestPoint& found) const {
    if (!distances.empty()) distances[i] = found.signedDistance;
    if (!points.empty()) points[i] = found.point;
    if (!triangles.empty()) triangles[i] = found.triangle;
    if (!barycentric.empty()) barycentric[i] = found.barycentric;
  }
};

void findClosest(const ExactDistance& distance, std::span<const Vector3> points, const ClosestArrays& out) {
  constexpr std::size_t kPiece = 4096;  // keeps the memory small: 0.3 MB
  std::vector<ClosestPoint> piece(std::min(kPiece, points.size()));
  for (std::size_t first = 0; first < points.size(); first += kPiece) {
    const std::size_t count = std::min(kPiece, points.size() - first);
    distance.closestPoints(points.subspan(first, count), std::span(piece).first(count));
    for (std::size_t i = 0; i < count; ++i) out.set(first + i, piece[i]);
  }
}

}  // namespace
}  // namespace hpsdf::c

hpsdf_status hpsdf_distance_new(const hpsdf_mesh* mesh, hpsdf_inside_test inside_test, double thickness, int threads,
                                const hpsdf_progress* progress, hpsdf_distance** distance) {
  return c::create(distance, "distance", [&] {
    c::requirePointer(mesh, "mesh");
    const DistanceOptions options = c::distanceOptions(inside_test, thickness, threads);
    return ExactDistance(mesh->mesh, options, c::progressOf(progress));
  });
}

hpsdf_status hpsdf_distance_values(const hpsdf_distance* distance, const double* points, size_t count,
                                   double* distances) {
  return c::guarded([&] {
    c::requirePointer(distance, "distance");
    const auto out = c::arrayOf(distances, count, "distances");
    distance->distance(c::vectorsOf(points, count, "points"), out);
  });
}

hpsdf_status hpsdf_distance_closest(const hpsdf_distance* distance, const double* points, size_t count,
                                    double* distances, double* closest, uint32_t* triangles, double* barycentric) {
  return c::guarded([&] {
    c::requirePointer(distance, "distance");
    const auto given = c::vectorsOf(points, count, "points");
    const auto countOf = [&](const void* array) { return array == nullptr ? 0 : count; };
    c::findClosest(distance->distance, given,
                   {.distances = c::arrayOf(distances, countOf(distances), "distances"),
                    .points = c::vectorsOf(closest, countOf(closest), "closest"),
                    .triangles = c::arrayOf(triangles, countOf(triangles), "triangles"),
                    .barycentric = c::vectorsOf(barycentric, countOf(barycentric), "barycentric")});
  });
}

void hpsdf_distance_free(hpsdf_distance* distance) { delete distance; }
