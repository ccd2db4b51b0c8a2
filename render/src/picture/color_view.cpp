#include "picture/color_view.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>

namespace hpsdf::render {
namespace {

constexpr Color kPaper = {250, 250, 248};
constexpr Color kOutline = {18, 16, 38};
constexpr Color kIsoLine = {24, 28, 44};
constexpr Color kZeroLine = {10, 10, 20};
constexpr Color kSurfaceLine = {255, 255, 255};
constexpr Color kSurfaceCasing = {16, 14, 34};
constexpr Color kClay = {210, 153, 119};
constexpr Color kSection = {238, 222, 205};  // of clay that is cut
constexpr Color kAir = {222, 228, 235};      // of a plane outside of the solid
constexpr Color kPlainBox = {222, 216, 204};

constexpr double kOutlineStrength = 0.62;
constexpr double kIsoStrength = 0.42;
constexpr double kZeroWidth = 2.4;  // in thin lines
constexpr double kSurfaceWidth = 1.6;
constexpr double kCasingWidth = 3.4;
// Outlines of cells narrower than this many thin lines would leave little of their colour: they fade.
constexpr double kOutlineFadesBelow = 10;
constexpr double kOutlineGoneBelow = 3;
// In the plane of a slice a distance may be almost flat (along a medial axis, on a tangent plane), and lines would grow
// into blots: its slope counts as at least this.
constexpr double kFlattestSlope = 0.25;

float smoothStep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return static_cast<float>(t * t * (3 - 2 * t));
}

// Calls colorRow(y, row) for each row of samples, in several threads, and averages them down to pixels.
template <typename ColorRow>
Image average(const ViewBuffers& buffers, int samples, const ColorRow& colorRow) {
  Image image(buffers.width / samples, buffers.height / samples, kPaper);
  const float share = 1.0F / float(samples * samples);
  tbb::parallel_for(tbb::blocked_range<int>(0, image.height), [&](const tbb::blocked_range<int>& rows) {
    std::vector<LinearColor> row(buffers.width);
    std::vector<LinearColor> sums(image.width);
    for (int y = rows.begin(); y < rows.end(); ++y) {
      std::fill(sums.begin(), sums.end(), LinearColor::Zero());
      for (int sampleRow = 0; sampleRow < samples; ++sampleRow) {
        colorRow(y * samples + sampleRow, row);
        for (int x = 0; x < image.width * samples; ++x) sums[x / samples] += row[x];
      }
      for (int x = 0; x < image.width; ++x) image.at(x, y) = encodeSrgb(share * sums[x]);
    }
  });
  return image;
}

// Coverage of a sample by a line of this width whose middle is `distance` away; all in samples.
float coverage(double distance, double width) {
  return static_cast<float>(std::clamp(width / 2 + 0.5 - distance, 0.0, 1.0));
}

// Planes, which are flat and have their cells outlined.
bool isFlat(const ViewBuffers& buffers, std::size_t i) {
  return buffers.shows(i, Shown::section) || buffers.shows(i, Shown::plane);
}

// Outlines of cells: on the first samples of a cell from the left and from the top, so that they are as crisp as the
// samples allow and never two wide.
class CellOutlines {
 public:
  /// Of a slice; `inScene`: of the planes among what a camera sees.
  CellOutlines(const ViewBuffers& buffers, const Sampling& sampling, bool inScene)
      : buffers_(buffers), inScene_(inScene), cell_(buffers.cell), width_(sampling.lineWidth * sampling.samples) {
    if (inScene) {
      flatCells_ = buffers.cell;
      for (std::size_t i = 0; i < flatCells_.size(); ++i)
        if (!isFlat(buffers, i)) flatCells_[i] = kNoCell;
      cell_ = flatCells_;
    }
    reach_ = static_cast<int>(std::ceil(width_));
    measureCells();
  }

  /// Coverage of sample (x, y), 0 to 1.
  float operator()(int x, int y) const {
    return std::max(alongAxis(x, y, x, -1), alongAxis(x, y, y, -std::ptrdiff_t(buffers_.width)));
  }

