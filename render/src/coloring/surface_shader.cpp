#include "coloring/surface_shader.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hpsdf/render/bodies.h"

namespace hpsdf::render {
namespace {

constexpr Color kClay = {210, 153, 119};
constexpr Color kPlainBox = {222, 216, 204};

constexpr int kRings = 3, kTapsInRing = 6;
constexpr double kOcclusionRadius = 0.035;  // radius of the outer ring of taps, as a share of the view's height
constexpr double kFlatRise = 0.06;  // sine of the angle above the tangent plane up to which a tap counts as flat
constexpr double kOcclusionStrength = 2.6;

}  // namespace

CameraFrame::CameraFrame(const ViewBuffers& buffers, const Camera& camera)
    : buffers_(buffers), parallel_(camera.projection == Projection::orthographic) {
  axes_.row(0) = camera.right.normalized().cast<float>();
  axes_.row(1) = camera.up.normalized().cast<float>();
  axes_.row(2) = -camera.forward.normalized().cast<float>();
  halfWidth_ = static_cast<float>(camera.right.norm());
  halfHeight_ = static_cast<float>(camera.up.norm());
}

Eigen::Vector3f CameraFrame::ray(int x, int y) const {
  return parallel_ ? Eigen::Vector3f(0, 0, -1) : onPicture(x, y, -1).normalized();
}

Eigen::Vector3f CameraFrame::position(int x, int y) const {
  const float distance = buffers_.distance[std::size_t(y) * buffers_.width + x];
  return parallel_ ? onPicture(x, y, -distance) : distance * ray(x, y);
}

Eigen::Vector3f CameraFrame::normal(int x, int y, const Eigen::Vector3f& toEye) const {
  const Eigen::Vector3f n = axes_ * buffers_.normal[std::size_t(y) * buffers_.width + x];
  const float facing = n.dot(toEye);
  return facing >= 0 ? n : (n - facing * toEye).normalized();
}

Eigen::Vector3f CameraFrame::onPicture(int x, int y, float z) const {
  const float u = 2 * (float(x) + 0.5F) / float(buffers_.width) - 1;
  const float v = 1 - 2 * (float(y) + 0.5F) / float(buffers_.height);
  return {u * halfWidth_, v * halfHeight_, z};
}

AmbientOcclusion::AmbientOcclusion(const ViewBuffers& buffers, const CameraFrame& frame)
    : buffers_(buffers), frame_(frame) {
  // Rotate each ring of taps against the one within it. All pixels have the same taps, so that there is no noise.
  for (int ring = 1; ring <= kRings; ++ring)
    for (int i = 0; i < kTapsInRing; ++i) {
      const double angle = 2 * std::numbers::pi * (i + ring * 0.381966) / kTapsInRing;
      const double radius = kOcclusionRadius * buffers.height * ring * ring / (kRings * kRings);
      taps_.push_back({static_cast<int>(std::lround(radius * std::cos(angle))),
                       static_cast<int>(std::lround(radius * std::sin(angle)))});
    }
}

float AmbientOcclusion::operator()(int x, int y, const Eigen::Vector3f& position, const Eigen::Vector3f& normal) const {
  const float radius = float(kOcclusionRadius) * frame_.heightAt(-position.z());
  float occluded = 0;
  for (const auto& [dx, dy] : taps_) {
    const int tapX = x + dx, tapY = y + dy;
    if (tapX < 0 || tapX >= buffers_.width || tapY < 0 || tapY >= buffers_.height) continue;
    if (!buffers_.covered(std::size_t(tapY) * buffers_.width + tapX)) continue;
    const Eigen::Vector3f towards = frame_.position(tapX, tapY) - position;
    const float distance = towards.norm();
    if (distance <= 0) continue;
    // A distant thing in front of the point hides it from the eye but not from the light.
    const float near = std::max(0.0F, 1 - distance / (3 * radius));
    occluded += near * std::max(0.0F, towards.dot(normal) / distance - float(kFlatRise));
  }
  return std::max(0.0F, 1 - float(kOcclusionStrength) * occluded / float(taps_.size()));
}

LinearColor Lights::diffuse(const Eigen::Vector3f& n, float open) const {
  const float wrapped = std::max(0.0F, (n.dot(key) + 0.12F) / 1.12F);
  const LinearColor lamps =
      keyColor * wrapped + fillColor * std::max(0.0F, n.dot(fill)) + rimColor * std::max(0.0F, n.dot(rim));
  // Occlusion removes all of the sky's light and a part of the lamps'.
  return lamps * (0.45F + 0.55F * open) + mix(ground, sky, 0.5F + 0.5F * n.y()) * open;
}

LinearColor Lights::gloss(const Eigen::Vector3f& n, const Eigen::Vector3f& toEye) const {
  const Eigen::Vector3f half = (key + toEye).normalized();
  const float highlight = 0.13F * std::pow(std::max(0.0F, n.dot(half)), 36.0F);
  const float facing = 1 - std::clamp(n.dot(toEye), 0.0F, 1.0F);
  const float fresnel = 0.12F * facing * facing * facing * facing;
  return keyColor * highlight + sky * fresnel;
}

SurfaceShader::SurfaceShader(const ViewBuffers& buffers, const Camera& camera,
                             const std::function<LinearColor(std::size_t)>& color, std::span<const LinearColor> bodies)
    : buffers_(buffers),
      frame_(buffers, camera),
      occlusion_(buffers, frame_),
      color_(color),
      bodies_(bodies),
      clay_(decodeSrgb(kClay)),
      plainBox_(decodeSrgb(kPlainBox)) {}

LinearColor SurfaceShader::operator()(int x, int y) const {
  const std::size_t i = std::size_t(y) * buffers_.width + x;
  const Eigen::Vector3f toEye = -frame_.ray(x, y);
  const Eigen::Vector3f n = frame_.normal(x, y, toEye);
  const float open = occlusion_(x, y, frame_.position(x, y), n);
  if (!color_ || buffers_.showsBody(i)) {
    const LinearColor& material = materialAt(i);
    return material.cwiseProduct(lights_.diffuse(n, open)) + open * lights_.gloss(n, toEye);
  }
  // Light colours by a quantity softly and with white light, so that they match the legend's.
  const float light = 0.50F + 0.58F * std::max(0.0F, (n.dot(lights_.key) + 0.5F) / 1.5F) - 0.10F * (1 - n.z());
  return color_(i) * light * (0.35F + 0.65F * open) +
         LinearColor::Constant(0.4F * open * lights_.gloss(n, toEye).mean());
}

const LinearColor& SurfaceShader::materialAt(std::size_t i) const {
  if (buffers_.showsBody(i)) return bodies_[buffers_.body[i]];
  return buffers_.shows(i, Shown::box) ? plainBox_ : clay_;
}

Color surfaceColor() { return kClay; }

}  // namespace hpsdf::render
