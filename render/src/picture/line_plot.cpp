#include "hpsdf/render/line_plot.h"

#include <algorithm>
#include <cmath>

#include "coloring/color_view.h"
#include "picture/line_layout.h"

namespace hpsdf::render {
namespace {

/// Distance of x from the segment ab.
double distanceToSegment(const Eigen::Vector2d& x, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double square = along.squaredNorm();
  const double t = square > 0 ? std::clamp((x - a).dot(along) / square, 0.0, 1.0) : 0.0;
  return (x - a - t * along).norm();
}

}  // namespace

// The coverage by all segments is collected before blending, so that a curve is not darker where segments overlap.
void paintCurve(Image& image, const CurveItem& curve) {
  const PixelRect& rect = curve.within;
  if (rect.empty()) return;
  std::vector<float> covered(std::size_t(rect.width()) * rect.height(), 0.0F);
  const double half = curve.width / 2, extent = half + 1;
  const auto pixel = [](double x, int low, int high) {
    return int(std::clamp(std::floor(x), double(low), double(high)));
  };
  for (std::size_t i = 1; i < curve.points.size(); ++i) {
    const Eigen::Vector2d &a = curve.points[i - 1], &b = curve.points[i];
    if (!a.allFinite() || !b.allFinite()) continue;
    const Eigen::Vector2d low = a.cwiseMin(b), high = a.cwiseMax(b);
    const int x1 = pixel(high.x() + extent + 1, rect.x0, rect.x1), y1 = pixel(high.y() + extent + 1, rect.y0, rect.y1);
    for (int y = pixel(low.y() - extent, rect.y0, rect.y1); y < y1; ++y)
      for (int x = pixel(low.x() - extent, rect.x0, rect.x1); x < x1; ++x) {
        const double distance = distanceToSegment({x + 0.5, y + 0.5}, a, b);
        float& here = covered[std::size_t(y - rect.y0) * rect.width() + (x - rect.x0)];
        here = std::max(here, float(std::clamp(half + 0.5 - distance, 0.0, 1.0)));
      }
  }
  const LinearColor color = decodeSrgb(curve.color);
  for (int y = rect.y0; y < rect.y1; ++y)
    for (int x = rect.x0; x < rect.x1; ++x)
      if (const float share = covered[std::size_t(y - rect.y0) * rect.width() + (x - rect.x0)]; share > 0)
        image.at(x, y) = encodeSrgb(mix(decodeSrgb(image.at(x, y)), color, share));
}

Image drawLine(const Field& field, const Line& line, std::span<const double> exact, int width, int height) {
  checkPictureSize(width, height, 1);
  const LineLayout layout = layOutLine(frame(width, height), field, line, exact);
  Image image(width, height, paperColor());
  paint(image, layout.overlay);
  for (const CurveItem& curve : layout.curves) paintCurve(image, curve);
  return image;
}

}  // namespace hpsdf::render
