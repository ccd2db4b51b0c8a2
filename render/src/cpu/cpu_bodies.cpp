// Each pixel's ray against every triangle whose rectangle on the picture holds it.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "hpsdf/render/bodies.h"
#include "view/body_meshes.h"

namespace hpsdf::render {
namespace {

constexpr int kStrip = 16;             // rows that one thread fills
constexpr double kOnEdge = 1e-12;      // of a triangle's size: rays through an edge hit both triangles, never none
constexpr double kBesidePixel = 1e-6;  // pixels: rounding of rectangles

struct PixelRay {
  Vector3 start, direction;
};

/// First and last of the pixels, along an axis, whose middles may lie in [low, high]; from 0 to count − 1.
struct Pixels {
  int first, last;
};
Pixels pixelsIn(double low, double high, int count) {
  const auto place = [&](double x) { return static_cast<int>(std::clamp(x, -1.0, double(count))); };
  return {std::max(0, place(std::ceil(low - 0.5 - kBesidePixel))),
          std::min(count - 1, place(std::floor(high - 0.5 + kBesidePixel)))};
}

struct Meeting {
  double distance;
  Vector3 weights;  // of the three corners
  bool fromBehind;
};

/// Möller and Trumbore 1997.
std::optional<Meeting> meet(const PixelRay& ray, const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 toB = b - a, toC = c - a, across = ray.direction.cross(toC);
  const double determinant = toB.dot(across);
  if (determinant == 0) return std::nullopt;  // along the triangle's plane, or no triangle
  const Vector3 fromA = ray.start - a, q = fromA.cross(toB);
  const double ofB = fromA.dot(across) / determinant, ofC = ray.direction.dot(q) / determinant;
  if (!(ofB >= -kOnEdge && ofC >= -kOnEdge && ofB + ofC <= 1 + kOnEdge)) return std::nullopt;
  return Meeting{toC.dot(q) / determinant, {1 - ofB - ofC, ofB, ofC}, determinant < 0};
}

/// A view while its buffers are filled.
class BodyView {
 public:
  BodyView(const BodyMeshes& meshes, const Camera& camera, std::span<const Body> bodies, BodyBuffers& buffers)
      : meshes_(meshes), camera_(camera), bodies_(bodies), buffers_(buffers) {
    leastDepth_ = leastDepth(camera, farthestDepth(camera, meshes.bounds(bodies)));
  }

  void fill() {
    rows_.resize(bodies_.size());
    tbb::parallel_for(std::size_t{0}, bodies_.size(), [&](std::size_t body) { rows_[body] = rowsOf(bodies_[body]); });
    tbb::parallel_for(0, (buffers_.height + kStrip - 1) / kStrip, [&](int strip) {
      fillStrip({strip * kStrip, std::min((strip + 1) * kStrip, buffers_.height) - 1});
    });
  }

 private:
  PicturePoint place(const Vector3& point) const { return project(camera_, point, buffers_.width, buffers_.height); }

  /// Places on the picture mean something only before the eye.
  bool before(const PicturePoint& p) const {
    return camera_.projection == Projection::orthographic || p.depth >= leastDepth_;
  }

  Pixels rowsOf(const Body& body) const {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    bool anyBefore = false, anyBehind = false;
    for (const Vector3& vertex : meshes_[body.mesh].vertices()) {
      const PicturePoint p = place(body.worldFromBody * vertex);
      (before(p) ? anyBefore : anyBehind) = true;
      low = std::min(low, p.y);
      high = std::max(high, p.y);
    }
    if (!anyBefore) return {0, -1};
    return anyBehind ? Pixels{0, buffers_.height - 1} : pixelsIn(low, high, buffers_.height);
  }

