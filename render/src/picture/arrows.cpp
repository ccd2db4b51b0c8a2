#include "picture/arrows.h"

#include <algorithm>
#include <cmath>

#include "image/color.h"

namespace hpsdf::render {
namespace {

constexpr Color kCore = {22, 20, 34};
constexpr Color kCasing = {252, 251, 246};
constexpr float kCasingStrength = 0.75F;
// Lengths are in multiples of a thin line's width.
constexpr double kCoreWidth = 1.3;
constexpr double kCasingBorder = 1.0;  // width of the casing on either side
constexpr double kHeadLength = 5.5;
constexpr double kHeadShare = 0.6;       // greatest share of the arrow that the head takes
constexpr double kHeadHalfWidth = 0.45;  // as a share of the head's length
constexpr float kHidden = 0.3F;          // opacity of hidden parts

/// A pixel of the finished view with its middle sample.
struct Pixel {
  int x, y;
  int column, row;  ///< of the sample in the buffers
};

std::vector<Pixel> evenlySpacedPixels(const ViewBuffers& buffers, int samples, int spacing) {
  std::vector<Pixel> pixels;
  for (int y = spacing / 2; y < buffers.height / samples; y += spacing)
    for (int x = spacing / 2; x < buffers.width / samples; x += spacing) {
      const Pixel pixel{x, y, x * samples + samples / 2, y * samples + samples / 2};
      if (buffers.hit(std::size_t(pixel.row) * buffers.width + pixel.column)) pixels.push_back(pixel);
    }
  return pixels;
}

std::vector<ValueAndGradient> gradientsAt(const Field& field, const std::vector<Vector3>& points) {
  std::vector<ValueAndGradient> results(points.size());
  field.valuesAndGradients(points, results);
  return results;
}

/// The area of an arrow: a shaft with a head.
class Shape {
 public:
  Shape(const Arrow& arrow, double thin) : from_(arrow.from), length_((arrow.to - arrow.from).norm()) {
    along_ = length_ > 0 ? Eigen::Vector2d((arrow.to - arrow.from) / length_) : Eigen::Vector2d(1, 0);
    head_ = std::min(kHeadLength * thin, kHeadShare * length_);
    half_ = 0.5 * kCoreWidth * thin;
  }

  /// Parameter along the arrow of the point nearest to x, 0 to 1.
  double parameter(const Eigen::Vector2d& x) const {
    return length_ > 0 ? std::clamp((x - from_).dot(along_) / length_, 0.0, 1.0) : 0.0;
  }

  /// Signed distance of x from the arrow's outline, negative inside.
  double distance(const Eigen::Vector2d& x) const {
    const double t = (x - from_).dot(along_);
    const double across = std::abs(along_.x() * (x - from_).y() - along_.y() * (x - from_).x());
    // The shaft is a capsule that ends in the middle of the head.
    const double shaftEnd = length_ - 0.5 * head_;
    const double toShaft = std::hypot(t - std::clamp(t, 0.0, shaftEnd), across) - half_;
    // The head is an isosceles triangle; by symmetry only one half of it is considered.
    const double slope = std::hypot(1.0, kHeadHalfWidth);
    const double beyondSide = (across - kHeadHalfWidth * (length_ - t)) / slope;
    const double beyondBase = length_ - head_ - t;
    const double toHead = std::max(beyondSide, beyondBase);
    return std::min(toShaft, toHead);
  }

