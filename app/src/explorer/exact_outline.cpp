#include "explorer/exact_outline.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "hpsdf/render/color_maps.h"
#include "hpsdf/types.h"

namespace hpsdf::app {
namespace {

constexpr int kBlock = 8;  // pixels along each side of a block

struct OutlinePixel {
  int x, y;
};

/// Returns the signed distances at the pixels.
std::vector<double> distancesAt(const std::vector<OutlinePixel>& pixels, const render::Image& image,
                                const render::SliceView& view, const DistanceFunction& exact) {
  std::vector<Vector3> points(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i)
    points[i] = render::pixelPoint(view, pixels[i].x, pixels[i].y, image.width, image.height);
  std::vector<double> values(pixels.size());
  exact(points, values);
  return values;
}

}  // namespace

void drawExactOutline(render::Image& image, const render::SliceView& view, const DistanceFunction& exact) {
  // A distance changes by no more than the way between two points. The surface can meet only blocks whose middle is
  // closer to it than their corners are to the middle; the pixels right of and below a block are seen from it too.
  std::vector<OutlinePixel> middles;
  for (int y = kBlock / 2; y < image.height + kBlock; y += kBlock)
    for (int x = kBlock / 2; x < image.width + kBlock; x += kBlock) middles.push_back({x, y});
  const double pixel = std::max(view.right.norm() / image.width, view.up.norm() / image.height);
  const double reach = std::sqrt(2.0) * (kBlock / 2 + 2) * pixel;
  const render::Color color = render::levelColor(kExactDegree);
  const std::vector<double> atMiddles = distancesAt(middles, image, view, exact);
  for (std::size_t i = 0; i < middles.size(); ++i) {
    if (!(std::abs(atMiddles[i]) <= reach)) continue;
    constexpr int kSide = kBlock + 1;
    std::vector<OutlinePixel> pixels;
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) pixels.push_back({middles[i].x - kBlock / 2 + x, middles[i].y - kBlock / 2 + y});
    const std::vector<double> values = distancesAt(pixels, image, view, exact);
    for (int n = 0; n < kSide * kSide; ++n) {
      const auto [x, y] = pixels[std::size_t(n)];
      if (n % kSide == kBlock || n / kSide == kBlock || x >= image.width || y >= image.height) continue;
      const bool inside = values[std::size_t(n)] < 0;
      if (inside != (values[std::size_t(n + 1)] < 0) || inside != (values[std::size_t(n + kSide)] < 0))
        image.at(x, y) = color;
    }
  }
}

}  // namespace hpsdf::app