  void fillStrip(const Pixels& rows) {
    std::vector<PixelRay> rays;
    for (int y = rows.first; y <= rows.last; ++y)
      for (int x = 0; x < buffers_.width; ++x)
        rays.push_back({pixelEye(camera_, x, y, buffers_.width, buffers_.height),
                        pixelRay(camera_, x, y, buffers_.width, buffers_.height)});
    std::vector<double> nearest(rays.size(), std::numeric_limits<double>::infinity());
    std::vector<Vector3> points;
    std::vector<PicturePoint> places;
    for (std::size_t body = 0; body < bodies_.size(); ++body) {
      if (rows_[body].last < rows.first || rows_[body].first > rows.last) continue;
      points.clear();
      places.clear();
      for (const Vector3& vertex : meshes_[bodies_[body].mesh].vertices()) {
        points.push_back(bodies_[body].worldFromBody * vertex);
        places.push_back(place(points.back()));
      }
      const std::vector<Triangle>& triangles = meshes_[bodies_[body].mesh].triangles();
      for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        const auto [columns, covered] = rectangleOf(triangles[t], places);
        const int last = std::min(covered.last, rows.last);
        for (int y = std::max(covered.first, rows.first); y <= last; ++y)
          for (int x = columns.first; x <= columns.last; ++x) {
            const std::size_t inStrip = std::size_t(y - rows.first) * buffers_.width + x;
            show(body, t, rays[inStrip], points, std::size_t(y) * buffers_.width + x, nearest[inStrip]);
          }
      }
    }
  }

  /// Columns and rows that may see a triangle: all where it reaches behind the eye.
  std::pair<Pixels, Pixels> rectangleOf(const Triangle& triangle, const std::vector<PicturePoint>& places) const {
    const PicturePoint &a = places[triangle[0]], &b = places[triangle[1]], &c = places[triangle[2]];
    if (!before(a) || !before(b) || !before(c)) return {{0, buffers_.width - 1}, {0, buffers_.height - 1}};
    const auto [left, right] = std::minmax({a.x, b.x, c.x});
    const auto [top, bottom] = std::minmax({a.y, b.y, c.y});
    return {pixelsIn(left, right, buffers_.width), pixelsIn(top, bottom, buffers_.height)};
  }

  void show(std::size_t body, std::uint32_t t, const PixelRay& ray, const std::vector<Vector3>& points,
            std::size_t pixel, double& nearest) {
    const BodyMesh& mesh = meshes_[bodies_[body].mesh];
    const Triangle& triangle = mesh.triangles()[t];
    const auto meeting = meet(ray, points[triangle[0]], points[triangle[1]], points[triangle[2]]);
    if (!meeting || meeting->distance >= nearest) return;
    if (meeting->distance * ray.direction.dot(camera_.forward) < leastDepth_) return;
    nearest = meeting->distance;
    const Vector3 normal = bodies_[body].worldFromBody.linear() * mesh.normal(t, meeting->weights);
    buffers_.body[pixel] = static_cast<std::uint32_t>(body);
    buffers_.triangle[pixel] = t;
    buffers_.normal[pixel] = (meeting->fromBehind ? Vector3(-normal) : normal).cast<float>();
    buffers_.distance[pixel] = static_cast<float>(nearest);
  }

  const BodyMeshes& meshes_;
  const Camera& camera_;
  std::span<const Body> bodies_;
  BodyBuffers& buffers_;
  double leastDepth_;
  std::vector<Pixels> rows_;  // that may see a body
};

class CpuBodyRenderer final : public BodyRenderer {
 public:
  explicit CpuBodyRenderer(std::vector<TriangleMesh> meshes) : meshes_(std::move(meshes)) {}

  BodyBuffers view(const Camera& camera, std::span<const Body> bodies, int width, int height) override {
    checkBodyView(camera, width, height);
    BodyBuffers buffers = emptyBodyBuffers(width, height);
    BodyView(meshes_, camera, bodies, buffers).fill();
    return buffers;
  }

  void moveVertices(std::size_t mesh, std::span<const Vector3> vertices) override {
    meshes_.moveVertices(mesh, vertices);
  }

  Box bounds(std::span<const Body> bodies) const override { return meshes_.bounds(bodies); }

  std::string description() const override { return "CPU, double precision"; }

 private:
  BodyMeshes meshes_;
};

}  // namespace

std::unique_ptr<BodyRenderer> makeCpuBodyRenderer(std::vector<TriangleMesh> meshes) {
  return std::make_unique<CpuBodyRenderer>(std::move(meshes));
}

}  // namespace hpsdf::render
