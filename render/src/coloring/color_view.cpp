#include "coloring/color_view.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>

#include "coloring/line_style.h"
#include "coloring/surface_shader.h"
#include "image/color.h"

namespace hpsdf::render {
namespace {

constexpr Color kPaper = {250, 250, 248};
constexpr Color kSection = {238, 222, 205};  // cut through a solid without a colour scale
constexpr Color kAir = {222, 228, 235};      // part of a plane that lies outside of the solid

// The least cosine between normals of samples that are coloured alike: of 1.8 degrees.
constexpr float kSameNormal = 0.9995F;

// The greatest shares of the light that shadow and occlusion take from the ground.
constexpr float kGroundShadow = 0.34F, kGroundOcclusion = 0.42F;

// Lines are drawn as if the distance had at least this slope. With the true slope, lines would widen to blots where the
// distance is almost constant in the plane of a slice (near a medial axis or on a tangent plane).
constexpr double kFlattestSlope = 0.25;

// Returns a picture in which each pixel is the mean of its samples' colours, where colorOf(x, y, i) is the
// colour of sample i at (x, y). If isUniform(x, y) is true for the upper left sample of a pixel, its colour is that of
// the pixel. Uses several threads.
template <typename ColorOf, typename IsUniform>
Image average(const ViewBuffers& buffers, int samples, const ColorOf& colorOf, const IsUniform& isUniform) {
  Image image(buffers.width / samples, buffers.height / samples, kPaper);
  const float share = 1.0F / float(samples * samples);
  const auto sampleColor = [&](int x, int y) { return colorOf(x, y, std::size_t(y) * buffers.width + x); };
  const auto mean = [&](int left, int top) {
    LinearColor sum = LinearColor::Zero();
    for (int y = top; y < top + samples; ++y)
      for (int x = left; x < left + samples; ++x) sum += sampleColor(x, y);
    return LinearColor(share * sum);
  };
  tbb::parallel_for(0, image.height, [&](int row) {
    for (int column = 0; column < image.width; ++column) {
      const int x = column * samples, y = row * samples;
      image.at(column, row) = encodeSrgb(isUniform(x, y) ? sampleColor(x, y) : mean(x, y));
    }
  });
  return image;
}

template <typename ColorOf>
Image average(const ViewBuffers& buffers, int samples, const ColorOf& colorOf) {
  return average(buffers, samples, colorOf, [](int, int) { return false; });
}

// Tells which pixels have samples that measured light shows in one colour: those that show nothing, or the surface
// turned the same way.
class UniformPixels {
 public:
  UniformPixels(const ViewBuffers& buffers, int samples, const FieldLight& light)
      : buffers_(buffers), samples_(samples), light_(light) {}

  bool operator()(int left, int top) const {
    const std::size_t first = std::size_t(top) * buffers_.width + left;
    for (int y = 0; y < samples_; ++y)
      for (int x = 0; x < samples_; ++x)
        if (!isSame(first, first + std::size_t(y) * buffers_.width + x)) return false;
    return true;
  }

 private:
  bool isSame(std::size_t i, std::size_t j) const {
    if (buffers_.hit(i) != buffers_.hit(j) || buffers_.showsBody(i) || buffers_.showsBody(j)) return false;
    if (!light_.lit.empty() && light_.lit[i] != light_.lit[j]) return false;
    if (!light_.open.empty() && light_.open[i] != light_.open[j]) return false;
    return !buffers_.hit(i) || buffers_.normal[i].dot(buffers_.normal[j]) >= kSameNormal;
  }