 private:
  struct Extent {
    int x0, x1, y0, y1;
  };

  // How strongly a cell is outlined follows from its size on the screen.
  void measureCells() {
    std::unordered_map<std::uint32_t, Extent> extents;
    for (int y = 0; y < buffers_.height; ++y) {
      const std::uint32_t* row = &cell_[std::size_t(y) * buffers_.width];
      for (int x0 = 0, x1; x0 < buffers_.width; x0 = x1) {
        for (x1 = x0 + 1; x1 < buffers_.width && row[x1] == row[x0];) ++x1;
        if (row[x0] == kNoCell) continue;
        Extent& extent = extents.try_emplace(row[x0], Extent{x0, x1, y, y + 1}).first->second;
        extent = {std::min(extent.x0, x0), std::max(extent.x1, x1), extent.y0, y + 1};
      }
    }
    strengths_.reserve(extents.size() + 1);
    for (const auto& [cell, extent] : extents) {
      const int size = std::max(extent.x1 - extent.x0, extent.y1 - extent.y0);
      strengths_[cell] = smoothStep(kOutlineGoneBelow * width_, kOutlineFadesBelow * width_, size);
    }
    strengths_[kNoCell] = 0;
  }

  // `position` on the axis counts the samples before this one; `step` leads to the one just before it.
  float alongAxis(int x, int y, int position, std::ptrdiff_t step) const {
    const std::size_t i = std::size_t(y) * buffers_.width + x;
    const std::uint32_t* cell = &cell_[i];
    const int reach = std::min(reach_, position);
    // Cells are convex: equal ends mean that nothing lies between.
    if (reach == 0 || cell[reach * step] == *cell) return 0;
    int k = 1;
    while (cell[k * step] == *cell) ++k;
    if (hidden(i, i + k * step)) return 0;
    const float strength = std::max(strengths_.at(*cell), strengths_.at(cell[k * step]));
    return strength * static_cast<float>(std::clamp(width_ - (k - 1), 0.0, 1.0));
  }

  // Where a plane ends behind something else, that is no edge of its own.
  bool hidden(std::size_t i, std::size_t j) const {
    if (!inScene_ || (cell_[i] == kNoCell) == (cell_[j] == kNoCell)) return false;
    const auto [flat, other] = cell_[i] != kNoCell ? std::pair(i, j) : std::pair(j, i);
    return buffers_.covered(other) && buffers_.distance[other] < buffers_.distance[flat];
  }

  const ViewBuffers& buffers_;
  bool inScene_;
  std::vector<std::uint32_t> flatCells_;
  std::span<const std::uint32_t> cell_;
  double width_;  // in samples
  int reach_;
  std::unordered_map<std::uint32_t, float> strengths_;
};

// The values of a slice, or of a plane before a camera, as a landscape: where its contour lines run.
class Contours {
 public:
  /// Zero lines are those of the value less `zero`.
  explicit Contours(const ViewBuffers& buffers, double zero = 0) : buffers_(buffers), zero_(zero) {}

  /// Change of the value a sample, at least that of the flattest slope where samples are this far apart.
  double slope(int x, int y, double sampleSize) const {
    const std::size_t i = index(x, y);
    const double dx = derivative(i, 1, x > 0, x + 1 < buffers_.width);
    const double dy = derivative(i, buffers_.width, y > 0, y + 1 < buffers_.height);
    return std::max(std::hypot(dx, dy), kFlattestSlope * sampleSize);
  }

  /// Distance of sample (x, y) from the zero line, in samples. Where the field jumps over 0 from one cell to the next,
  /// the line runs between the two samples.
  double toZero(int x, int y, double slopeHere) const {
    const std::size_t i = index(x, y);
    double distance = std::abs(buffers_.value[i] - zero_) / slopeHere;
    if (x > 0) distance = std::min(distance, toCrossing(i, i - 1));
    if (x + 1 < buffers_.width) distance = std::min(distance, toCrossing(i, i + 1));
    if (y > 0) distance = std::min(distance, toCrossing(i, i - buffers_.width));
    if (y + 1 < buffers_.height) distance = std::min(distance, toCrossing(i, i + buffers_.width));
    return distance;
  }

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * buffers_.width + x; }

