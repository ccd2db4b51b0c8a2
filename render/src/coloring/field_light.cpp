#include "coloring/field_light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "hpsdf/types.h"
#include "image/color.h"
#include "scene/cell_boxes.h"

namespace hpsdf::render {
namespace {

// Lengths are shares of the solid's size, the diagonal of its box.
constexpr std::array kTaps = {0.009, 0.018, 0.035, 0.065, 0.11};  // distances along the normal for the ambient light
constexpr double kAmbientStrength = 1.8;  // the ambient light decays with what is closed, so that gaps are not black
constexpr double kLift = 0.014;           // height at which the rays to the lamp start, above the steps between cells
constexpr double kBehind = -0.3;          // cosine from which on a surface is turned away from the lamp
constexpr double kLeastShadowStep = 0.005, kGreatestShadowStep = 0.1;
constexpr double kShadowStep =
    0.6;  // share of the distance by which a ray advances, so as not to miss the nearest place
constexpr int kMostShadowSteps = 80;
constexpr double kAround = 0.1;        // rays to the lamp are followed within this distance of the solid's box
constexpr double kLampRadius = 0.13;   // tangent of the angle under which half of the lamp is seen
constexpr double kGroundReach = 1.25;  // the ground is darkened up to this distance from the solid's middle
constexpr double kFadesFrom = 0.8;     // share of the view's width from which on the shadow on the ground fades
constexpr int kRowsTogether = 4;       // rows of pixels whose points are evaluated together
constexpr float kEvenCosine = 0.9F;    // least cosine between normals of an even piece of a surface
constexpr int kCrackReach = 4;         // pixels from a crack within which the light of the surface beside it is sought
constexpr double kEvenDepth = 4;       // greatest difference of the distances of an even piece, in samples

/// The distance to the solid that casts shadows, at many points at once.
class Distances {
 public:
  explicit Distances(const ShadowCaster& caster) : field_(caster.field), offset_(caster.view.offset) {
    const auto& clip = caster.view.clip;
    if (!clip) return;
    const Camera& camera = caster.view.camera;
    const Vector3 toEye = camera.projection == Projection::orthographic
                              ? Vector3(-camera.forward)
                              : Vector3(camera.eye - clip->offset * Vector3::Unit(clip->axis));
    clip_ = Clip{clip->axis, clip->offset, toEye[clip->axis] >= 0 ? 1.0 : -1.0};
  }

  /// The value for points outside of the domain, where the field does not know the distance.
  enum class Outside : std::uint8_t {
    asTheField,  ///< an upper bound, which hides no light
    lowerBound,  ///< a safe step for a ray
  };

  /// Replaces `values` by the distances at `points`.
  void measure(std::span<const Vector3> points, Outside outside, std::vector<double>& values) const {
    values.resize(points.size());
    field_.values(points, values);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (outside == Outside::lowerBound) values[i] = lowerBound(points[i], values[i]);
      values[i] -= offset_;
      if (clip_) values[i] = std::max(values[i], clip_->side * (points[i][clip_->axis] - clip_->offset));
    }
  }

 private:
  struct Clip {
    int axis;
    double offset, side;
  };

  /// Outside of the domain the value is f(q) + |x − q|, which may exceed the distance. No point s of the domain is
  /// nearer to x than √(|x − q|² + |q − s|²), because the domain is convex.
  double lowerBound(const Vector3& x, double value) const {
    const double beyond = std::sqrt(field_.domain().squaredExteriorDistance(x));
    const double atBoundary = value - beyond;
    return beyond > 0 && atBoundary > 0 ? std::sqrt(beyond * beyond + atBoundary * atBoundary) : value;
  }

  const Field& field_;
  double offset_;
  std::optional<Clip> clip_;
};

/// The plane on which the solid stands.
struct Ground {
  int axis;
  double height;
  Vector3 middle;  ///< the point of the plane below the middle of the solid
};

/// The box around the surface that casts shadows.
Box solidBox(const Field& field, double offset) {
  const Box& known = field.metadata().source.box;
  Box box = known.isEmpty() || !known.sizes().allFinite() ? field.domain() : known;
  box.min() -= Vector3::Constant(offset);
  box.max() += Vector3::Constant(offset);
  box = box.intersection(field.domain());
  return box.isEmpty() ? field.domain() : box;
}

class LightMeter {
 public:
  LightMeter(const ShadowCaster& caster, const ViewBuffers& buffers, int samples, const Vector3& toKey)
      : view_(caster.view), buffers_(buffers), samples_(samples), toKey_(toKey), distances_(caster) {
    const Box whole = solidBox(caster.field, caster.view.offset), rest = clipped(whole, caster.view);
    const Box& box = rest.isEmpty() ? whole : rest;
    size_ = box.diagonal().norm();
    around_ = Box(box.min().array() - kAround * size_, box.max().array() + kAround * size_);
    if (!caster.onGround) return;
    const int axis = caster.up == UpAxis::y ? 1 : 2;
    Vector3 middle = box.center();
    middle[axis] = box.min()[axis];
    if (view_.camera.eye[axis] > middle[axis]) ground_ = Ground{axis, middle[axis], middle};
  }