  const ViewBuffers& buffers_;
  int samples_;
  const FieldLight& light_;
};

// Returns the share of a sample, 0 to 1, that a line of the given width covers. The sample is at `distance` from the
// centre of the line. Both lengths are in samples.
float coverage(double distance, double width) {
  return static_cast<float>(std::clamp(width / 2 + 0.5 - distance, 0.0, 1.0));
}

// Returns true if sample i shows a section or a plane, which are drawn flat: unlit, with the outlines of their cells.
bool isFlat(const ViewBuffers& buffers, std::size_t i) {
  return buffers.shows(i, Shown::section) || buffers.shows(i, Shown::plane);
}

// The outlines of cells. An outline covers the leftmost and the topmost samples of a cell. Outlines are
// therefore as crisp as the samples allow, and two neighbouring cells never both draw their common edge.
class CellOutlines {
 public:
  /// Prepares the outlines of the cells in the buffers. If `inScene` is true, only sections and planes of a
  /// scene have outlines. Otherwise the buffers are those of a slice.
  CellOutlines(const ViewBuffers& buffers, const Sampling& sampling, bool inScene)
      : buffers_(buffers), inScene_(inScene), cell_(buffers.cell), width_(sampling.lineWidth * sampling.samples) {
    if (inScene) {
      flatCells_ = buffers.cell;
      for (std::size_t i = 0; i < flatCells_.size(); ++i)
        if (!isFlat(buffers, i)) flatCells_[i] = kNoCell;
      cell_ = flatCells_;
    }
    widthUp_ = static_cast<int>(std::ceil(width_));
    measureCells();
  }

  /// Returns the share of sample (x, y), 0 to 1, that outlines cover.
  float operator()(int x, int y) const {
    return std::max(alongAxis(x, y, x, -1), alongAxis(x, y, y, -std::ptrdiff_t(buffers_.width)));
  }

 private:
  struct Extent {
    int x0, x1, y0, y1;
  };

  // Chooses the strength of each cell's outline by the cell's size on the screen.
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

  // Returns the share of sample (x, y), 0 to 1, that outlines perpendicular to one axis cover. `position` is the
  // sample's coordinate along this axis. `step` is the index offset to the previous sample along the axis.
  float alongAxis(int x, int y, int position, std::ptrdiff_t step) const {
    const std::size_t i = std::size_t(y) * buffers_.width + x;
    const std::uint32_t* cell = &cell_[i];
    const int most = std::min(widthUp_, position);
    // Cells are convex: if two samples lie in one cell, all samples between them lie in it too.
    if (most == 0 || cell[most * step] == *cell) return 0;
    int k = 1;
    while (cell[k * step] == *cell) ++k;
    if (hidden(i, i + k * step)) return 0;
    const float strength = std::max(strengths_.at(*cell), strengths_.at(cell[k * step]));
    return strength * static_cast<float>(std::clamp(width_ - (k - 1), 0.0, 1.0));
  }

  // Returns true if a plane or section ends between the samples i and j because something nearer covers it, not because
  // a cell ends there.
  bool hidden(std::size_t i, std::size_t j) const {
    if (!inScene_ || (cell_[i] == kNoCell) == (cell_[j] == kNoCell)) return false;
    const auto [flat, other] = cell_[i] != kNoCell ? std::pair(i, j) : std::pair(j, i);
    return buffers_.covered(other) && buffers_.distance[other] < buffers_.distance[flat];
  }

  const ViewBuffers& buffers_;
  bool inScene_;
  std::vector<std::uint32_t> flatCells_;
  std::span<const std::uint32_t> cell_;
  double width_;  // width of an outline, in samples
  int widthUp_;   // width_, rounded up
  std::unordered_map<std::uint32_t, float> strengths_;
};

// Computes the slopes and the zero line of the values in a slice, or on a plane in front of a camera.
class Contours {
 public:
  /// The zero line is where the value equals `zero`.
  explicit Contours(const ViewBuffers& buffers, double zero = 0) : buffers_(buffers), zero_(zero) {}

  /// Returns the length of the value's gradient per sample, by differences, but at least kFlattestSlope · sampleSize.
  double slope(int x, int y, double sampleSize) const {
    const std::size_t i = index(x, y);
    const double dx = derivative(i, 1, x > 0, x + 1 < buffers_.width);
    const double dy = derivative(i, buffers_.width, y > 0, y + 1 < buffers_.height);
    return std::max(std::hypot(dx, dy), kFlattestSlope * sampleSize);
  }

  /// Returns the distance from sample (x, y) to the zero line, in samples. If the field jumps across zero
  /// between two cells, the zero line runs between the neighbouring samples of these cells.
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

  // Returns the derivative of the value along one axis, per sample. Prefers differences within one cell,
  // because a jump at a cell's face is not a slope.
  double derivative(std::size_t i, std::size_t step, bool hasBefore, bool hasAfter) const {
    const auto& cell = buffers_.cell;
    const auto& value = buffers_.value;
    hasBefore = hasBefore && joined(i, i - step);
    hasAfter = hasAfter && joined(i, i + step);
    const bool before = hasBefore && cell[i - step] == cell[i];
    const bool after = hasAfter && cell[i + step] == cell[i];
    if (before || after) {
      hasBefore = before;
      hasAfter = after;
    }
    const double from = value[hasBefore ? i - step : i], to = value[hasAfter ? i + step : i];
    return hasBefore && hasAfter ? (to - from) / 2 : to - from;
  }