  // Differences within the cell where it has a neighbour there: a jump at a face is no slope.
  double derivative(std::size_t i, std::size_t step, bool hasBefore, bool hasAfter) const {
    const auto& cell = buffers_.cell;
    const auto& value = buffers_.value;
    hasBefore = hasBefore && joined(i, i - step);
    hasAfter = hasAfter && joined(i, i + step);
    const bool before = hasBefore && cell[i - step] == cell[i];
    const bool after = hasAfter && cell[i + step] == cell[i];
    if (before && after) return (double(value[i + step]) - value[i - step]) / 2;
    if (after) return double(value[i + step]) - value[i];
    if (before) return double(value[i]) - value[i - step];
    if (hasBefore && hasAfter) return (double(value[i + step]) - value[i - step]) / 2;
    if (hasAfter) return double(value[i + step]) - value[i];
    return hasBefore ? double(value[i]) - value[i - step] : 0;
  }

  double toCrossing(std::size_t i, std::size_t neighbour) const {
    const double here = buffers_.value[i] - zero_, there = buffers_.value[neighbour] - zero_;
    if (!joined(i, neighbour) || (here < 0) == (there < 0)) return std::numeric_limits<double>::infinity();
    return std::abs(here) / (std::abs(here) + std::abs(there));
  }

  // Whether a neighbour belongs to the same plane.
  bool joined(std::size_t i, std::size_t neighbour) const {
    return buffers_.hit(neighbour) && (buffers_.shown.empty() || buffers_.shown[i] == buffers_.shown[neighbour]);
  }

  const ViewBuffers& buffers_;
  double zero_;
};

// The line along which a plane meets the surface: white between dark borders.
class SurfaceLine {
 public:
  explicit SurfaceLine(const Sampling& sampling) : thin_(sampling.lineWidth * sampling.samples) {}

  /// Over a colour at this distance from the line's middle, in samples.
  LinearColor operator()(const LinearColor& ground, double distance) const {
    const LinearColor cased = mix(ground, casing_, 0.8F * coverage(distance, kCasingWidth * thin_));
    return mix(cased, line_, coverage(distance, kSurfaceWidth * thin_));
  }

 private:
  double thin_;
  LinearColor line_ = decodeSrgb(kSurfaceLine), casing_ = decodeSrgb(kSurfaceCasing);
};

// Where the samples of a view hit the surface, in the camera's frame: x right, y up, z towards the eye, which is the
// origin (of parallel rays the middle of the plane where they start).
class CameraFrame {
 public:
  CameraFrame(const ViewBuffers& buffers, const Camera& camera)
      : buffers_(buffers), parallel_(camera.projection == Projection::orthographic) {
    axes_.row(0) = camera.right.normalized().cast<float>();
    axes_.row(1) = camera.up.normalized().cast<float>();
    axes_.row(2) = -camera.forward.normalized().cast<float>();
    halfWidth_ = static_cast<float>(camera.right.norm());
    halfHeight_ = static_cast<float>(camera.up.norm());
  }

  Eigen::Vector3f ray(int x, int y) const {
    return parallel_ ? Eigen::Vector3f(0, 0, -1) : onPicture(x, y, -1).normalized();
  }

  Eigen::Vector3f position(int x, int y) const {
    const float distance = buffers_.distance[index(x, y)];
    return parallel_ ? onPicture(x, y, -distance) : distance * ray(x, y);
  }

  // Where jumps of the field turn a visible point's normal away from the eye, the nearest that does not: else single
  // dark samples speckle the silhouettes.
  Eigen::Vector3f normal(int x, int y, const Eigen::Vector3f& toEye) const {
    const Eigen::Vector3f n = axes_ * buffers_.normal[index(x, y)];
    const float facing = n.dot(toEye);
    return facing >= 0 ? n : (n - facing * toEye).normalized();
  }

