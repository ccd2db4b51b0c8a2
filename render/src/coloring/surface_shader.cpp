#include "coloring/surface_shader.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "hpsdf/render/bodies.h"

namespace hpsdf::render {
namespace {

constexpr Color kClay = {210, 153, 119};
constexpr Color kPlainBox = {222, 216, 204};

constexpr int kRings = 3, kTapsInRing = 6;
constexpr double kOcclusionRadius = 0.035;  // radius of the ambient occlusion, as a share of the view's height
constexpr double kFlatRise = 0.06;  // sine of the least angle above the tangent plane at which neighbours occlude
constexpr double kOcclusionStrength = 2.6;

/// The positions and normals at the samples of a view, in the camera's frame: x right, y up, z towards the eye.
/// The origin of the frame is the eye. For parallel rays it is the centre of the plane where the rays start.
class CameraFrame {
 public:
  CameraFrame(const ViewBuffers& buffers, const Camera& camera)
      : buffers_(buffers),
        parallel_(camera.projection == Projection::orthographic),
        halfWidth_(static_cast<float>(camera.right.norm())),
        halfHeight_(static_cast<float>(camera.up.norm())) {
    axes_.row(0) = camera.right.normalized().cast<float>();
    axes_.row(1) = camera.up.normalized().cast<float>();
    axes_.row(2) = -camera.forward.normalized().cast<float>();
  }

  /// Unit direction of the ray of a sample.
  Eigen::Vector3f ray(int x, int y) const {
    return parallel_ ? Eigen::Vector3f(0, 0, -1) : onPicture(x, y, -1).normalized();
  }

  Eigen::Vector3f position(int x, int y) const {
    const float distance = buffers_.distance[std::size_t(y) * buffers_.width + x];
    return parallel_ ? onPicture(x, y, -distance) : distance * ray(x, y);
  }

  /// The surface normal at a sample. A normal that points away from the eye, as it may where the field jumps, is
  /// replaced by the nearest normal perpendicular to the ray. Otherwise single dark samples would speckle the
  /// silhouettes.
  Eigen::Vector3f normal(int x, int y, const Eigen::Vector3f& toEye) const {
    const Eigen::Vector3f n = axes_ * buffers_.normal[std::size_t(y) * buffers_.width + x];
    const float facing = n.dot(toEye);
    return facing >= 0 ? n : (n - facing * toEye).normalized();
  }

  /// The height, in world units, that the view covers at a given depth in front of the eye.
  float heightAt(float depth) const { return parallel_ ? 2 * halfHeight_ : 2 * halfHeight_ * depth; }

 private:
  Eigen::Vector3f onPicture(int x, int y, float z) const {
    const float u = 2 * (float(x) + 0.5F) / float(buffers_.width) - 1;
    const float v = 1 - 2 * (float(y) + 0.5F) / float(buffers_.height);
    return {u * halfWidth_, v * halfHeight_, z};
  }

  const ViewBuffers& buffers_;
  bool parallel_;                 // true for an orthographic camera
  Eigen::Matrix3f axes_;          // its rows are the camera's axes
  float halfWidth_, halfHeight_;  // half the view's width and height, in perspective at depth 1
};

/// Light sources that move with the camera, given in the camera's frame, as in portrait photography: a warm key
/// light from the upper left, a cool fill light from the right, a rim light from behind, and light from sky and
/// ground.
struct Lights {
  explicit Lights(double tilt) {
    const Eigen::Matrix3f turned = Eigen::AngleAxisf(static_cast<float>(tilt), Eigen::Vector3f::UnitX()).matrix();
    for (Eigen::Vector3f* lamp : {&key, &fill, &rim}) *lamp = turned * *lamp;
  }

  Eigen::Vector3f key = Eigen::Vector3f(-0.55F, 0.62F, 0.56F).normalized();
  Eigen::Vector3f fill = Eigen::Vector3f(0.85F, 0.10F, 0.52F).normalized();
  Eigen::Vector3f rim = Eigen::Vector3f(0.35F, 0.55F, -0.76F).normalized();
  LinearColor keyColor = {0.98F, 0.91F, 0.80F};
  LinearColor fillColor = {0.12F, 0.16F, 0.23F};
  LinearColor rimColor = {0.26F, 0.30F, 0.36F};
  LinearColor sky = {0.26F, 0.29F, 0.34F};
  LinearColor ground = {0.10F, 0.08F, 0.07F};

  /// Light that a matt surface with the unit normal n reflects. `open` is the share of ambient light that reaches it,
  /// `lit` the share of the key light.
  LinearColor diffuse(const Eigen::Vector3f& n, float open, float lit) const {
    const float wrapped = std::max(0.0F, (n.dot(key) + 0.12F) / 1.12F);
    const LinearColor lamps =
        keyColor * (wrapped * lit) + fillColor * std::max(0.0F, n.dot(fill)) + rimColor * std::max(0.0F, n.dot(rim));
    // Occlusion can remove all ambient light of sky and ground, but only a part of the light of the lamps.
    return lamps * (0.45F + 0.55F * open) + mix(ground, sky, 0.5F + 0.5F * n.y()) * open;
  }