  double toCrossing(std::size_t i, std::size_t neighbour) const {
    const double here = buffers_.value[i] - zero_, there = buffers_.value[neighbour] - zero_;
    if (!joined(i, neighbour) || (here < 0) == (there < 0)) return std::numeric_limits<double>::infinity();
    return std::abs(here) / (std::abs(here) + std::abs(there));
  }

  // Returns true if the two samples belong to the same slice, section or plane.
  bool joined(std::size_t i, std::size_t neighbour) const {
    return buffers_.hit(neighbour) && (buffers_.shown.empty() || buffers_.shown[i] == buffers_.shown[neighbour]);
  }

  const ViewBuffers& buffers_;
  double zero_;
};

// The line along which a plane meets the field's surface. It is drawn white with dark borders.
class SurfaceLine {
 public:
  explicit SurfaceLine(const Sampling& sampling) : thin_(sampling.lineWidth * sampling.samples) {}

  /// Draws the line over the colour `ground` of a sample at `distance` samples from the line's centre.
  LinearColor operator()(const LinearColor& ground, double distance) const {
    const LinearColor cased =
        mix(ground, casing_, float(kLineCasingStrength) * coverage(distance, kCasingWidth * thin_));
    return mix(cased, line_, coverage(distance, kSurfaceWidth * thin_));
  }