  // Height of the view at this distance before the eye.
  float heightAt(float depth) const { return parallel_ ? 2 * halfHeight_ : 2 * halfHeight_ * depth; }

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * buffers_.width + x; }

  Eigen::Vector3f onPicture(int x, int y, float z) const {
    const float u = 2 * (float(x) + 0.5F) / float(buffers_.width) - 1;
    const float v = 1 - 2 * (float(y) + 0.5F) / float(buffers_.height);
    return {u * halfWidth_, v * halfHeight_, z};
  }

  const ViewBuffers& buffers_;
  bool parallel_;                         // rays
  Eigen::Matrix3f axes_;                  // rows: the camera's axes
  float halfWidth_ = 0, halfHeight_ = 0;  // in perspective at distance 1
};

// How open the surface is to the light all around, from the neighbourhood on the screen: what rises above a point's
// tangent plane nearby takes light from it. Folds and contacts darken, which shows shape better than lamps do.
class Openness {
 public:
  Openness(const ViewBuffers& buffers, const CameraFrame& frame) : buffers_(buffers), frame_(frame) {
    // Rings of taps, each turned against the one within, the same for all pixels: no noise.
    for (int ring = 1; ring <= kRings; ++ring)
      for (int i = 0; i < kTapsInRing; ++i) {
        const double angle = 2 * std::numbers::pi * (i + ring * 0.381966) / kTapsInRing;
        const double radius = kReach * buffers.height * ring * ring / (kRings * kRings);
        taps_.push_back({static_cast<int>(std::lround(radius * std::cos(angle))),
                         static_cast<int>(std::lround(radius * std::sin(angle)))});
      }
  }

  /// 1 in the open, towards 0 in a deep fold.
  float operator()(int x, int y, const Eigen::Vector3f& position, const Eigen::Vector3f& normal) const {
    const float reach = float(kReach) * frame_.heightAt(-position.z());
    float taken = 0;
    for (const auto& [dx, dy] : taps_) {
      const int tapX = x + dx, tapY = y + dy;
      if (tapX < 0 || tapX >= buffers_.width || tapY < 0 || tapY >= buffers_.height) continue;
      if (!buffers_.covered(std::size_t(tapY) * buffers_.width + tapX)) continue;
      const Eigen::Vector3f towards = frame_.position(tapX, tapY) - position;
      const float distance = towards.norm();
      if (distance <= 0) continue;
      // What is far away before the point hides it from the eye but not from the light.
      const float near = std::max(0.0F, 1 - distance / (3 * reach));
      taken += near * std::max(0.0F, towards.dot(normal) / distance - float(kTolerance));
    }
    return std::max(0.0F, 1 - float(kStrength) * taken / float(taps_.size()));
  }

 private:
  static constexpr int kRings = 3, kTapsInRing = 6;
  static constexpr double kReach = 0.035;     // of the view's height
  static constexpr double kTolerance = 0.06;  // sine of the rise that counts as flat
  static constexpr double kStrength = 2.6;

  struct Tap {
    int dx, dy;
  };

  const ViewBuffers& buffers_;
  const CameraFrame& frame_;
  std::vector<Tap> taps_;
};

// Lamps that stay with the camera, in its frame. Like a photographer's: a warm key light from above left, a cool fill
// from the right, a rim from behind, sky above ground.
struct Lights {
  Eigen::Vector3f key = Eigen::Vector3f(-0.55F, 0.62F, 0.56F).normalized();
  Eigen::Vector3f fill = Eigen::Vector3f(0.85F, 0.10F, 0.52F).normalized();
  Eigen::Vector3f rim = Eigen::Vector3f(0.35F, 0.55F, -0.76F).normalized();
  LinearColor keyColor = {0.98F, 0.91F, 0.80F};
  LinearColor fillColor = {0.12F, 0.16F, 0.23F};
  LinearColor rimColor = {0.26F, 0.30F, 0.36F};
  LinearColor sky = {0.26F, 0.29F, 0.34F};
  LinearColor ground = {0.10F, 0.08F, 0.07F};

