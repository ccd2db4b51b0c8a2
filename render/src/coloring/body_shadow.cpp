#include "coloring/body_shadow.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "scene/body_view.h"

namespace hpsdf::render {
namespace {

constexpr int kMapSize = 2048;            // pixels of the lamp's view along each side
constexpr double kLargestCaster = 3;      // of the bodies that throw shadows, in lengths of the scene
constexpr int kTapsAcross = 7;            // samples of the lamp's view at a point, along each side of a square
constexpr double kShadowBorder = 0.004;   // half the width of a shadow's border, in lengths of the scene
constexpr double kLeastLampCosine = 0.1;  // least cosine, towards the lamp, by which the slope of a surface is computed
constexpr double kClearance = 2;          // pixels of the lamp's view by which a point is lifted off its own surface

/// The bodies that throw shadows, as the lamp sees them.
class LampView {
 public:
  LampView(BodyRenderer& renderer, std::span<const Body> bodies, const Vector3& toKey, double extent) {
    Box box;
    std::vector<Body> casters;
    for (const Body& body : bodies) {
      const Box own = renderer.bounds({&body, 1});
      if (own.diagonal().norm() > kLargestCaster * extent) continue;
      casters.push_back(body);
      box.extend(own);
    }
    if (casters.empty()) return;
    const double half = 0.5 * box.diagonal().norm();
    const Vector3 across = toKey.unitOrthogonal();
    camera_ = {box.center() + 1.01 * half * toKey, -toKey, half * across, half * toKey.cross(across),
               Projection::orthographic};
    right_ = camera_.right.normalized();
    up_ = camera_.up.normalized();
    pixel_ = 2 * half / kMapSize;
    step_ = kShadowBorder * extent / pixel_ / (kTapsAcross / 2);
    map_ = renderer.view(camera_, casters, kMapSize, kMapSize);
  }

  bool isEmpty() const { return map_.width == 0; }

  /// Returns the share of the lamp that bodies leave at a point of a surface.
  float lit(const Vector3& point, const Vector3& normal) const {
    const Vector3 from = point + kClearance * pixel_ * normal - camera_.eye;
    const double x = (from.dot(camera_.right) / camera_.right.squaredNorm() + 1) * 0.5 * kMapSize;
    const double y = (1 - from.dot(camera_.up) / camera_.up.squaredNorm()) * 0.5 * kMapSize;
    const double depth = from.dot(camera_.forward) - kClearance * pixel_;
    // A tap beside the point is compared with the tangent plane there, so that a slanted surface does not hide itself.
    const double towardsLamp = std::max(kLeastLampCosine, -normal.dot(camera_.forward));
    const double slopeX = step_ * pixel_ * normal.dot(right_) / towardsLamp;
    const double slopeY = -step_ * pixel_ * normal.dot(up_) / towardsLamp;
    int hidden = 0;
    for (int j = -kTapsAcross / 2; j <= kTapsAcross / 2; ++j)
      for (int i = -kTapsAcross / 2; i <= kTapsAcross / 2; ++i)
        hidden += hides(x + i * step_, y + j * step_, depth + i * slopeX + j * slopeY);
    return 1 - float(hidden) / (kTapsAcross * kTapsAcross);
  }

 private:
  bool hides(double x, double y, double depth) const {
    if (!(x >= 0 && x < kMapSize && y >= 0 && y < kMapSize)) return false;
    const std::size_t i = std::size_t(y) * kMapSize + std::size_t(x);
    return map_.hit(i) && double(map_.distance[i]) < depth;
  }

  Camera camera_ = {};
  Vector3 right_ = Vector3::Zero(), up_ = Vector3::Zero();  ///< unit vectors of the lamp's view
  double pixel_ = 0, step_ = 0;  ///< size of a pixel in world units; distance of samples in pixels
  BodyBuffers map_ = {};
};

}  // namespace

void throwShadows(BodyRenderer& renderer, std::span<const Body> bodies, const SurfaceView& view,
                  const ViewBuffers& buffers, const Vector3& toKey, double extent, std::vector<float>& lit) {
  const LampView lamp(renderer, bodies, toKey, extent);
  if (lamp.isEmpty()) return;
  tbb::parallel_for(0, buffers.height, [&](int y) {
    for (int x = 0; x < buffers.width; ++x) {
      const std::size_t i = std::size_t(y) * buffers.width + x;
      if (!buffers.covered(i) || lit[i] <= 0) continue;
      lit[i] *= lamp.lit(pointAt(view, buffers, x, y), buffers.normal[i].cast<double>());
    }
  });
}

}  // namespace hpsdf::render
