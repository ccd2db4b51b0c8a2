#pragma once
// Arrows along the gradient of a field, painted over a finished view.

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/view.h"
#include "image/text.h"

namespace hpsdf::render {

constexpr double kArrowShare = 0.8;  ///< length of an arrow, as a share of the spacing, where the gradient has length 1

/// An arrow in pixels from the picture's upper left corner.
struct Arrow {
  Eigen::Vector2d from, to;
  /// The opacity, 0 to 1, at t along the arrow (0 to 1), at pixel (x, y); an empty function stands for 1.
  std::function<float(double t, int x, int y)> strength = {};
};

/// Arrows that show the gradient's projection onto the plane. They are centred on those pixels that show the
/// field, of every `spacing`-th pixel along both axes. No arrow is longer than the spacing, so that they do not
/// overlap.
std::vector<Arrow> gradientArrows(const Field& field, const SliceView& view, const ViewBuffers& buffers, int samples,
                                  int spacing);

/// Arrows that show the gradient on a surface, from the visible point of every `spacing`-th pixel along both axes.
/// They are faint where something in the buffers hides them. View and buffers must outlive the result.
std::vector<Arrow> gradientArrows(const Field& field, const SurfaceView& view, const ViewBuffers& buffers, int samples,
                                  int spacing);

/// Paints dark arrows with a light casing, which are visible on any colour; only pixels within `rect` change.
void paintArrows(Image& image, const PixelRect& rect, const std::vector<Arrow>& arrows, double lineWidth);

}  // namespace hpsdf::render