  /// Measures the light in the rows of pixels from `first` to before `last`.
  void measure(int first, int last, FieldLight& light) const {
    std::vector<Place> places;
    for (int y = first; y < last; ++y)
      for (int x = 0; x < buffers_.width / samples_; ++x) addPlaces(x, y, places);
    if (!light.open.empty()) measureAmbient(places);
    followKey(places);
    for (const Place& place : places) {
      const double open = place.open + place.fade * (1 - place.open), lit = place.lit + place.fade * (1 - place.lit);
      for (int y = 0; y < place.side; ++y)
        for (int x = 0; x < place.side; ++x) {
          const std::size_t i = place.sample + std::size_t(y) * buffers_.width + x;
          if (!light.open.empty()) light.open[i] = float(open);
          light.lit[i] = float(lit);
        }
    }
  }

 private:
  struct Place {
    std::size_t sample;
    Vector3 point, normal;
    double fade;   ///< 0 on the surface and on the ground near it; 1 where the shadow on the ground ends
    int side = 1;  ///< the light is that of side × side samples, of which `sample` is the upper left one
    double open = 1, lit = 1;
  };

  /// Adds the places at which the samples of pixel (x, y) are measured: one for all of them where they show an even
  /// piece of a surface or the ground alone, since light changes little within a pixel.
  void addPlaces(int x, int y, std::vector<Place>& places) const {
    const int side = isEven(x * samples_, y * samples_) ? samples_ : 1;
    for (int row = y * samples_; row < (y + 1) * samples_; row += side)
      for (int column = x * samples_; column < (x + 1) * samples_; column += side)
        if (auto place = placeAt(column, row)) {
          place->side = side;
          places.push_back(*place);
        }
  }

  /// Returns true if the samples of the pixel whose upper left sample is (left, top) show neighbouring points of one
  /// surface with similar normals, or nothing.
  bool isEven(int left, int top) const {
    const std::size_t first = std::size_t(top) * buffers_.width + left;
    const bool covered = buffers_.covered(first);
    const float farthest =
        covered ? float(kEvenDepth * pixelSize(view_.camera, buffers_.distance[first], buffers_.height)) : 0;
    for (int y = 0; y < samples_; ++y)
      for (int x = 0; x < samples_; ++x) {
        const std::size_t i = first + std::size_t(y) * buffers_.width + x;
        if (buffers_.covered(i) != covered) return false;
        if (!covered) continue;
        if (buffers_.showsBody(i) != buffers_.showsBody(first)) return false;
        if (std::abs(buffers_.distance[i] - buffers_.distance[first]) > farthest) return false;
        if (buffers_.normal[i].dot(buffers_.normal[first]) < kEvenCosine) return false;
      }
    return true;
  }

  std::optional<Place> placeAt(int x, int y) const {
    const std::size_t i = std::size_t(y) * buffers_.width + x;
    if (buffers_.shows(i, Shown::surface) || buffers_.showsBody(i))
      return Place{i, pointAt(view_, buffers_, x, y), buffers_.normal[i].cast<double>(), 0};
    if (buffers_.covered(i) || !ground_) return std::nullopt;
    const Vector3 eye = pixelEye(view_.camera, x, y, buffers_.width, buffers_.height);
    const Vector3 ray = pixelRay(view_.camera, x, y, buffers_.width, buffers_.height);
    const double t = (ground_->height - eye[ground_->axis]) / ray[ground_->axis];
    if (!(t > 0)) return std::nullopt;
    const Vector3 point = eye + t * ray;
    const double away = (point - ground_->middle).norm() / (kGroundReach * size_);
    if (!(away < 1)) return std::nullopt;
    // Beside the view lies the legend, where no shadow falls.
    const double atRightEdge = smoothStep(kFadesFrom, 1, (x + 0.5) / buffers_.width);
    return Place{i, point, Vector3::Unit(ground_->axis), std::max(std::clamp(2 * away - 1, 0.0, 1.0), atRightEdge)};
  }

  void measureAmbient(std::vector<Place>& places) const {
    std::vector<Vector3> points(places.size());
    std::vector<double> values, closed(places.size(), 0);
    double weight = 1, weights = 0;
    for (const double tap : kTaps) {
      const double height = tap * size_;
      for (std::size_t i = 0; i < places.size(); ++i) points[i] = places[i].point + height * places[i].normal;
      distances_.measure(points, Distances::Outside::asTheField, values);
      for (std::size_t i = 0; i < places.size(); ++i)
        closed[i] += weight * std::clamp(1 - values[i] / height, 0.0, 1.0);
      weights += weight;
      weight *= 0.85;
    }
    for (std::size_t i = 0; i < places.size(); ++i) places[i].open = std::exp(-kAmbientStrength * closed[i] / weights);
  }

  /// The part of a ray towards the lamp on which the solid can hide the lamp.
  struct Ray {
    std::size_t place;
    Vector3 start;
    double length, last;  ///< where the ray is, and where this part ends
    double clear = 1;     ///< lowest ratio of the distance to the half width of the lamp's cone, at most 1
  };

