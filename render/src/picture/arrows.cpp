#include "picture/arrows.h"

#include <algorithm>
#include <cmath>

#include "image/color.h"

namespace hpsdf::render {
namespace {

constexpr Color kCore = {22, 20, 34};
constexpr Color kCasing = {252, 251, 246};
constexpr float kCasingStrength = 0.75F;
constexpr double kCoreWidth = 1.3;     // in thin lines
constexpr double kCasingBorder = 1.0;  // on either side, in thin lines
constexpr double kHeadLength = 5.5;    // in thin lines, but no more than kHeadShare of the arrow
constexpr double kHeadShare = 0.6;
constexpr double kHeadHalfWidth = 0.45;  // of its length
constexpr float kHidden = 0.3F;          // strength of what lies behind something

/// A pixel of the finished view and its middle sample.
struct Place {
  int x, y;
  int column, row;
};

std::vector<Place> evenPlaces(const ViewBuffers& buffers, int samples, int spacing) {
  std::vector<Place> places;
  for (int y = spacing / 2; y < buffers.height / samples; y += spacing)
    for (int x = spacing / 2; x < buffers.width / samples; x += spacing) {
      const Place place{x, y, x * samples + samples / 2, y * samples + samples / 2};
      if (buffers.hit(std::size_t(place.row) * buffers.width + place.column)) places.push_back(place);
    }
  return places;
}

std::vector<ValueAndGradient> gradientsAt(const Field& field, const std::vector<Vector3>& points) {
  std::vector<ValueAndGradient> results(points.size());
  field.valuesAndGradients(points, results);
  return results;
}

/// The part of an arrow that is filled: a shaft and a head.
class Shape {
 public:
  Shape(const Arrow& arrow, double thin) : from_(arrow.from), length_((arrow.to - arrow.from).norm()) {
    along_ = length_ > 0 ? Eigen::Vector2d((arrow.to - arrow.from) / length_) : Eigen::Vector2d(1, 0);
    head_ = std::min(kHeadLength * thin, kHeadShare * length_);
    half_ = 0.5 * kCoreWidth * thin;
  }

  double along(const Eigen::Vector2d& x) const {
    return length_ > 0 ? std::clamp((x - from_).dot(along_) / length_, 0.0, 1.0) : 0.0;
  }

  /// From x to the shape's edge, below 0 inside.
  double distance(const Eigen::Vector2d& x) const {
    const double t = (x - from_).dot(along_);
    const double across = std::abs(along_.x() * (x - from_).y() - along_.y() * (x - from_).x());
    // a shaft with round ends, up to the middle of the head
    const double shaftEnd = length_ - 0.5 * head_;
    const double toShaft = std::hypot(t - std::clamp(t, 0.0, shaftEnd), across) - half_;
    // the head: an isosceles triangle, here its upper half
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

/// Mixes a colour in where shapes, grown by `border`, cover pixels.
void paintShapes(Image& image, const PixelRect& rect, const std::vector<Arrow>& arrows, double thin, double border,
                 const LinearColor& color, float opacity) {
  for (const Arrow& arrow : arrows) {
    const Shape shape(arrow, thin);
    const double reach = border + kHeadHalfWidth * kHeadLength * thin + 2;
    const Eigen::Vector2d low = arrow.from.cwiseMin(arrow.to).array() - reach;
    const Eigen::Vector2d high = arrow.from.cwiseMax(arrow.to).array() + reach;
    const auto within = [](double x, int first, int last) {
      return int(std::clamp(std::floor(x), double(first), double(last)));
    };
    for (int y = within(low.y(), rect.y0, rect.y1); y < within(high.y() + 1, rect.y0, rect.y1); ++y)
      for (int x = within(low.x(), rect.x0, rect.x1); x < within(high.x() + 1, rect.x0, rect.x1); ++x) {
        const Eigen::Vector2d middle(x + 0.5, y + 0.5);
        const double covered = std::clamp(border + 0.5 - shape.distance(middle), 0.0, 1.0);
        if (covered <= 0) continue;
        const float strength = arrow.strength ? arrow.strength(shape.along(middle), x, y) : 1;
        Color& pixel = image.at(x, y);
        pixel = encodeSrgb(mix(decodeSrgb(pixel), color, opacity * strength * static_cast<float>(covered)));
      }
  }
}

}  // namespace

std::vector<Arrow> gradientArrows(const Field& field, const SliceView& view, const ViewBuffers& buffers, int samples,
                                  int spacing) {
  const std::vector<Place> places = evenPlaces(buffers, samples, spacing);
  std::vector<Vector3> points;
  for (const Place& place : places) points.push_back(pointAt(view, buffers, place.column, place.row));
  const std::vector<ValueAndGradient> results = gradientsAt(field, points);
  const Vector3 right = view.right.normalized(), up = view.up.normalized();
  std::vector<Arrow> arrows;
  for (std::size_t n = 0; n < places.size(); ++n) {
    const Vector3& gradient = results[n].gradient;
    Eigen::Vector2d half = 0.5 * kArrowShare * spacing * Eigen::Vector2d(gradient.dot(right), -gradient.dot(up));
    if (const double length = 2 * half.norm(); length > spacing) half *= spacing / length;
    const Eigen::Vector2d middle(places[n].x + 0.5, places[n].y + 0.5);
    arrows.push_back({middle - half, middle + half});
  }
  return arrows;
}

std::vector<Arrow> gradientArrows(const Field& field, const SurfaceView& view, const ViewBuffers& buffers, int samples,
                                  int spacing) {
  const Camera& camera = view.camera;
  const int width = buffers.width / samples, height = buffers.height / samples;
  const std::vector<Place> places = evenPlaces(buffers, samples, spacing);
  std::vector<Vector3> points;
  for (const Place& place : places) points.push_back(pointAt(view, buffers, place.column, place.row));
  const std::vector<ValueAndGradient> results = gradientsAt(field, points);
  std::vector<Arrow> arrows;
  for (std::size_t n = 0; n < places.size(); ++n) {
    const PicturePoint from = project(camera, points[n], width, height);
    const double longest = spacing * pixelSize(camera, from.depth, height);
    Vector3 along = kArrowShare * longest * results[n].gradient;
    if (const double length = along.norm(); length > longest) along *= longest / length;
    const Vector3 end = points[n] + along;
    const PicturePoint to = project(camera, end, width, height);
    if (!(to.depth > 0)) continue;
    // Behind what is nearer by more than the surface may rise within a pixel or two.
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
  // All casings first, so that none covers a neighbour.
  paintShapes(image, rect, arrows, lineWidth, kCasingBorder * lineWidth, decodeSrgb(kCasing), kCasingStrength);
  paintShapes(image, rect, arrows, lineWidth, 0, decodeSrgb(kCore), 1);
}

}  // namespace hpsdf::render
