#pragma once
// The light on the surface, boxes and bodies in the picture of a camera.

#include <functional>
#include <span>
#include <vector>

#include "hpsdf/render/view.h"
#include "image/color.h"

namespace hpsdf::render {

/// Positions and normals that the samples of a view show, in the camera's frame: x right, y up, z towards the eye. The
/// origin is the eye; for parallel rays, the centre of the plane where they start.
class CameraFrame {
 public:
  CameraFrame(const ViewBuffers& buffers, const Camera& camera);

  /// Unit direction of the ray of a sample.
  Eigen::Vector3f ray(int x, int y) const;

  Eigen::Vector3f position(int x, int y) const;

  /// The normal that a sample shows. A normal that jumps of the field turn away from the eye is replaced by the nearest
  /// one perpendicular to the ray; otherwise single dark samples speckle the silhouettes.
  Eigen::Vector3f normal(int x, int y, const Eigen::Vector3f& toEye) const;

  /// Height of the view at this depth before the eye.
  float heightAt(float depth) const { return parallel_ ? 2 * halfHeight_ : 2 * halfHeight_ * depth; }

 private:
  Eigen::Vector3f onPicture(int x, int y, float z) const;

  const ViewBuffers& buffers_;
  bool parallel_;                         // true for an orthographic camera
  Eigen::Matrix3f axes_;                  // its rows are the camera's axes
  float halfWidth_ = 0, halfHeight_ = 0;  // half the view's extent, in perspective at depth 1
};

/// Ambient occlusion from the neighbourhood on the screen: neighbours that rise above a point's tangent plane take
/// ambient light from it. Folds and contacts darken, which shows shape better than lamps do.
class AmbientOcclusion {
 public:
  AmbientOcclusion(const ViewBuffers& buffers, const CameraFrame& frame);

  /// The share of ambient light that arrives: 1 on open ground, towards 0 in a deep fold.
  float operator()(int x, int y, const Eigen::Vector3f& position, const Eigen::Vector3f& normal) const;

 private:
  struct Tap {
    int dx, dy;
  };

  const ViewBuffers& buffers_;
  const CameraFrame& frame_;
  std::vector<Tap> taps_;
};

/// Lamps that move with the camera, in its frame, as in portrait photography: a warm key light from the upper left, a
/// cool fill light from the right, a rim light from behind, and the sky above the ground.
struct Lights {
  Eigen::Vector3f key = Eigen::Vector3f(-0.55F, 0.62F, 0.56F).normalized();
  Eigen::Vector3f fill = Eigen::Vector3f(0.85F, 0.10F, 0.52F).normalized();
  Eigen::Vector3f rim = Eigen::Vector3f(0.35F, 0.55F, -0.76F).normalized();
  LinearColor keyColor = {0.98F, 0.91F, 0.80F};
  LinearColor fillColor = {0.12F, 0.16F, 0.23F};
  LinearColor rimColor = {0.26F, 0.30F, 0.36F};
  LinearColor sky = {0.26F, 0.29F, 0.34F};
  LinearColor ground = {0.10F, 0.08F, 0.07F};

  /// Light on a matt surface with unit normal n, of which the share `open` of the ambient light arrives.
  LinearColor diffuse(const Eigen::Vector3f& n, float open) const;

  /// Blinn-Phong highlight of the key light, and the sky mirrored at grazing angles (Schlick's Fresnel term).
  LinearColor gloss(const Eigen::Vector3f& n, const Eigen::Vector3f& toEye) const;
};

/// The colour of a sample that shows the surface, a box or a body.
class SurfaceShader {
 public:
  /// `color` returns the colour of a sample by its index; an empty function stands for the materials. Refers to all
  /// arguments except the camera.
  SurfaceShader(const ViewBuffers& buffers, const Camera& camera, const std::function<LinearColor(std::size_t)>& color,
                std::span<const LinearColor> bodies);
  SurfaceShader(const SurfaceShader&) = delete;  // occlusion_ refers to frame_

  LinearColor operator()(int x, int y) const;

 private:
  const LinearColor& materialAt(std::size_t i) const;

  const ViewBuffers& buffers_;
  CameraFrame frame_;
  AmbientOcclusion occlusion_;
  const std::function<LinearColor(std::size_t)>& color_;
  std::span<const LinearColor> bodies_;
  Lights lights_;
  LinearColor clay_, plainBox_;
};

}  // namespace hpsdf::render