  /// Returns the ray of `places[i]` towards the lamp, or std::nullopt if it passes by the solid.
  std::optional<Ray> rayFrom(const std::vector<Place>& places, std::size_t i) const {
    const Place& place = places[i];
    Ray ray{i, place.point + kLift * size_ * place.normal, kLeastShadowStep * size_,
            std::numeric_limits<double>::infinity()};
    for (int axis = 0; axis < 3; ++axis) {
      const double slope = toKey_[axis], low = around_.min()[axis], high = around_.max()[axis];
      if (slope == 0 && !(ray.start[axis] > low && ray.start[axis] < high)) return std::nullopt;
      if (slope == 0) continue;
      const double toLow = (low - ray.start[axis]) / slope, toHigh = (high - ray.start[axis]) / slope;
      ray.length = std::max(ray.length, std::min(toLow, toHigh));
      ray.last = std::min(ray.last, std::max(toLow, toHigh));
    }
    return ray.length < ray.last ? std::optional(ray) : std::nullopt;
  }

  /// Follows the rays from all places to the lamp, a step of all rays at a time.
  void followKey(std::vector<Place>& places) const {
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (places[i].normal.dot(toKey_) <= kBehind)
        places[i].lit = 0;
      else if (const auto ray = rayFrom(places, i))
        rays.push_back(*ray);
    }
    std::vector<Vector3> points;
    std::vector<double> values;
    for (int step = 0; step < kMostShadowSteps && !rays.empty(); ++step) {
      points.clear();
      for (const Ray& ray : rays) points.push_back(ray.start + ray.length * toKey_);
      distances_.measure(points, Distances::Outside::lowerBound, values);
      std::size_t kept = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        Ray ray = rays[i];
        ray.clear = std::min(ray.clear, values[i] / (kLampRadius * ray.length));
        ray.length +=
            std::clamp(kShadowStep * std::abs(values[i]), kLeastShadowStep * size_, kGreatestShadowStep * size_);
        const double seen = std::clamp(ray.clear, -1.0, 1.0);
        places[ray.place].lit = 0.25 * (1 + seen) * (1 + seen) * (2 - seen);
        if (ray.clear > -1 && ray.length < ray.last) rays[kept++] = ray;
      }
      rays.resize(kept);
    }
  }

  const SurfaceView& view_;
  const ViewBuffers& buffers_;
  int samples_;
  Vector3 toKey_;
  Distances distances_;
  double size_ = 0;
  Box around_;
  std::optional<Ground> ground_;
};

/// Returns the sample nearest to (x, y), within `reach` along each axis, that shows the surface and no crack; the first
/// of those at one distance.
std::optional<std::size_t> nearestWhole(const ViewBuffers& buffers, int x, int y, int reach) {
  std::optional<std::size_t> nearest;
  int least = std::numeric_limits<int>::max();
  const auto look = [&](int dx, int dy) {
    const int i = x + dx, j = y + dy, squared = dx * dx + dy * dy;
    if (i < 0 || i >= buffers.width || j < 0 || j >= buffers.height || squared > least) return;
    const std::size_t at = std::size_t(j) * buffers.width + i;
    if ((squared == least && at > *nearest) || buffers.crack[at] != 0 || !buffers.shows(at, Shown::surface)) return;
    least = squared;
    nearest = at;
  };
  // Search squares around the sample, from the smallest on.
  for (int ring = 1; ring <= reach && ring * ring <= least; ++ring)
    for (int n = -ring; n <= ring; ++n) {
      look(n, -ring);
      look(n, ring);
      look(-ring, n);
      look(ring, n);
    }
  return nearest;
}

/// Gives samples of cracks the light of the surface beside them. A ray meets a crack at a face between two cells, below
/// the surface, where the gradient points anywhere and all is dark.
void lightCracks(const ViewBuffers& buffers, int samples, FieldLight& light) {
  tbb::parallel_for(0, buffers.height, [&](int y) {
    for (int x = 0; x < buffers.width; ++x) {
      const std::size_t i = std::size_t(y) * buffers.width + x;
      if (buffers.crack[i] == 0 || !buffers.shows(i, Shown::surface)) continue;
      const auto whole = nearestWhole(buffers, x, y, kCrackReach * samples);
      if (!whole) continue;
      if (!light.open.empty()) light.open[i] = light.open[*whole];
      light.lit[i] = light.lit[*whole];
    }
  });
}

}  // namespace

FieldLight fieldLight(const ShadowCaster& caster, const ViewBuffers& buffers, int samples, const Vector3& toKey) {
  FieldLight light{{}, std::vector<float>(buffers.cell.size(), 1)};
  if (!caster.amongBodies) light.open.assign(buffers.cell.size(), 1);
  const LightMeter meter(caster, buffers, samples, toKey);
  const int rows = buffers.height / samples;
  const int strips = (rows + kRowsTogether - 1) / kRowsTogether;
  tbb::parallel_for(0, strips, [&](int strip) {
    meter.measure(strip * kRowsTogether, std::min(rows, (strip + 1) * kRowsTogether), light);
  });
  lightCracks(buffers, samples, light);
  return light;
}

}  // namespace hpsdf::render
