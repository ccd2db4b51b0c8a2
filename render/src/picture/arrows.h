#pragma once
// Arrows along the gradient of a field, painted over a finished view.

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/vector_picture.h"
#include "hpsdf/render/view.h"
#include "image/text.h"

namespace hpsdf::render {

constexpr double kArrowShare = 0.8;  ///< length of an arrow for a gradient of length 1, as a share of the spacing

/// An arrow in a picture. Its ends are in pixels from the upper left corner of the picture.
struct Arrow {
  Eigen::Vector2d from, to;
  /// The opacity of the arrow, 0 to 1, at pixel (x, y), which lies at parameter t along the arrow (0 to 1). If
  /// the function is empty, the opacity is 1.
  std::function<float(double t, int x, int y)> strength = {};
};

/// Arrows that show the gradient, projected onto the plane of the slice. An arrow is centred on every `spacing`-th
/// pixel along both axes if this pixel shows the field. No arrow is longer than the spacing, so that arrows do not
/// overlap.
std::vector<Arrow> gradientArrows(const Field& field, const SliceView& view, const ViewBuffers& buffers, int samples,
                                  int spacing);

/// Arrows that show the gradient on a surface. They start at the visible point of every `spacing`-th pixel along both
/// axes. An arrow is faint where something nearer hides it. The buffers must outlive the arrows.
std::vector<Arrow> gradientArrows(const Field& field, const SurfaceView& view, const ViewBuffers& buffers, int samples,
                                  int spacing);

/// Paints dark arrows with a light casing, which are visible on any colour; only pixels within `rect` change.
void paintArrows(Image& image, const PixelRect& rect, const std::vector<Arrow>& arrows, double lineWidth);

/// Returns the arrows as shapes of a vector picture, with the same casing. All arrows are fully opaque.
std::vector<VectorShape> arrowShapes(const std::vector<Arrow>& arrows, double lineWidth);

}  // namespace hpsdf::render