  LinearColor diffuse(const Eigen::Vector3f& n, float open) const {
    const float wrapped = std::max(0.0F, (n.dot(key) + 0.12F) / 1.12F);
    const LinearColor lamps =
        keyColor * wrapped + fillColor * std::max(0.0F, n.dot(fill)) + rimColor * std::max(0.0F, n.dot(rim));
    // A fold keeps the sky off wholly, a lamp in part.
    return lamps * (0.45F + 0.55F * open) + mix(ground, sky, 0.5F + 0.5F * n.y()) * open;
  }

  // Blinn-Phong of the key light, and the sky mirrored at grazing angles (Schlick's Fresnel term).
  LinearColor gloss(const Eigen::Vector3f& n, const Eigen::Vector3f& toEye) const {
    const Eigen::Vector3f half = (key + toEye).normalized();
    const float highlight = 0.13F * std::pow(std::max(0.0F, n.dot(half)), 36.0F);
    const float facing = 1 - std::clamp(n.dot(toEye), 0.0F, 1.0F);
    const float fresnel = 0.12F * facing * facing * facing * facing;
    return keyColor * highlight + sky * fresnel;
  }
};

class SurfaceShader {
 public:
  SurfaceShader(const ViewBuffers& buffers, const Camera& camera, const SampleColor& color,
                std::span<const LinearColor> bodies)
      : buffers_(buffers), frame_(buffers, camera), openness_(buffers, frame_), color_(color), bodies_(bodies) {}
  SurfaceShader(const SurfaceShader&) = delete;  // openness_ refers to frame_

  LinearColor operator()(int x, int y) const {
    const std::size_t i = std::size_t(y) * buffers_.width + x;
    const Eigen::Vector3f toEye = -frame_.ray(x, y);
    const Eigen::Vector3f n = frame_.normal(x, y, toEye);
    const float open = openness_(x, y, frame_.position(x, y), n);
    if (!color_ || buffers_.showsBody(i)) {
      const LinearColor& material = materialAt(i);
      return material.cwiseProduct(lights_.diffuse(n, open)) + open * lights_.gloss(n, toEye);
    }
    // Softer than clay, and without colour of its own: the legend's colour must stay recognisable.
    const float light = 0.50F + 0.58F * std::max(0.0F, (n.dot(lights_.key) + 0.5F) / 1.5F) - 0.10F * (1 - n.z());
    return color_(i) * light * (0.35F + 0.65F * open) +
           LinearColor::Constant(0.4F * open * lights_.gloss(n, toEye).mean());
  }

 private:
  const LinearColor& materialAt(std::size_t i) const {
    if (buffers_.showsBody(i)) return bodies_[buffers_.body[i]];
    return buffers_.shows(i, Shown::box) ? plainBox_ : clay_;
  }

  const ViewBuffers& buffers_;
  CameraFrame frame_;
  Openness openness_;
  const SampleColor& color_;
  std::span<const LinearColor> bodies_;
  Lights lights_;
  LinearColor clay_ = decodeSrgb(kClay), plainBox_ = decodeSrgb(kPlainBox);
};

}  // namespace

Color paperColor() { return kPaper; }
Color surfaceColor() { return kClay; }

LinearColor backdropColor(double fromTop) {
  return fromOklab({0.975 - 0.06 * fromTop * fromTop, -0.003, -0.006 - 0.004 * fromTop});
}

SampleColor levelColors(const ViewBuffers& buffers, const LevelMap& map, ColorBy color) {
  if (color == ColorBy::normal) return {};
  const std::vector<std::uint8_t>& levels = color == ColorBy::degree ? buffers.degree : buffers.depth;
  return [&map, &levels](std::size_t i) { return map(levels[i]); };
}

SampleColor quantityColors(const std::vector<float>& quantity, const ColorScale& scale) {
  return [&quantity, &scale](std::size_t i) { return scale(quantity[i]); };
}