  /// Blinn-Phong highlight of the key light, and the sky mirrored at grazing angles (a Fresnel term like Schlick's).
  LinearColor gloss(const Eigen::Vector3f& n, const Eigen::Vector3f& toEye, float lit) const {
    const Eigen::Vector3f half = (key + toEye).normalized();
    const float highlight = 0.13F * lit * std::pow(std::max(0.0F, n.dot(half)), 36.0F);
    const float facing = 1 - std::clamp(n.dot(toEye), 0.0F, 1.0F);
    const float fresnel = 0.12F * facing * facing * facing * facing;
    return keyColor * highlight + sky * fresnel;
  }
};

class SurfaceShader {
 public:
  SurfaceShader(const ViewBuffers& buffers, const Camera& camera, const SurfaceLook& look)
      : buffers_(buffers), frame_(buffers, camera), look_(look), lights_(look.lightTilt) {
    // Arrange the taps (the neighbours of a pixel that ambient occlusion reads) in rings. Each ring is rotated against
    // the next smaller one. All pixels use the same pattern, so that the picture has no noise.
    for (int ring = 1; ring <= kRings; ++ring)
      for (int i = 0; i < kTapsInRing; ++i) {
        const double angle = 2 * std::numbers::pi * (i + ring * 0.381966) / kTapsInRing;
        const double radius = kOcclusionRadius * buffers.height * ring * ring / (kRings * kRings);
        taps_.push_back({static_cast<int>(std::lround(radius * std::cos(angle))),
                         static_cast<int>(std::lround(radius * std::sin(angle)))});
      }
  }

  LinearColor operator()(int x, int y) const {
    const std::size_t i = std::size_t(y) * buffers_.width + x;
    const Eigen::Vector3f toEye = -frame_.ray(x, y);
    const Eigen::Vector3f n = frame_.normal(x, y, toEye);
    const auto [open, lit] = lightAt(x, y, n);
    if (!look_.color || buffers_.showsBody(i)) {
      const LinearColor& material = materialAt(i);
      return material.cwiseProduct(lights_.diffuse(n, open, lit)) + open * lights_.gloss(n, toEye, lit);
    }
    // Colours that show a quantity get soft white light, so that they match the colours of the legend.
    const float wrapped = std::max(0.0F, (n.dot(lights_.key) + 0.5F) / 1.5F) * (0.55F + 0.45F * lit);
    const float light = 0.50F + 0.58F * wrapped - 0.10F * (1 - n.z());
    return look_.color(i) * light * (0.35F + 0.65F * open) +
           LinearColor::Constant(0.4F * open * lights_.gloss(n, toEye, lit).mean());
  }

 private:
  struct Light {
    float open, lit;
  };

  /// The shares of the ambient light and of the key light that reach a sample.
  Light lightAt(int x, int y, const Eigen::Vector3f& normal) const {
    const std::size_t i = std::size_t(y) * buffers_.width + x;
    const bool isMeasured = !look_.light.open.empty() && buffers_.shows(i, Shown::surface);
    return {isMeasured ? look_.light.open[i] : openness(x, y, frame_.position(x, y), normal),
            look_.light.lit.empty() ? 1 : look_.light.lit[i]};
  }

  /// The share of ambient light that reaches a point: 1 on open ground, close to 0 in a deep fold. It is blocked by
  /// neighbouring samples that rise above the tangent plane at the point. Darker folds and contacts show the shape
  /// better than lamps do.
  float openness(int x, int y, const Eigen::Vector3f& position, const Eigen::Vector3f& normal) const {
    const float radius = float(kOcclusionRadius) * frame_.heightAt(-position.z());
    float occluded = 0;
    for (const auto& [dx, dy] : taps_) {
      const int tapX = x + dx, tapY = y + dy;
      if (tapX < 0 || tapX >= buffers_.width || tapY < 0 || tapY >= buffers_.height) continue;
      if (!buffers_.covered(std::size_t(tapY) * buffers_.width + tapX)) continue;
      const Eigen::Vector3f towards = frame_.position(tapX, tapY) - position;
      const float distance = towards.norm();
      if (distance <= 0) continue;
      // A neighbour far in front of the point hides the point from the eye but does not block its ambient light.
      const float near = std::max(0.0F, 1 - distance / (3 * radius));
      occluded += near * std::max(0.0F, towards.dot(normal) / distance - float(kFlatRise));
    }
    return std::max(0.0F, 1 - float(kOcclusionStrength) * occluded / float(taps_.size()));
  }

  const LinearColor& materialAt(std::size_t i) const {
    if (buffers_.showsBody(i)) return look_.bodies[buffers_.body[i]];
    return buffers_.shows(i, Shown::box) ? plainBox_ : clay_;
  }

  struct Tap {
    int dx, dy;
  };

  const ViewBuffers& buffers_;
  CameraFrame frame_;
  const SurfaceLook& look_;
  std::vector<Tap> taps_;
  Lights lights_;
  LinearColor clay_ = decodeSrgb(kClay), plainBox_ = decodeSrgb(kPlainBox);
};

}  // namespace

double lightTiltOf(double elevationDegrees) {
  constexpr double kSteepest = 30;  // degrees; lamps of a camera that looks down more steeply stay behind
  return std::max(0.0, elevationDegrees - kSteepest) * (std::numbers::pi / 180);
}

Vector3 directionToKey(const Camera& camera, double lightTilt) {
  const Eigen::Vector3d key = Lights(lightTilt).key.cast<double>();
  return (key.x() * camera.right.normalized() + key.y() * camera.up.normalized() -
          key.z() * camera.forward.normalized())
      .normalized();
}

std::function<LinearColor(int x, int y)> surfaceShader(const ViewBuffers& buffers, const Camera& camera,
                                                       const SurfaceLook& look) {
  return SurfaceShader(buffers, camera, look);
}

Color surfaceColor() { return kClay; }

}  // namespace hpsdf::render