 private:
  double thin_;
  LinearColor line_ = decodeSrgb(kSurfaceLine), casing_ = decodeSrgb(kLineCasing);
};

/// The share of the backdrop's light that is left where the ground is in shadow.
float groundLight(const FieldLight& light, std::size_t i) {
  if (light.open.empty()) return 1;
  return (1 - kGroundShadow * (1 - light.lit[i])) * (1 - kGroundOcclusion * (1 - light.open[i]));
}

}  // namespace

Color paperColor() { return kPaper; }

LinearColor backdropColor(double fromTop) {
  return fromOklab({0.975 - 0.06 * fromTop * fromTop, -0.003, -0.006 - 0.004 * fromTop});
}

SampleColor levelColors(const ViewBuffers& buffers, ColorBy color) {
  if (color == ColorBy::normal) return {};
  const std::vector<std::uint8_t>& levels = color == ColorBy::degree ? buffers.degree : buffers.depth;
  std::array<LinearColor, 256> colors;
  for (int level = 0; level < 256; ++level) colors[std::size_t(level)] = decodeSrgb(levelColor(level));
  return [colors, &levels](std::size_t i) { return colors[levels[i]]; };
}

SampleColor quantityColors(std::vector<float> quantity, ColorScale scale) {
  return [quantity = std::move(quantity), scale = std::move(scale)](std::size_t i) { return scale(quantity[i]); };
}

Image colorCellSlice(const ViewBuffers& buffers, const SampleColor& color, const Sampling& sampling) {
  const CellOutlines outlines(buffers, sampling, false);
  const Contours contours(buffers);
  const LinearColor paper = decodeSrgb(sampling.paper.value_or(kPaper)), outline = decodeSrgb(kOutline);
  const SurfaceLine lines(sampling);
  return average(buffers, sampling.samples, [&](int x, int y, std::size_t i) -> LinearColor {
    const LinearColor ground = buffers.hit(i) ? color(i) : paper;
    const LinearColor sample = mix(ground, outline, float(kOutlineStrength) * outlines(x, y));
    return buffers.hit(i) ? lines(sample, contours.toZero(x, y, contours.slope(x, y, sampling.sampleSize))) : sample;
  });
}

SampleColor distanceColors(const ViewBuffers& buffers, const DistanceScale& scale, const ColorMap& map) {
  constexpr int kSteps = 4096;
  std::vector<LinearColor> table(kSteps + 1);
  for (int i = 0; i <= kSteps; ++i) table[std::size_t(i)] = map.at(double(i) / kSteps);
  return [&buffers, table = std::move(table), range = scale.range](std::size_t i) {
    const double t = std::clamp(0.5 + 0.5 * buffers.value[i] / range, 0.0, 1.0);
    return table[static_cast<std::size_t>(t * kSteps + 0.5)];
  };
}

Image colorDistanceSlice(const ViewBuffers& buffers, const DistanceScale& scale, const ColorMap& map,
                         const Sampling& sampling) {
  const SampleColor ground = distanceColors(buffers, scale, map);
  const Contours contours(buffers);
  const LinearColor paper = decodeSrgb(sampling.paper.value_or(kPaper)), isoLine = decodeSrgb(kIsoLine);
  const LinearColor zeroLine = decodeSrgb(kZeroLine);
  const double thin = sampling.lineWidth * sampling.samples;
  return average(buffers, sampling.samples, [&](int x, int y, std::size_t i) -> LinearColor {
    if (!buffers.hit(i)) return paper;
    const double value = buffers.value[i];
    LinearColor sample = ground(i);
    const double slope = contours.slope(x, y, sampling.sampleSize);
    const double nearest = std::round(value / scale.step);
    if (nearest != 0) {
      const double distance = std::abs(value - nearest * scale.step) / slope;
      sample = mix(sample, isoLine, float(kIsoStrength) * coverage(distance, thin));
    }
    return mix(sample, zeroLine, coverage(contours.toZero(x, y, slope), kZeroWidth * thin));
  });
}

Image colorGround(const ViewBuffers& buffers, const SampleColor& color, const Sampling& sampling) {
  const LinearColor paper = decodeSrgb(sampling.paper.value_or(kPaper));
  return average(buffers, sampling.samples, [&](int, int, std::size_t i) { return buffers.hit(i) ? color(i) : paper; });
}

Image colorSurface(const ViewBuffers& buffers, const Camera& camera, const SurfaceLook& look, const Sampling& sampling,
                   double offset, const std::vector<float>& lines) {
  const auto shader = surfaceShader(buffers, camera, look);
  const Contours contours(buffers, offset);
  const SurfaceLine surfaceLine(sampling);
  std::optional<CellOutlines> outlines;
  if (!buffers.shown.empty()) outlines.emplace(buffers, sampling, true);
  const LinearColor outline = decodeSrgb(kOutline), solid = decodeSrgb(kSection), air = decodeSrgb(kAir);
  const auto flatColor = [&](std::size_t i) {
    if (look.color) return look.color(i);
    return buffers.shows(i, Shown::section) || buffers.value[i] < offset ? solid : air;
  };
  std::vector<LinearColor> backdrop;
  for (int y = 0; y < buffers.height; ++y)
    backdrop.push_back(sampling.paper ? decodeSrgb(*sampling.paper) : backdropColor((y + 0.5) / buffers.height));
  const auto colorOf = [&](int x, int y, std::size_t i) {
    LinearColor sample = !buffers.covered(i)  ? backdrop[y] * groundLight(look.light, i)
                         : isFlat(buffers, i) ? flatColor(i)
                                              : shader(x, y);
    if (outlines) sample = mix(sample, outline, float(kOutlineStrength) * (*outlines)(x, y));
    if (buffers.shows(i, Shown::plane)) {
      const double slope = contours.slope(x, y, pixelSize(camera, buffers.distance[i], buffers.height));
      sample = surfaceLine(sample, contours.toZero(x, y, slope));
    }
    return lines.empty() ? sample : mix(sample, outline, float(kOutlineStrength) * lines[i]);
  };
  const bool isPlain = !look.color && !look.light.open.empty() && lines.empty() && buffers.shown.empty();
  if (!isPlain) return average(buffers, sampling.samples, colorOf);
  return average(buffers, sampling.samples, colorOf, UniformPixels(buffers, sampling.samples, look.light));
}

Image backdropPicture(int width, int height, int viewHeight) {
  Image image(width, height, paperColor());
  for (int y = 0; y < viewHeight; ++y)
    std::fill_n(&image.at(0, y), width, encodeSrgb(backdropColor((y + 0.5) / viewHeight)));
  return image;
}

void pasteView(Image& picture, const Image& view) {
  for (int y = 0; y < view.height; ++y)
    std::copy_n(&view.pixels[std::size_t(y) * view.width], view.width, &picture.at(0, y));
}

}  // namespace hpsdf::render