Image colorCellSlice(const ViewBuffers& buffers, const SampleColor& color, const Sampling& sampling) {
  const CellOutlines outlines(buffers, sampling, false);
  const Contours contours(buffers);
  const LinearColor paper = decodeSrgb(kPaper), outline = decodeSrgb(kOutline);
  const SurfaceLine lines(sampling);
  return average(buffers, sampling.samples, [&](int y, std::vector<LinearColor>& row) {
    for (int x = 0; x < buffers.width; ++x) {
      const std::size_t i = std::size_t(y) * buffers.width + x;
      LinearColor& sample = row[x];
      sample = buffers.hit(i) ? color(i) : paper;
      sample = mix(sample, outline, float(kOutlineStrength) * outlines(x, y));
      if (!buffers.hit(i)) continue;
      sample = lines(sample, contours.toZero(x, y, contours.slope(x, y, sampling.sampleSize)));
    }
  });
}

Image colorDistanceSlice(const ViewBuffers& buffers, const DistanceScale& scale, const Sampling& sampling) {
  constexpr int kSteps = 2048;
  std::vector<LinearColor> table(2 * kSteps + 1);
  for (int i = -kSteps; i <= kSteps; ++i) table[i + kSteps] = divergingColor(double(i) / kSteps);

  const Contours contours(buffers);
  const LinearColor paper = decodeSrgb(kPaper), isoLine = decodeSrgb(kIsoLine), zeroLine = decodeSrgb(kZeroLine);
  const double thin = sampling.lineWidth * sampling.samples;
  return average(buffers, sampling.samples, [&](int y, std::vector<LinearColor>& row) {
    for (int x = 0; x < buffers.width; ++x) {
      const std::size_t i = std::size_t(y) * buffers.width + x;
      LinearColor& sample = row[x];
      sample = paper;
      if (!buffers.hit(i)) continue;
      const double value = buffers.value[i];
      sample = table[static_cast<int>(std::lround(std::clamp(value / scale.range, -1.0, 1.0) * kSteps)) + kSteps];
      const double slope = contours.slope(x, y, sampling.sampleSize);
      const double nearest = std::round(value / scale.step);
      if (nearest != 0) {
        const double distance = std::abs(value - nearest * scale.step) / slope;
        sample = mix(sample, isoLine, float(kIsoStrength) * coverage(distance, thin));
      }
      sample = mix(sample, zeroLine, coverage(contours.toZero(x, y, slope), kZeroWidth * thin));
    }
  });
}

Image colorSurface(const ViewBuffers& buffers, const Camera& camera, const SampleColor& color, const Sampling& sampling,
                   double offset, const std::vector<float>& lines, std::span<const LinearColor> bodies) {
  const SurfaceShader shader(buffers, camera, color, bodies);
  const Contours contours(buffers, offset);
  const SurfaceLine surfaceLine(sampling);
  std::optional<CellOutlines> outlines;
  if (!buffers.shown.empty()) outlines.emplace(buffers, sampling, true);
  const LinearColor outline = decodeSrgb(kOutline), solid = decodeSrgb(kSection), air = decodeSrgb(kAir);
  const auto flatColor = [&](std::size_t i) {
    return color ? color(i) : buffers.shows(i, Shown::section) || buffers.value[i] < offset ? solid : air;
  };
  return average(buffers, sampling.samples, [&](int y, std::vector<LinearColor>& row) {
    const LinearColor ground = backdropColor((y + 0.5) / buffers.height);
    for (int x = 0; x < buffers.width; ++x) {
      const std::size_t i = std::size_t(y) * buffers.width + x;
      LinearColor& sample = row[x];
      sample = !buffers.covered(i) ? ground : isFlat(buffers, i) ? flatColor(i) : shader(x, y);
      if (outlines) sample = mix(sample, outline, float(kOutlineStrength) * (*outlines)(x, y));
      if (buffers.shows(i, Shown::plane)) {
        const double slope = contours.slope(x, y, pixelSize(camera, buffers.distance[i], buffers.height));
        sample = surfaceLine(sample, contours.toZero(x, y, slope));
      }
      if (!lines.empty()) sample = mix(sample, outline, float(kOutlineStrength) * lines[i]);
    }
  });
}

}  // namespace hpsdf::render
