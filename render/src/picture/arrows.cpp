#include "picture/arrows.h"

#include <algorithm>
#include <cmath>

#include "image/color.h"
#include "image/strokes.h"
#include "view/view_buffers.h"

namespace hpsdf::render {
namespace {

constexpr Color kCore = {22, 20, 34};
constexpr Color kCasing = {252, 251, 246};
constexpr float kCasingStrength = 0.75F;
// Vector pictures are mixed in sRGB values instead of linear light: there, this opacity has the effect of
// `kCasingStrength` on most colours.
constexpr double kCasingOpacity = 0.8;
// The following lengths of an arrow's parts are in multiples of the width of a thin line.
constexpr double kCoreWidth = 1.3;
constexpr double kCasingBorder = 1.0;  // width of the light casing on either side of the dark core
constexpr double kHeadLength = 5.5;
constexpr double kHeadShare = 0.6;       // greatest length of the head, as a share of the arrow's length
constexpr double kHeadHalfWidth = 0.45;  // half the width of the head, as a share of its length
constexpr int kCapCorners = 3;           // corners of a quarter of the shaft's round end in a vector picture
constexpr float kHidden = 0.3F;          // opacity of an arrow's hidden parts

struct FieldPixel {
  int x, y;
  Vector3 point;     ///< the point that the pixel's middle sample shows
  Vector3 gradient;  ///< the field's gradient at `point`
};

template <typename View>
std::vector<FieldPixel> evenlySpacedPixels(const Field& field, const View& view, const ViewBuffers& buffers,
                                           int samples, int spacing) {
  std::vector<FieldPixel> pixels;
  std::vector<Vector3> points;
  for (int y = spacing / 2; y < buffers.height / samples; y += spacing)
    for (int x = spacing / 2; x < buffers.width / samples; x += spacing) {
      if (!buffers.hit(middleSample(buffers, samples, x, y))) continue;
      points.push_back(pointAt(view, buffers, x * samples + samples / 2, y * samples + samples / 2));
      pixels.push_back({x, y, points.back(), Vector3::Zero()});
    }
  std::vector<ValueAndGradient> results(points.size());
  field.valuesAndGradients(points, results);
  for (std::size_t n = 0; n < pixels.size(); ++n) pixels[n].gradient = results[n].gradient;
  return pixels;
}

/// The area of an arrow: a shaft with a head.
class Shape {
 public:
  Shape(const Arrow& arrow, double thin) : from_(arrow.from), length_((arrow.to - arrow.from).norm()) {
    along_ = length_ > 0 ? Eigen::Vector2d((arrow.to - arrow.from) / length_) : Eigen::Vector2d(1, 0);
    head_ = std::min(kHeadLength * thin, kHeadShare * length_);
    half_ = 0.5 * kCoreWidth * thin;
  }

  /// The arrow's outline, moved outwards by `border`, as a closed line.
  Polyline outline(double border) const {
    const double half = half_ + border;
    const double tip = length_ + border * std::hypot(1.0, kHeadHalfWidth) / kHeadHalfWidth;
    const double base = length_ - head_ - border;
    const double halfBase = std::max(half, kHeadHalfWidth * (tip - base));
    std::vector<Eigen::Vector2d> right;  // corners of the right half: distances along the arrow and across it
    for (int n = 1; n <= kCapCorners; ++n) {
      const double angle = M_PI / 2 * n / kCapCorners;
      right.emplace_back(-half * std::cos(angle), half * std::sin(angle));
    }
    right.emplace_back(base, half);
    right.emplace_back(base, halfBase);
    Polyline line;
    const auto add = [&](double along, double across) {
      line.push_back(from_ + along * along_ + across * Eigen::Vector2d(-along_.y(), along_.x()));
    };
    add(-half, 0);
    for (const Eigen::Vector2d& corner : right) add(corner.x(), corner.y());
    add(tip, 0);
    for (auto corner = right.rbegin(); corner != right.rend(); ++corner) add(corner->x(), -corner->y());
    line.push_back(line.front());
    return line;
  }

