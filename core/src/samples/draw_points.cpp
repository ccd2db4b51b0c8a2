#include "samples/draw_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>

#include "hpsdf/detail/random_points.h"
#include "mesh/area_points.h"
#include "mesh/connectivity.h"
#include "util/chunks.h"
#include "util/number_text.h"
#include "util/single_precision.h"

namespace hpsdf::samples {
namespace {

using detail::Random;

/// Returns the greatest distance of the surface from the center of its box.
double radiusOf(const TriangleMesh& surface) {
  const Vector3 center = boundingBox(surface).center();
  double squared = 0;
  for (const Triangle& triangle : surface.triangles)
    for (const std::uint32_t vertex : triangle)
      squared = std::max(squared, (surface.vertices[vertex] - center).squaredNorm());
  return std::sqrt(squared);
}

/// Returns a vector whose coordinates are normally distributed with standard deviation 1 (Box and Muller 1958).
Vector3 gaussian(Random& random) {
  const auto pair = [&](auto function) {
    const double radius = std::sqrt(-2 * std::log(1 - random.unit())), angle = 2 * std::numbers::pi * random.unit();
    return function(radius, angle);
  };
  const auto [x, y] = pair([](double r, double angle) { return std::array{r * std::cos(angle), r * std::sin(angle)}; });
  const double z = pair([](double r, double angle) { return r * std::cos(angle); });
  return {x, y, z};
}

/// The sharp edges of a surface, from which points are drawn uniformly by length.
class SharpEdges {
 public:
  SharpEdges(const TriangleMesh& surface, double sharpAngleDegrees) : surface_(surface) {
    const double leastCosine = std::cos(sharpAngleDegrees * std::numbers::pi / 180);
    const std::vector<mesh::DirectedEdge> sides = mesh::directedEdgesOf(surface.triangles);
    mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> edge) {
      const Vector3 first = normalOf(surface, edge[0].face);
      if (edge.size() == 2 && first.dot(normalOf(surface, edge[1].face)) > leastCosine) return;
      Vector3 sum = Vector3::Zero();
      for (const mesh::DirectedEdge& side : edge) sum += normalOf(surface, side.face);
      edges_.push_back({edge[0].low(), edge[0].high(), sum.norm() > 1e-9 ? sum.normalized() : first});
      byLength_.add((surface.vertices[edge[0].high()] - surface.vertices[edge[0].low()]).norm());
    });
    if (byLength_.total() > 0) return;
    std::string angle;
    detail::appendNumber(angle, sharpAngleDegrees);
    throw Error(ErrorKind::option, "edge",
                "the surface has no edge at which faces meet at " + angle +
                    " degrees or more; give a smaller sharp angle, or ask for no edge points");
  }

  void draw(Random& random, Vector3& point, Vector3& normal) const {
    const Edge& edge = edges_[byLength_.draw(random)];
    const double t = random.unit();
    point = (1 - t) * surface_.vertices[edge.from] + t * surface_.vertices[edge.to];
    normal = edge.normal;
  }

 private:
  struct Edge {
    std::uint32_t from, to;
    Vector3 normal;  ///< mean of the normals of its faces, of unit length
  };

  const TriangleMesh& surface_;
  std::vector<Edge> edges_;
  mesh::SelectBySize byLength_;
};

/// Draws the points of all kinds, kind after kind.
class KindByKind {
 public:
  KindByKind(const TriangleMesh& surface, const SamplePointsOptions& options, const Progress& progress)
      : surface_(surface), options_(options), progress_(progress) {
    const std::size_t all = options.surface + options.edge + options.near + options.uniform;
    drawn_.points.resize(all);
    drawn_.kinds.reserve(all);
    drawn_.edgeNormals.resize(options.edge);
  }

  DrawnPoints draw() {
    const mesh::AreaPoints onSurface(surface_);
    drawKind(PointKind::surface, options_.surface, [&](Random& random, std::size_t) { return onSurface.draw(random); });
    if (options_.edge > 0) {
      const SharpEdges edges(surface_, options_.sharpAngleDegrees);
      drawKind(PointKind::edge, options_.edge, [&](Random& random, std::size_t i) {
        Vector3 point;
        edges.draw(random, point, drawn_.edgeNormals[i]);
        return point;
      });
    }
    const double radius = radiusOf(surface_);
    drawKind(PointKind::near, options_.near, [&](Random& random, std::size_t i) {
      const Vector3 point = onSurface.draw(random);
      return Vector3(point + radius * options_.widths[i % 2] * gaussian(random));
    });
    const Box box = uniformBox(surface_, options_.enlargement);
    drawKind(PointKind::uniform, options_.uniform, [&](Random& random, std::size_t) { return random.inBox(box); });
    return std::move(drawn_);
  }

 private:
  /// Sets the next `count` points to draw(random numbers, index of the point within its kind).
  template <typename Draw>
  void drawKind(PointKind kind, std::size_t count, const Draw& draw) {
    const std::uint64_t seed = Random(options_.seed, static_cast<std::uint64_t>(kind)).next();
    const std::size_t first = drawn_.kinds.size();
    drawn_.kinds.insert(drawn_.kinds.end(), count, kind);
    constexpr std::size_t kChunk = 4096;
    detail::forEachChunk(count, kChunk, progress_, "drawing points",
                         [&](std::size_t, std::size_t begin, std::size_t n) {
                           for (std::size_t i = begin; i < begin + n; ++i) {
                             Random random(seed, i);
                             const Vector3 point = draw(random, i);
                             drawn_.points[first + i] = options_.floatPoints ? detail::inSinglePrecision(point) : point;
                           }
                         });
  }

  const TriangleMesh& surface_;
  const SamplePointsOptions& options_;
  const Progress& progress_;
  DrawnPoints drawn_;
};

}  // namespace

Vector3 normalOf(const TriangleMesh& mesh, std::size_t triangle) {
  const auto [a, b, c] = cornersOf(mesh, mesh.triangles[triangle]);
  const Vector3 normal = (b - a).cross(c - a);
  const double length = normal.norm();
  return length > 0 ? Vector3(normal / length) : Vector3::Zero();
}

Box uniformBox(const TriangleMesh& surface, double enlargement) {
  const Box box = boundingBox(surface);
  const Vector3 margin = Vector3::Constant(enlargement * box.sizes().maxCoeff());
  return {box.min() - margin, box.max() + margin};
}

DrawnPoints drawPoints(const TriangleMesh& surface, const SamplePointsOptions& options, const Progress& progress) {
  DrawnPoints drawn = KindByKind(surface, options, progress).draw();
  const auto isInRange = [](const Vector3& x) { return x.cwiseAbs().maxCoeff() <= kLargestCoordinate; };
  if (!std::ranges::all_of(drawn.points, isInRange))
    throw Error(
        ErrorKind::option, "samples",
        options.floatPoints
            ? "coordinates of points exceed the range of single precision; take double precision, or scale the mesh"
            : "coordinates of points exceed 1e100; give a smaller width or box");
  return drawn;
}

}  // namespace hpsdf::samples
