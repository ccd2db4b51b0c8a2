#pragma once
// Arrows along the gradient of a field, over a finished view.

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "hpsdf/render/picture.h"
#include "image/text.h"

namespace hpsdf::render {

constexpr double kArrowShare = 0.8;  ///< of their spacing that arrows take where the gradient's length is 1

/// An arrow in a picture, pixels from its upper left corner.
struct Arrow {
  Eigen::Vector2d from, to;
  /// How strongly a place is drawn, 0 to 1, `along` the arrow from 0 to 1, at pixel (x, y); 1 where it is empty.
  std::function<float(double along, int x, int y)> strength = {};
};

/// One at every `spacing`-th pixel each way that shows the field, the pixel in its middle: the gradient's projection
/// into the plane. Longer ones than the spacing are cut short, so that they stay apart.
std::vector<Arrow> gradientArrows(const Field& field, const SliceView& view, const ViewBuffers& buffers, int samples,
                                  int spacing);

/// One at every such pixel, starting at the point that is seen there, along the gradient. Faint where something in the
/// buffers hides it. Refers to view and buffers.
std::vector<Arrow> gradientArrows(const Field& field, const SurfaceView& view, const ViewBuffers& buffers, int samples,
                                  int spacing);

/// Dark on a light casing, so that they can be seen on any colour; within `rect` only.
void paintArrows(Image& image, const PixelRect& rect, const std::vector<Arrow>& arrows, double lineWidth);

}  // namespace hpsdf::render
