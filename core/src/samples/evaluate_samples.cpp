#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/output/contour.h"
#include "hpsdf/output/sample_points.h"
#include "samples/draw_points.h"
#include "util/chunks.h"
#include "util/morton_order.h"

namespace hpsdf {
namespace {

constexpr std::size_t kPointsOfChunk = 512;
constexpr std::size_t kMaxPoints = std::numeric_limits<std::uint32_t>::max();

/// Memory for drawing a point, computing what is known at it, and writing it to a file, in bytes.
constexpr double kBytesPerPoint = 256;

void requireInRange(bool isInRange, const char* option, const char* problem) {
  if (!isInRange) throw Error(ErrorKind::option, option, problem);
}

void requireSampleOptions(const SamplePointsOptions& options) {
  for (const double width : options.widths)
    requireInRange(std::isfinite(width) && width > 0, "widths", "must be finite numbers above 0");
  requireInRange(options.sharpAngleDegrees >= 0 && options.sharpAngleDegrees <= 180, "sharp angle",
                 "must be 0 to 180 degrees");
  requireInRange(std::isfinite(options.enlargement) && options.enlargement >= 0, "enlargement",
                 "must be a finite number, 0 or more");
  double points = 0;
  for (const std::size_t count : {options.surface, options.edge, options.near, options.uniform})
    points += static_cast<double>(count);
  requireInRange(points > 0, "samples", "no points are asked for; give the number of one kind");
  requireMemory("sampling " + std::to_string(static_cast<std::uint64_t>(std::min(points, 1e18))) + " points",
                kBytesPerPoint * points, "ask for fewer points");
  if (points > static_cast<double>(kMaxPoints))
    throw Error(ErrorKind::limit, "samples", "at most " + std::to_string(kMaxPoints) + " points can be drawn at once");
}

/// Calls evaluate(indices of points, the points) for all drawn points in parallel, in groups of points that are close
/// to each other: searches and queries are fastest for such.
template <typename Evaluate>
void forEachGroup(const samples::DrawnPoints& drawn, const TriangleMesh& surface, const Progress& progress,
                  const Evaluate& evaluate) {
  constexpr double kAround = 0.1;  // as share of the surface's size; points farther away are few
  const std::vector<std::uint32_t> order = detail::mortonOrder(drawn.points, samples::uniformBox(surface, kAround));
  detail::forEachChunk(order.size(), kPointsOfChunk, progress, "taking distances",
                       [&](std::size_t, std::size_t first, std::size_t count) {
                         std::array<Vector3, kPointsOfChunk> points;
                         const auto indices = std::span(order).subspan(first, count);
                         for (std::size_t i = 0; i < count; ++i) points[i] = drawn.points[indices[i]];
                         evaluate(indices, std::span<const Vector3>(points).first(count));
                       });
}

/// Returns the gradient of the signed distance at x, whose closest point is on a triangle with this unit normal.
Vector3 gradientAt(const Vector3& x, const ClosestPoint& closest, const Vector3& normal, const Source& source) {
  constexpr double kWithinRounding = 1e-8;  // of the greatest coordinate: the direction to x is uncertain
  constexpr double kOtherDistance = 1e-9;   // of the size: the distance is not that to the closest point
  const Vector3 offset = x - closest.point;
  const double length = offset.norm(), size = source.box.sizes().maxCoeff();
  if (std::abs(std::abs(closest.signedDistance + source.thickness / 2) - length) >
      kOtherDistance * size + 1e-12 * length)
    return Vector3::Zero();
  if (length <= kWithinRounding * x.cwiseAbs().maxCoeff()) return normal;
  return offset / (closest.signedDistance < 0 && source.thickness == 0 ? -length : length);
}

SamplePoints exactSamples(const TriangleMesh& mesh, const TriangleMesh& surface, const ExactDistance& distance,
                          const SamplePointsOptions& options, const Progress& progress) {
  samples::DrawnPoints drawn = samples::drawPoints(surface, options, progress);
  const std::size_t count = drawn.points.size();
  SamplePoints result;
  result.distances.resize(count);
  for (auto* vectors : {&result.gradients, &result.closest, &result.normals}) vectors->resize(count);
  result.faces.resize(count);
  const Source& source = distance.source();
  forEachGroup(drawn, surface, progress, [&](std::span<const std::uint32_t> indices, std::span<const Vector3> points) {
    std::array<ClosestPoint, kPointsOfChunk> found;
    distance.closestPoints(points, std::span(found).first(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::uint32_t n = indices[i];
      const Vector3 normal = samples::normalOf(mesh, found[i].triangle);
      result.distances[n] = found[i].signedDistance;
      result.gradients[n] = gradientAt(points[i], found[i], normal, source);
      result.closest[n] = found[i].point;
      result.faces[n] = found[i].triangle;
      result.normals[n] = normal;
    }
  });
  std::ranges::copy(drawn.edgeNormals, result.normals.begin() + std::ptrdiff_t(options.surface));
  result.points = std::move(drawn.points);
  result.kinds = std::move(drawn.kinds);
  return result;
}

}  // namespace

SamplePoints samplePoints(const TriangleMesh& mesh, const ExactDistance& distance, const SamplePointsOptions& options,
                          const Progress& progress) {
  requireSampleOptions(options);
  requireValidIndices(mesh);
  if (mesh.triangles.size() != distance.source().faces)
    throw Error(ErrorKind::mesh, mesh.name.empty() ? "mesh" : mesh.name,
                "is not the mesh of the distance; give the one from which the distance was made");
  return withThreads(options.threads, [&] {
    if (distance.source().insideTest == InsideTest::outerHull)
      return exactSamples(mesh, distance.surface(), distance, options, progress);
    return exactSamples(mesh, mesh, distance, options, progress);
  });
}

SamplePoints samplePoints(const TriangleMesh& mesh, const Field& field, const SamplePointsOptions& options,
                          const Progress& progress) {
  requireSampleOptions(options);
  requireValidIndices(mesh);
  return withThreads(options.threads, [&] {
    samples::DrawnPoints drawn = samples::drawPoints(mesh, options, progress);
    SamplePoints result;
    result.distances.resize(drawn.points.size());
    result.gradients.resize(drawn.points.size());
    forEachGroup(drawn, mesh, progress, [&](std::span<const std::uint32_t> indices, std::span<const Vector3> points) {
      std::array<ValueAndGradient, kPointsOfChunk> found;
      field.valuesAndGradients(points, std::span(found).first(points.size()));
      for (std::size_t i = 0; i < points.size(); ++i) {
        result.distances[indices[i]] = found[i].value;
        result.gradients[indices[i]] = found[i].gradient;
      }
    });
    result.points = std::move(drawn.points);
    result.kinds = std::move(drawn.kinds);
    return result;
  });
}

SamplePoints samplePoints(const Field& field, const SamplePointsOptions& options, const Progress& progress) {
  requireSampleOptions(options);
  const ContourOptions open{.domainCut = DomainCut::open, .threads = options.threads};
  const TriangleMesh surface = blendedContour(field, open, progress).mesh;
  if (surface.triangles.empty())
    throw Error(ErrorKind::field, "samples",
                "the field has the same sign everywhere, so that there is no surface to sample");
  return samplePoints(surface, field, options, progress);
}

}  // namespace hpsdf
