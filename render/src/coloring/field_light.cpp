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
constexpr int kGroundBlock = 8;        // pixels along each side of a block of ground whose light is interpolated
constexpr double kSmoothLight = 0.12;  // light is interpolated over a block in which it differs by no more
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

  /// Measures the light in kGroundBlock rows of pixels from row `top` on.
  void measure(int top, FieldLight& light) const {
    const std::vector<bool> isLit = lightGround(top, light);
    std::vector<Place> places;
    for (int y = top; y < std::min(top + kGroundBlock, rows()); ++y)
      for (int x = 0; x < columns(); ++x)
        if (!isLit[std::size_t(x / kGroundBlock)] && !takesMean(x, y)) addPlaces(x, y, places);
    measure(places, !light.open.empty());
    for (const Place& place : places) setLight(place.sample, place.side, place.light, light);
  }

  /// Lights the pixels of a row whose light is the mean of that beside them, which has been measured.
  void spread(int y, FieldLight& light) const {
    for (int x = 0; x < columns(); ++x) {
      if (!takesMean(x, y)) continue;
      Light mean{0, 0};
      forEachBeside(x, y, [&](std::size_t sample) {
        mean.open += light.open.empty() ? 0 : 0.25 * double(light.open[sample]);
        mean.lit += 0.25 * double(light.lit[sample]);
      });
      setLight(sampleOf(x, y), samples_, mean, light);
    }
  }

 private:
  struct Light {
    double open = 1, lit = 1;
  };

  struct Place {
    std::size_t sample;
    Vector3 point, normal;
    double fade;   ///< 0 on the surface and on the ground near it; 1 where the shadow on the ground ends
    int side = 1;  ///< the light is that of side × side samples, of which `sample` is the upper left one
    Light light = {};
  };

  int columns() const { return buffers_.width / samples_; }
  int rows() const { return buffers_.height / samples_; }

  void measure(std::vector<Place>& places, bool asksAmbient) const {
    if (asksAmbient) measureAmbient(places);
    followKey(places);
    for (Place& place : places)
      for (double* share : {&place.light.open, &place.light.lit}) *share += place.fade * (1 - *share);
  }

  /// Sets the light of side × side samples, of which `sample` is the upper left one.
  void setLight(std::size_t sample, int side, const Light& measured, FieldLight& light) const {
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        const std::size_t i = sample + std::size_t(y) * buffers_.width + x;
        if (!light.open.empty()) light.open[i] = float(measured.open);
        light.lit[i] = float(measured.lit);
      }
  }

  /// The light on the ground at the corners and in the middle of the blocks of a row.
  struct GroundLight {
    std::vector<std::optional<Light>> above, below;  ///< at the left ends of the blocks' upper and lower sides
    std::vector<std::optional<Light>> middle;

    /// Returns true if the light changes so little over block i that it can be interpolated between its corners.
    bool isSmooth(std::size_t i) const {
      if (!above[i] || !above[i + 1] || !below[i] || !below[i + 1] || !middle[i]) return false;
      const auto spread = [&](double Light::*share) {
        const auto [least, greatest] = std::minmax({(*above[i]).*share, (*above[i + 1]).*share, (*below[i]).*share,
                                                    (*below[i + 1]).*share, (*middle[i]).*share});
        return greatest - least;
      };
      return spread(&Light::open) <= kSmoothLight && spread(&Light::lit) <= kSmoothLight;
    }

    /// Interpolates the light in block i, at shares of its width and height.
    Light at(std::size_t i, double right, double down) const {
      const auto between = [&](double Light::*share) {
        const double upper = std::lerp((*above[i]).*share, (*above[i + 1]).*share, right);
        return std::lerp(upper, std::lerp((*below[i]).*share, (*below[i + 1]).*share, right), down);
      };
      return {between(&Light::open), between(&Light::lit)};
    }
  };

  /// Lights the blocks of pixels in a row of blocks that show nothing but ground on which the light is smooth. Returns
  /// for each block of the row if it is lit.
  std::vector<bool> lightGround(int top, FieldLight& light) const {
    const auto blocks = std::size_t((columns() + kGroundBlock - 1) / kGroundBlock);
    std::vector<bool> isLit(blocks, false);
    if (!ground_ || top + kGroundBlock >= rows()) return isLit;
    const GroundLight ground = groundLightOf(top, blocks);
    for (std::size_t i = 0; i < blocks; ++i) {
      const int left = int(i) * kGroundBlock;
      if (!ground.isSmooth(i) || !isBare(left, top, kGroundBlock)) continue;
      isLit[i] = true;
      for (int y = 0; y < kGroundBlock; ++y)
        for (int x = 0; x < kGroundBlock; ++x)
          setLight(sampleOf(left + x, top + y), samples_,
                   ground.at(i, double(x) / kGroundBlock, double(y) / kGroundBlock), light);
    }
    return isLit;
  }

  /// Measures the light on the ground at the corners and in the middle of a row of blocks. There is none where a pixel
  /// shows something else.
  GroundLight groundLightOf(int top, std::size_t blocks) const {
    std::vector<Place> places;
    std::vector<std::pair<std::optional<Light>*, std::size_t>> measured;  // the place whose light goes there
    const auto ask = [&](int x, int y, std::optional<Light>& answer) {
      if (x >= columns() || !isBare(x, y, 1)) return;
      answer = Light{};  // beyond the reach of the shadow there is no place
      const auto place = placeAt(x * samples_, y * samples_);
      if (!place) return;
      measured.emplace_back(&answer, places.size());
      places.push_back(*place);
    };
    GroundLight ground{.above = {}, .below = {}, .middle = {}};
    for (auto* lights : {&ground.above, &ground.below}) lights->resize(blocks + 1);
    ground.middle.resize(blocks);
    for (std::size_t i = 0; i <= blocks; ++i) {
      const int left = int(i) * kGroundBlock;
      ask(left, top, ground.above[i]);
      ask(left, top + kGroundBlock, ground.below[i]);
      if (i < blocks) ask(left + kGroundBlock / 2, top + kGroundBlock / 2, ground.middle[i]);
    }
    measure(places, true);
    for (const auto& [answer, place] : measured) *answer = places[place].light;
    return ground;
  }

  /// Returns the upper left sample of a pixel.
  std::size_t sampleOf(int x, int y) const { return std::size_t(y * samples_) * buffers_.width + x * samples_; }

  /// Returns true if nothing is in front of the ground in side × side pixels, of which (left, top) is the upper left
  /// one.
  bool isBare(int left, int top, int side) const {
    for (int y = top * samples_; y < (top + side) * samples_; ++y)
      for (int x = left * samples_; x < (left + side) * samples_; ++x)
        if (x >= buffers_.width || buffers_.covered(std::size_t(y) * buffers_.width + x)) return false;
    return true;
  }

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
    for (int y = 0; y < samples_; ++y)
      for (int x = 0; x < samples_; ++x)
        if (!continues(first, first + std::size_t(y) * buffers_.width + x, kEvenDepth)) return false;
    return true;
  }

  /// Returns true if samples i and j show points of one surface with similar normals, of which one is no more than
  /// `depth` samples farther away, or if both show nothing.
  bool continues(std::size_t i, std::size_t j, double depth) const {
    if (buffers_.covered(i) != buffers_.covered(j)) return false;
    if (!buffers_.covered(i)) return true;
    const double farthest = depth * pixelSize(view_.camera, buffers_.distance[i], buffers_.height);
    return buffers_.showsBody(i) == buffers_.showsBody(j) &&
           buffers_.shows(i, Shown::surface) == buffers_.shows(j, Shown::surface) &&
           std::abs(buffers_.distance[i] - buffers_.distance[j]) <= farthest &&
           buffers_.normal[i].dot(buffers_.normal[j]) >= kEvenCosine;
  }

  /// Calls f(sample) for the upper left samples of the four pixels beside a pixel.
  template <typename F>
  void forEachBeside(int x, int y, const F& f) const {
    for (const auto& [beside, line] : {std::pair(x - 1, y), {x + 1, y}, {x, y - 1}, {x, y + 1}})
      f(sampleOf(beside, line));
  }

  /// Returns true if a pixel takes the mean of the light that is measured at the four pixels beside it: every other
  /// pixel, as on a chessboard, where its samples show an even piece of a surface that goes on in those beside it.
  bool takesMean(int x, int y) const {
    if ((x + y) % 2 == 0 || x == 0 || y == 0 || x + 1 == columns() || y + 1 == rows()) return false;
    const std::size_t here = sampleOf(x, y);
    if (!buffers_.covered(here) || !isEven(x * samples_, y * samples_)) return false;
    bool isOnePiece = true;
    forEachBeside(x, y, [&](std::size_t there) {
      isOnePiece = isOnePiece && buffers_.crack[there] == 0 && continues(here, there, kEvenDepth * samples_);
    });
    return isOnePiece;
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
    for (std::size_t i = 0; i < places.size(); ++i)
      places[i].light.open = std::exp(-kAmbientStrength * closed[i] / weights);
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

  /// Returns the length of a step of a ray at which the distance is `value`. The longest step is the one over which the
  /// whole lamp is certain to be seen, because distances change no faster than places.
  double stepOf(const Ray& ray, double value) const {
    const double clear = (value - kLampRadius * ray.length) / (1 + kLampRadius);
    return std::max(clear,
                    std::clamp(kShadowStep * std::abs(value), kLeastShadowStep * size_, kGreatestShadowStep * size_));
  }

  /// Follows the rays from all places to the lamp, a step of all rays at a time.
  void followKey(std::vector<Place>& places) const {
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (places[i].normal.dot(toKey_) <= kBehind)
        places[i].light.lit = 0;
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
        ray.length += stepOf(ray, values[i]);
        const double seen = std::clamp(ray.clear, -1.0, 1.0);
        places[ray.place].light.lit = 0.25 * (1 + seen) * (1 + seen) * (2 - seen);
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
  const int strips = (buffers.height / samples + kGroundBlock - 1) / kGroundBlock;
  tbb::parallel_for(0, strips, [&](int strip) { meter.measure(strip * kGroundBlock, light); });
  tbb::parallel_for(0, buffers.height / samples, [&](int row) { meter.spread(row, light); });
  lightCracks(buffers, samples, light);
  return light;
}

}  // namespace hpsdf::render
