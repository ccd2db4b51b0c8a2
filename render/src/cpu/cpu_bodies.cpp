// Intersects each pixel's ray with every triangle whose bounding rectangle in the picture contains the pixel.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "hpsdf/render/bodies.h"
#include "scene/body_meshes.h"
#include "scene/body_view.h"
#include "scene/pixel_rows.h"

namespace hpsdf::render {
namespace {

constexpr double kEdgeTolerance = 1e-12;  // barycentric tolerance, so that no ray passes between two triangles

struct BodyRay {
  Vector3 start, direction;
};

struct TriangleHit {
  double distance;
  Vector3 barycentric;
  bool fromBehind;  ///< whether the ray meets the triangle's back, the side from which the corners run clockwise
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

/// Renders one view of bodies into buffers.
class BodyView {
 public:
  BodyView(const BodyMeshes& meshes, const Camera& camera, std::span<const Body> bodies, BodyBuffers& buffers)
      : meshes_(meshes),
        camera_(camera),
        bodies_(bodies),
        buffers_(buffers),
        leastDepth_(leastDepth(camera, farthestDepth(camera, meshes.bounds(bodies)))) {}

  void fill() {
    std::vector<PixelRect> rects(bodies_.size());
    tbb::parallel_for(std::size_t{0}, bodies_.size(),
                      [&](std::size_t body) { rects[body] = pixelsOf(project(bodies_[body]).inPicture); });
    forEachStrip(buffers_.height, rects, [&](int y0, int y1, const std::vector<std::uint32_t>& inStrip) {
      if (inStrip.empty()) return;
      std::vector<BodyRay> rays;
      for (int y = y0; y < y1; ++y)
        for (int x = 0; x < buffers_.width; ++x)
          rays.push_back({pixelEye(camera_, x, y, buffers_.width, buffers_.height),
                          pixelRay(camera_, x, y, buffers_.width, buffers_.height)});
      std::vector<double> nearest(rays.size(), std::numeric_limits<double>::infinity());
      for (const std::uint32_t body : inStrip) draw(body, y0, y1, rays, nearest);
    });
  }

 private:
  /// The vertices of a body, in world coordinates and projected to the picture.
  struct ProjectedBody {
    std::vector<Vector3> points;
    std::vector<PicturePoint> inPicture;
  };

  ProjectedBody project(const Body& body) const {
    ProjectedBody result;
    for (const Vector3& vertex : meshes_[body.mesh].vertices()) {
      result.points.push_back(body.worldFromBody * vertex);
      result.inPicture.push_back(render::project(camera_, result.points.back(), buffers_.width, buffers_.height));
    }
    return result;
  }

  /// The pixels that may see the convex hull of the points. With parallel rays, points behind the eye have a
  /// position in the picture too.
  PixelRect pixelsOf(std::span<const PicturePoint> points) const {
    const bool parallel = camera_.projection == Projection::orthographic;
    return pixelsAround(points, parallel ? -std::numeric_limits<double>::infinity() : leastDepth_, buffers_.width,
                        buffers_.height);
  }

  /// Draws a body into the rows y0 to y1 − 1 of the picture. `rays` are the rays of the pixels in these rows.
  void draw(std::uint32_t body, int y0, int y1, const std::vector<BodyRay>& rays, std::vector<double>& nearest) {
    const auto [points, inPicture] = project(bodies_[body]);
    const std::vector<Triangle>& triangles = meshes_[bodies_[body].mesh].triangles();
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      const auto& [a, b, c] = triangles[t];
      const PixelRect rect = pixelsOf(std::array{inPicture[a], inPicture[b], inPicture[c]});
      for (int y = std::max(rect.y0, y0); y < std::min(rect.y1, y1); ++y)
        for (int x = rect.x0; x < rect.x1; ++x) {
          const std::size_t inStrip = std::size_t(y - y0) * buffers_.width + x;
          const BodyRay& ray = rays[inStrip];
          const auto hit = intersect(ray, points[a], points[b], points[c]);
          if (!hit || hit->distance >= nearest[inStrip]) continue;
          if (hit->distance * ray.direction.dot(camera_.forward) < leastDepth_) continue;
          nearest[inStrip] = hit->distance;
          showBody(meshes_, bodies_, {body, t, hit->distance, hit->barycentric, hit->fromBehind},
                   std::size_t(y) * buffers_.width + x, buffers_);
        }
    }
  }

  const BodyMeshes& meshes_;
  const Camera& camera_;
  std::span<const Body> bodies_;
  BodyBuffers& buffers_;
  double leastDepth_;
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