 private:
  Eigen::Vector2d from_, along_;
  double length_, head_, half_;
};

/// Blends a colour over the pixels that the arrows, grown by `border`, cover.
void paintShapes(Image& image, const PixelRect& rect, const std::vector<Arrow>& arrows, double thin, double border,
                 const LinearColor& color, float opacity) {
  for (const Arrow& arrow : arrows) {
    const Shape shape(arrow, thin);
    const double margin = border + kHeadHalfWidth * kHeadLength * thin + 2;
    const Eigen::Vector2d low = arrow.from.cwiseMin(arrow.to).array() - margin;
    const Eigen::Vector2d high = arrow.from.cwiseMax(arrow.to).array() + margin;
    const auto within = [](double x, int first, int last) {
      return int(std::clamp(std::floor(x), double(first), double(last)));
    };
    for (int y = within(low.y(), rect.y0, rect.y1); y < within(high.y() + 1, rect.y0, rect.y1); ++y)
      for (int x = within(low.x(), rect.x0, rect.x1); x < within(high.x() + 1, rect.x0, rect.x1); ++x) {
        const Eigen::Vector2d middle(x + 0.5, y + 0.5);
        const double covered = std::clamp(border + 0.5 - shape.distance(middle), 0.0, 1.0);
        if (covered <= 0) continue;
        const float strength = arrow.strength ? arrow.strength(shape.parameter(middle), x, y) : 1;
        Color& pixel = image.at(x, y);
        pixel = encodeSrgb(mix(decodeSrgb(pixel), color, opacity * strength * static_cast<float>(covered)));
      }
  }
}

}  // namespace

std::vector<Arrow> gradientArrows(const Field& field, const SliceView& view, const ViewBuffers& buffers, int samples,
                                  int spacing) {
  const std::vector<Pixel> pixels = evenlySpacedPixels(buffers, samples, spacing);
  std::vector<Vector3> points;
  for (const Pixel& pixel : pixels) points.push_back(pointAt(view, buffers, pixel.column, pixel.row));
  const std::vector<ValueAndGradient> results = gradientsAt(field, points);
  const Vector3 right = view.right.normalized(), up = view.up.normalized();
  std::vector<Arrow> arrows;
  for (std::size_t n = 0; n < pixels.size(); ++n) {
    const Vector3& gradient = results[n].gradient;
    Eigen::Vector2d half = 0.5 * kArrowShare * spacing * Eigen::Vector2d(gradient.dot(right), -gradient.dot(up));
    if (const double length = 2 * half.norm(); length > spacing) half *= spacing / length;
    const Eigen::Vector2d middle(pixels[n].x + 0.5, pixels[n].y + 0.5);
    arrows.push_back({middle - half, middle + half});
  }
  return arrows;
}

std::vector<Arrow> gradientArrows(const Field& field, const SurfaceView& view, const ViewBuffers& buffers, int samples,
                                  int spacing) {
  const Camera& camera = view.camera;
  const int width = buffers.width / samples, height = buffers.height / samples;
  const std::vector<Pixel> pixels = evenlySpacedPixels(buffers, samples, spacing);
  std::vector<Vector3> points;
  for (const Pixel& pixel : pixels) points.push_back(pointAt(view, buffers, pixel.column, pixel.row));
  const std::vector<ValueAndGradient> results = gradientsAt(field, points);
  std::vector<Arrow> arrows;
  for (std::size_t n = 0; n < pixels.size(); ++n) {
    const PicturePoint from = project(camera, points[n], width, height);
    const double longest = spacing * pixelSize(camera, from.depth, height);
    Vector3 along = kArrowShare * longest * results[n].gradient;
    if (const double length = along.norm(); length > longest) along *= longest / length;
    const Vector3 end = points[n] + along;
    const PicturePoint to = project(camera, end, width, height);
    if (!(to.depth > 0)) continue;
    // The tolerance is the rise of a slanted surface within one or two pixels.
    const auto strength = [&buffers, from, to, samples, tolerance = 2 * longest / spacing](double t, int x, int y) {
      const std::size_t i =
          std::size_t(y * samples + samples / 2) * buffers.width + std::size_t(x * samples + samples / 2);
      const double distance = from.distance + t * (to.distance - from.distance);
      return buffers.covered(i) && distance > double(buffers.distance[i]) + tolerance ? kHidden : 1.0F;
    };
    arrows.push_back({{from.x, from.y}, {to.x, to.y}, strength});
  }
  return arrows;
}

void paintArrows(Image& image, const PixelRect& rect, const std::vector<Arrow>& arrows, double lineWidth) {
  // Paint all casings before the cores, so that no casing covers a neighbour.
  paintShapes(image, rect, arrows, lineWidth, kCasingBorder * lineWidth, decodeSrgb(kCasing), kCasingStrength);
  paintShapes(image, rect, arrows, lineWidth, 0, decodeSrgb(kCore), 1);
}

}  // namespace hpsdf::render
