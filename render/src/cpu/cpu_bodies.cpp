// Intersects each pixel's ray with every triangle whose bounding rectangle in the picture contains the pixel.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "hpsdf/render/bodies.h"
#include "scene/body_meshes.h"
#include "scene/body_view.h"

namespace hpsdf::render {
namespace {

constexpr int kStrip = 16;                 // rows that one task fills
constexpr double kEdgeTolerance = 1e-12;   // in barycentric coordinates, so that no ray passes between two triangles
constexpr double kRectangleMargin = 1e-6;  // margin of triangles' rectangles for rounding, pixels

struct BodyRay {
  Vector3 start, direction;
};

/// The pixels from first to last along one axis of the picture; none where last < first.
struct PixelRange {
  int first, last;
};

/// The pixels, of 0 to count − 1, whose middles may lie in [low, high].
PixelRange pixelsIn(double low, double high, int count) {
  const auto clamped = [&](double x) { return static_cast<int>(std::clamp(x, -1.0, double(count))); };
  return {std::max(0, clamped(std::ceil(low - 0.5 - kRectangleMargin))),
          std::min(count - 1, clamped(std::floor(high - 0.5 + kRectangleMargin)))};
}

struct TriangleHit {
  double distance;
  Vector3 barycentric;
  bool fromBehind;  ///< whether the ray meets the side from which the corners run clockwise
};

/// The intersection of a ray with a triangle (Möller, Trumbore 1997).
std::optional<TriangleHit> intersect(const BodyRay& ray, const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 toB = b - a, toC = c - a, across = ray.direction.cross(toC);
  const double determinant = toB.dot(across);
  if (determinant == 0) return std::nullopt;  // the ray is parallel to the triangle, or the triangle is degenerate
  const Vector3 fromA = ray.start - a, q = fromA.cross(toB);
  const double ofB = fromA.dot(across) / determinant, ofC = ray.direction.dot(q) / determinant;
  if (!(ofB >= -kEdgeTolerance && ofC >= -kEdgeTolerance && ofB + ofC <= 1 + kEdgeTolerance)) return std::nullopt;
  return TriangleHit{toC.dot(q) / determinant, {1 - ofB - ofC, ofB, ofC}, determinant < 0};
}

/// Fills the buffers of one view.
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
  /// The vertices of a body, in the world and in the picture.
  struct ProjectedBody {
    std::vector<Vector3> points;
    std::vector<PicturePoint> inPicture;
  };

  PicturePoint projected(const Vector3& point) const {
    return project(camera_, point, buffers_.width, buffers_.height);
  }

  /// Returns true if a point lies before the eye, so that its position in the picture is defined.
  bool isBeforeEye(const PicturePoint& p) const {
    return camera_.projection == Projection::orthographic || p.depth >= leastDepth_;
  }

  /// The rows that may see a body.
  PixelRange rowsOf(const Body& body) const {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    bool anyBefore = false, anyBehind = false;
    for (const Vector3& vertex : meshes_[body.mesh].vertices()) {
      const PicturePoint p = projected(body.worldFromBody * vertex);
      (isBeforeEye(p) ? anyBefore : anyBehind) = true;
      low = std::min(low, p.y);
      high = std::max(high, p.y);
    }
    if (!anyBefore) return {0, -1};
    return anyBehind ? PixelRange{0, buffers_.height - 1} : pixelsIn(low, high, buffers_.height);
  }

  void fillStrip(const PixelRange& rows) {
    std::vector<BodyRay> rays;
    for (int y = rows.first; y <= rows.last; ++y)
      for (int x = 0; x < buffers_.width; ++x)
        rays.push_back({pixelEye(camera_, x, y, buffers_.width, buffers_.height),
                        pixelRay(camera_, x, y, buffers_.width, buffers_.height)});
    std::vector<double> nearest(rays.size(), std::numeric_limits<double>::infinity());
    ProjectedBody projectedBody;
    for (std::size_t body = 0; body < bodies_.size(); ++body)
      if (rows_[body].last >= rows.first && rows_[body].first <= rows.last)
        drawBody(body, rows, rays, projectedBody, nearest);
  }

  /// Draws a body into a strip; `projectedBody` is scratch memory.
  void drawBody(std::size_t body, const PixelRange& rows, const std::vector<BodyRay>& rays,
                ProjectedBody& projectedBody, std::vector<double>& nearest) {
    projectedBody.points.clear();
    projectedBody.inPicture.clear();
    for (const Vector3& vertex : meshes_[bodies_[body].mesh].vertices()) {
      projectedBody.points.push_back(bodies_[body].worldFromBody * vertex);
      projectedBody.inPicture.push_back(projected(projectedBody.points.back()));
    }
    const std::vector<Triangle>& triangles = meshes_[bodies_[body].mesh].triangles();
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      const auto [columns, covered] = rectangleOf(triangles[t], projectedBody.inPicture);
      const int last = std::min(covered.last, rows.last);
      for (int y = std::max(covered.first, rows.first); y <= last; ++y)
        for (int x = columns.first; x <= columns.last; ++x) {
          const std::size_t inStrip = std::size_t(y - rows.first) * buffers_.width + x;
          drawPixel(body, t, rays[inStrip], projectedBody.points, std::size_t(y) * buffers_.width + x,
                    nearest[inStrip]);
        }
    }
  }

  /// The columns and rows that may see a triangle: all of them where it extends behind the eye.
  std::pair<PixelRange, PixelRange> rectangleOf(const Triangle& triangle,
                                                const std::vector<PicturePoint>& inPicture) const {
    const PicturePoint &a = inPicture[triangle[0]], &b = inPicture[triangle[1]], &c = inPicture[triangle[2]];
    if (!isBeforeEye(a) || !isBeforeEye(b) || !isBeforeEye(c))
      return {{0, buffers_.width - 1}, {0, buffers_.height - 1}};
    const auto [left, right] = std::minmax({a.x, b.x, c.x});
    const auto [top, bottom] = std::minmax({a.y, b.y, c.y});
    return {pixelsIn(left, right, buffers_.width), pixelsIn(top, bottom, buffers_.height)};
  }

  /// Shows triangle t of a body where the pixel's ray hits it nearer than `nearest`.
  void drawPixel(std::size_t body, std::uint32_t t, const BodyRay& ray, const std::vector<Vector3>& points,
                 std::size_t pixel, double& nearest) {
    const BodyMesh& mesh = meshes_[bodies_[body].mesh];
    const Triangle& triangle = mesh.triangles()[t];
    const auto hit = intersect(ray, points[triangle[0]], points[triangle[1]], points[triangle[2]]);
    if (!hit || hit->distance >= nearest) return;
    if (hit->distance * ray.direction.dot(camera_.forward) < leastDepth_) return;
    nearest = hit->distance;
    const Vector3 normal = bodies_[body].worldFromBody.linear() * mesh.normal(t, hit->barycentric);
    buffers_.body[pixel] = static_cast<std::uint32_t>(body);
    buffers_.triangle[pixel] = t;
    buffers_.normal[pixel] = (hit->fromBehind ? Vector3(-normal) : normal).cast<float>();
    buffers_.distance[pixel] = static_cast<float>(nearest);
  }

  const BodyMeshes& meshes_;
  const Camera& camera_;
  std::span<const Body> bodies_;
  BodyBuffers& buffers_;
  double leastDepth_;
  std::vector<PixelRange> rows_;  ///< for each body the rows that may see it
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