  /// Signed distance of x from the arrow's outline, negative inside.
  double distance(const Eigen::Vector2d& x) const {
    const double t = (x - from_).dot(along_);
    const double across = std::abs(along_.x() * (x - from_).y() - along_.y() * (x - from_).x());
    // The shaft is a capsule that ends in the middle of the head.
    const double shaftEnd = length_ - 0.5 * head_;
    const double toShaft = std::hypot(t - std::clamp(t, 0.0, shaftEnd), across) - half_;
    // The head is an isosceles triangle; by symmetry, the distance to one half of it suffices.
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

/// Blends a colour over the pixels that arrows cover. The arrows' outlines are first moved outwards by
/// `border`.
void paintShapes(Image& image, const PixelRect& rect, const std::vector<Arrow>& arrows, double thin, double border,
                 const LinearColor& color, float opacity) {
  const double reach = border + kHeadHalfWidth * kHeadLength * thin + 2;
  for (const Arrow& arrow : arrows) {
    const Shape shape(arrow, thin);
    forEachPixelNear(arrow.from, arrow.to, reach, rect, [&](const NearPixel& near) {
      const double covered = std::clamp(border + 0.5 - shape.distance(near.middle), 0.0, 1.0);
      if (covered <= 0) return;
      const float strength = arrow.strength ? arrow.strength(near.t, near.x, near.y) : 1;
      mixInto(image.at(near.x, near.y), color, opacity * strength * static_cast<float>(covered));
    });
  }
}

}  // namespace

std::vector<Arrow> gradientArrows(const Field& field, const SliceView& view, const ViewBuffers& buffers, int samples,
                                  int spacing) {
  const Vector3 right = view.right.normalized(), up = view.up.normalized();
  std::vector<Arrow> arrows;
  for (const auto& [x, y, point, gradient] : evenlySpacedPixels(field, view, buffers, samples, spacing)) {
    Eigen::Vector2d half = 0.5 * kArrowShare * spacing * Eigen::Vector2d(gradient.dot(right), -gradient.dot(up));
    if (const double length = 2 * half.norm(); length > spacing) half *= spacing / length;
    const Eigen::Vector2d middle(x + 0.5, y + 0.5);
    arrows.push_back({middle - half, middle + half});
  }
  return arrows;
}

std::vector<Arrow> gradientArrows(const Field& field, const SurfaceView& view, const ViewBuffers& buffers, int samples,
                                  int spacing) {
  const Camera& camera = view.camera;
  const int width = buffers.width / samples, height = buffers.height / samples;
  std::vector<Arrow> arrows;
  for (const FieldPixel& pixel : evenlySpacedPixels(field, view, buffers, samples, spacing)) {
    const PicturePoint from = project(camera, pixel.point, width, height);
    const double longest = spacing * pixelSize(camera, from.depth, height);
    Vector3 along = kArrowShare * longest * pixel.gradient;
    if (const double length = along.norm(); length > longest) along *= longest / length;
    const PicturePoint to = project(camera, pixel.point + along, width, height);
    if (!(to.depth > 0)) continue;
    // A surface hides the arrow only if it is nearer by more than a tolerance of two pixel sizes, because the depth of
    // a slanted surface varies within a pixel.
    const auto strength = [&buffers, from, to, samples, tolerance = 2 * longest / spacing](double t, int x, int y) {
      const double distance = from.distance + t * (to.distance - from.distance);
      return hides(buffers, samples, x, y, distance, tolerance) ? kHidden : 1.0F;
    };
    arrows.push_back({{from.x, from.y}, {to.x, to.y}, strength});
  }
  return arrows;
}

void paintArrows(Image& image, const PixelRect& rect, const std::vector<Arrow>& arrows, double lineWidth) {
  // Paint the light casings of all arrows before their dark cores, so that no casing covers the core of a
  // neighbour.
  paintShapes(image, rect, arrows, lineWidth, kCasingBorder * lineWidth, decodeSrgb(kCasing), kCasingStrength);
  paintShapes(image, rect, arrows, lineWidth, 0, decodeSrgb(kCore), 1);
}

std::vector<VectorShape> arrowShapes(const std::vector<Arrow>& arrows, double lineWidth) {
  std::vector<VectorShape> shapes;
  FilledShape cores{{}, kCore};
  for (const Arrow& arrow : arrows) {
    const Shape shape(arrow, lineWidth);
    cores.borders.push_back(shape.outline(0));
    // Casings may overlap, and the areas of one shape must not.
    shapes.emplace_back(FilledShape{{shape.outline(kCasingBorder * lineWidth)}, kCasing, kCasingOpacity});
  }
  if (!arrows.empty()) shapes.emplace_back(std::move(cores));
  return shapes;
}

}  // namespace hpsdf::render
