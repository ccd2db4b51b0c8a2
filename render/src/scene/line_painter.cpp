#include "scene/line_painter.h"

#include <tbb/parallel_for.h>

#include <cmath>

#include "scene/pixel_rows.h"

namespace hpsdf::render {
namespace {

constexpr double kNearDepth = 1e-3;  // least depth at which lines are drawn, in domain diagonals

}  // namespace

LinePainter::LinePainter(const Camera& camera, const Box& domain, const ViewBuffers& buffers, double lineWidth,
                         LineStyle style)
    : camera_(camera),
      buffers_(buffers),
      style_(style),
      parallel_(camera.projection == Projection::orthographic),
      pixel_(pixelSize(camera, 1, buffers.height)),
      width_(lineWidth),
      radius_(lineWidth / 2 + 0.5),
      nearDepth_(kNearDepth * domain.diagonal().norm()) {
  const double middle = (domain.center() - camera.eye).dot(camera.forward);
  const double half = 0.5 * domain.sizes().dot(camera.forward.cwiseAbs());
  nearest_ = std::max(0.0, middle - half);
  farthest_ = std::max(middle + half, nearest_ + 1e-9 * half);
}

bool LinePainter::mayShow(const Box& box) const {
  const double middle = (box.center() - camera_.eye).dot(camera_.forward);
  const double half = 0.5 * box.sizes().dot(camera_.forward.cwiseAbs());
  return middle + half > nearDepth_ && pixelsAt(box.sizes().maxCoeff(), middle - half) > style_.goneLength * width_;
}

std::vector<float> LinePainter::coverage(const std::vector<SpaceLine>& lines) const {
  std::vector<float> coverage(buffers_.cell.size(), 0.0F);
  std::vector<Projected> shown(lines.size());
  std::vector<PixelRect> rects(lines.size());
  tbb::parallel_for(std::size_t{0}, lines.size(), [&](std::size_t n) {
    shown[n] = projected(lines[n]);
    rects[n] = rectOf(shown[n]);
  });
  forEachStrip(buffers_.height, rects, [&](int y0, int y1, const std::vector<std::uint32_t>& inStrip) {
    for (const std::uint32_t n : inStrip) paint(shown[n], y0, y1, coverage);
  });
  return coverage;
}

/// Projects a line to the picture, without the part behind the eye, and sets its strength.
LinePainter::Projected LinePainter::projected(SpaceLine line) const {
  const auto toPicture = [&](const Vector3& p) { return project(camera_, p, buffers_.width, buffers_.height); };
  Projected result{line, toPicture(line.a), toPicture(line.b)};
  if (std::max(result.from.depth, result.to.depth) <= nearDepth_) return result;
  const double length = pixelsAt(line.fadeLength, 0.5 * (result.from.depth + result.to.depth));
  result.strength =
      std::max(style_.leastStrength, smoothStep(style_.goneLength * width_, style_.fullLength * width_, length));
  if (std::min(result.from.depth, result.to.depth) >= nearDepth_) return result;
  const double share = (nearDepth_ - result.from.depth) / (result.to.depth - result.from.depth);
  const Vector3 cut = line.a + share * (line.b - line.a);
  const bool fromBehind = result.from.depth < nearDepth_;
  (fromBehind ? result.line.a : result.line.b) = cut;
  (fromBehind ? result.from : result.to) = toPicture(cut);
  return result;
}

/// Returns the pixels that a line may cover; they are empty for a line that is not drawn.
PixelRect LinePainter::rectOf(const Projected& line) const {
  if (line.strength <= 0) return {};
  return pixelsNear({line.from.x, line.from.y}, {line.to.x, line.to.y}, radius_,
                    {0, 0, buffers_.width, buffers_.height});
}

/// Draws the part of a line in the rows from y0 to y1 − 1.
void LinePainter::paint(const Projected& line, int y0, int y1, std::vector<float>& coverage) const {
  forEachPixelNear({line.from.x, line.from.y}, {line.to.x, line.to.y}, radius_, {0, y0, buffers_.width, y1},
                   [&](const NearPixel& near) { paintPixel(line, near, coverage); });
}

void LinePainter::paintPixel(const Projected& line, const NearPixel& near, std::vector<float>& coverage) const {
  const double t = near.t, covered = std::min(radius_ - near.distance, 1.0);
  const std::size_t i = std::size_t(near.y) * buffers_.width + near.x;
  // Find the parameter s of the point along the line in space, because equal steps in a perspective picture are not
  // equal steps in space.
  const double toFar = parallel_ ? 1 - t : (1 - t) * line.to.depth, toNear = parallel_ ? t : t * line.from.depth;
  const double s = toNear / (toFar + toNear);
  const double depth = line.from.depth + s * (line.to.depth - line.from.depth);
  const double relativeDepth = std::clamp((depth - nearest_) / (farthest_ - nearest_), 0.0, 1.0);
  float strength = line.strength * static_cast<float>(covered * (1 + relativeDepth * (style_.farthestStrength - 1)));
  if (strength <= coverage[i]) return;
  if (buffers_.covered(i)) {
    const Vector3 p = line.line.a + s * (line.line.b - line.line.a);
    // Allow a tolerance, because the buffers show the surface at sample points up to two pixels away from the line.
    const double tolerance = (width_ + 2) * (parallel_ ? pixel_ : pixel_ * depth) + style_.slack;
    if ((parallel_ ? depth : (p - camera_.eye).norm()) > double(buffers_.distance[i]) + tolerance)
      strength *= style_.hiddenStrength;
  }
  coverage[i] = std::max(coverage[i], strength);
}

/// Returns the size in pixels of a world length that lies at a given depth from the eye.
double LinePainter::pixelsAt(double length, double depth) const {
  return length / pixelSize(camera_, std::max(depth, nearDepth_), buffers_.height);
}

}  // namespace hpsdf::render
