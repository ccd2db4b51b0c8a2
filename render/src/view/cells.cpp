#include "view/cells.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "view/grid_space.h"
#include "view/section.h"

namespace hpsdf::render {
namespace {

constexpr int kStrip = 16;  // rows that one thread fills at a time

// Of lines, in multiples of their width: cells that are smaller in the picture have none.
constexpr double kLinesFadeBelow = 24;
constexpr double kLinesGoneBelow = 6;
constexpr double kFarthestLine = 0.3;  // strength where the domain ends, 1 where it begins
constexpr double kNearestLine = 1e-3;  // before the eye, domain diagonals: what is closer is cut off

/// Pixels, half-open.
struct Extent {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool empty() const { return x1 <= x0 || y1 <= y0; }
};

std::array<Vector3, 8> cornersOf(const Box& box) {
  std::array<Vector3, 8> corners;
  for (int i = 0; i < 8; ++i)
    corners[i] = {(i & 1 ? box.max() : box.min()).x(), (i & 2 ? box.max() : box.min()).y(),
                  (i & 4 ? box.max() : box.min()).z()};
  return corners;
}

/// What the clipping plane leaves of a box; empty where that is nothing or a face.
Box clipped(Box box, const SurfaceView& view) {
  if (!view.clip) return box;
  const auto [axis, offset] = *view.clip;
  if (eyeAbove(view.camera, *view.clip))
    box.max()[axis] = std::min(box.max()[axis], offset);
  else
    box.min()[axis] = std::max(box.min()[axis], offset);
  if (!(box.min()[axis] < box.max()[axis])) box.setEmpty();
  return box;
}

/// The pixels that may see a box, a little more; all of them where it reaches behind the eye.
Extent extentOf(const Box& box, const Camera& camera, int width, int height) {
  Eigen::AlignedBox2d seen;
  int behind = 0;
  for (const Vector3& corner : cornersOf(box)) {
    const PicturePoint p = project(camera, corner, width, height);
    if (p.depth > 0)
      seen.extend(Eigen::Vector2d(p.x, p.y));
    else
      ++behind;
  }
  if (behind == 8) return {};
  if (behind > 0) return {0, 0, width, height};
  const auto within = [](double pixel, int pixels) { return int(std::clamp(pixel, 0.0, double(pixels))); };
  return {within(std::floor(seen.min().x()), width), within(std::floor(seen.min().y()), height),
          within(std::ceil(seen.max().x()), width), within(std::ceil(seen.max().y()), height)};
}

/// Calls fill(y0, y1, indices) for strips of rows in several threads: of the extents' indices those that reach into
/// the strip, in their order. Whatever is done to the strip's rows comes out the same for any number of threads.
template <typename Fill>
void forStrips(int height, const std::vector<Extent>& extents, const Fill& fill) {
  std::vector<std::vector<std::uint32_t>> strips((height + kStrip - 1) / kStrip);
  for (std::size_t i = 0; i < extents.size(); ++i)
    if (!extents[i].empty())
      for (int strip = extents[i].y0 / kStrip; strip * kStrip < extents[i].y1; ++strip)
        strips[strip].push_back(static_cast<std::uint32_t>(i));
  tbb::parallel_for(std::size_t{0}, strips.size(), [&](std::size_t strip) {
    const int y0 = static_cast<int>(strip) * kStrip;
    fill(y0, std::min(y0 + kStrip, height), strips[strip]);
  });
}

struct PixelRay {
  Vector3 start, direction, inverse;
};

PixelRay rayOf(const Camera& camera, int x, int y, int width, int height) {
  PixelRay ray{pixelEye(camera, x, y, width, height), pixelRay(camera, x, y, width, height), {}};
  // no infinities, which times 0 would be no number: along an axis all faces are very far away
  for (int axis = 0; axis < 3; ++axis)
    ray.inverse[axis] = 1 / (ray.direction[axis] != 0 ? ray.direction[axis] : 1e-200);
  return ray;
}

struct Entry {
  double distance;
  int axis;  ///< of the face
};

/// Where a ray from outside enters a box.
std::optional<Entry> enter(const PixelRay& ray, const Box& box) {
  const Vector3 a = (box.min() - ray.start).cwiseProduct(ray.inverse);
  const Vector3 b = (box.max() - ray.start).cwiseProduct(ray.inverse);
  const Vector3 near = a.cwiseMin(b);
  Entry entry{near.x(), 0};
  for (int axis = 1; axis < 3; ++axis)
    if (near[axis] > entry.distance) entry = {near[axis], axis};
  if (!(entry.distance > 0) || entry.distance > a.cwiseMax(b).minCoeff()) return std::nullopt;
  return entry;
}

/// The part of a cell that is drawn, and how far away it begins at least.
struct Piece {
  Box box;
  const Cell* cell;
  double nearest;
};

std::vector<Piece> boxesOf(const SurfaceView& view, const std::vector<Cell>& cells) {
  const Camera& camera = view.camera;
  std::vector<Piece> pieces;
  for (const Cell& cell : cells) {
    const Vector3 half = 0.5 * kBoxShare * cell.box.sizes();
    const Box box = clipped(Box(cell.box.center() - half, cell.box.center() + half), view);
    const bool holdsEye = camera.projection == Projection::perspective && box.contains(camera.eye);
    if (!box.isEmpty() && !holdsEye) pieces.push_back({box, &cell, box.squaredExteriorDistance(camera.eye)});
  }
  // from the nearest, which hides most of the others
  std::ranges::stable_sort(pieces, {}, &Piece::nearest);
  return pieces;
}

void setBox(const Piece& piece, const Entry& entry, const PixelRay& ray, std::size_t i, ViewBuffers& buffers) {
  buffers.cell[i] = piece.cell->id;
  buffers.degree[i] = static_cast<std::uint8_t>(piece.cell->degree);
  buffers.depth[i] = static_cast<std::uint8_t>(piece.cell->depth);
  buffers.normal[i] = (ray.direction[entry.axis] > 0 ? -1.0F : 1.0F) * Eigen::Vector3f::Unit(entry.axis);
  buffers.distance[i] = static_cast<float>(entry.distance);
  buffers.crack[i] = 0;
  buffers.shown[i] = Shown::box;
}

/// f where boxes are seen in some rows, of which the rays are given.
void addValues(const Field& field, int y0, const std::vector<PixelRay>& rays, ViewBuffers& buffers) {
  const std::size_t first = std::size_t(y0) * buffers.width;
  std::vector<std::size_t> pixels;
  std::vector<Vector3> points;
  for (std::size_t n = 0; n < rays.size(); ++n) {
    if (!buffers.shows(first + n, Shown::box)) continue;
    pixels.push_back(first + n);
    points.push_back(rays[n].start + double(buffers.distance[first + n]) * rays[n].direction);
  }
  std::vector<double> values(points.size());
  field.values(points, values);
  for (std::size_t n = 0; n < pixels.size(); ++n) buffers.value[pixels[n]] = static_cast<float>(values[n]);
}

/// A straight line in space.
struct Segment {
  Vector3 a, b;
  double whole;  ///< length of the edge, of which it may be a part
};

/// As it is seen.
struct Edge {
  Segment segment;
  PicturePoint from, to;
  float strength = 0;  ///< 0 where it is not
};

/// Names an edge of a cell, the same from each of the cells of one size that share it.
struct EdgeName {
  std::array<std::uint64_t, 3> from;  ///< in cells of the greatest depth
  std::uint64_t kind;                 ///< axis and depth
  bool operator==(const EdgeName&) const = default;
};

/// Edges that have been met before.
class KnownEdges {
 public:
  explicit KnownEdges(std::size_t most) : slots_(std::bit_ceil(2 * most + 1), 0) { names_.reserve(most); }

  /// Whether it is a new one.
  bool add(const EdgeName& name) {
    std::uint64_t hash = name.kind;
    for (const std::uint64_t x : name.from) hash = (hash ^ x) * 0x9e3779b97f4a7c15;
    for (std::size_t slot = hash >> 32;; ++slot) {
      std::uint32_t& known = slots_[slot & (slots_.size() - 1)];
      if (known == 0) {
        names_.push_back(name);
        known = static_cast<std::uint32_t>(names_.size());
        return true;
      }
      if (names_[known - 1] == name) return false;
    }
  }

 private:
  std::vector<std::uint32_t> slots_;  ///< one more than an index, 0 where free
  std::vector<EdgeName> names_;
};

/// The edges of the cells that `mayShow`, each once, cut by the clipping plane.
template <typename MayShow>
std::vector<Segment> edgesOf(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells,
                             const MayShow& mayShow) {
  const Vector3 lower = field.domain().min();
  const Vector3 perUnit =
      Vector3(field.grid()[0], field.grid()[1], field.grid()[2]).cwiseQuotient(field.domain().sizes()) *
      std::ldexp(1.0, kMaxDepth);
  KnownEdges known(12 * cells.size());
  std::vector<Segment> segments;
  for (const Cell& cell : cells) {
    const Box box = clipped(cell.box, view);
    if (box.isEmpty() || !mayShow(cell.box)) continue;
    const Vector3 first = (cell.box.min() - lower).cwiseProduct(perUnit);
    const std::uint64_t size = std::uint64_t{1} << (kMaxDepth - cell.depth);
    const std::array<Vector3, 8> corners = cornersOf(box);
    for (int i = 0; i < 8; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        if (i >> axis & 1) continue;
        EdgeName name{{}, std::uint64_t(cell.depth) * 3 + axis};
        for (int k = 0; k < 3; ++k) name.from[k] = std::uint64_t(std::llround(first[k])) + (i >> k & 1 ? size : 0);
        if (known.add(name)) segments.push_back({corners[i], corners[i | 1 << axis], cell.box.sizes()[axis]});
      }
  }
  return segments;
}

float smoothStep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return static_cast<float>(t * t * (3 - 2 * t));
}

/// Draws edges into coverage, rows of one strip at a time.
class EdgePainter {
 public:
  EdgePainter(const Camera& camera, const Box& domain, const ViewBuffers& buffers, double lineWidth,
              std::vector<float>& coverage)
      : camera_(camera),
        buffers_(buffers),
        parallel_(camera.projection == Projection::orthographic),
        pixel_(pixelSize(camera, 1, buffers.height)),
        width_(lineWidth),
        reach_(lineWidth / 2 + 0.5),
        closest_(kNearestLine * domain.diagonal().norm()),
        coverage_(coverage) {
    const double middle = (domain.center() - camera.eye).dot(camera.forward);
    const double half = 0.5 * domain.sizes().dot(camera.forward.cwiseAbs());
    nearest_ = std::max(0.0, middle - half);
    farthest_ = std::max(middle + half, nearest_ + 1e-9 * half);
  }

  /// False where all of a box's edges are too small in the picture, or behind the eye.
  bool mayShow(const Box& box) const {
    const double middle = (box.center() - camera_.eye).dot(camera_.forward);
    const double half = 0.5 * box.sizes().dot(camera_.forward.cwiseAbs());
    return middle + half > closest_ && sizeAt(box.sizes().maxCoeff(), middle - half) > kLinesGoneBelow * width_;
  }

  /// What of it lies before the eye.
  Edge seen(Segment segment) const {
    const auto place = [&](const Vector3& point) { return project(camera_, point, buffers_.width, buffers_.height); };
    Edge edge{segment, place(segment.a), place(segment.b)};
    if (std::max(edge.from.depth, edge.to.depth) <= closest_) return edge;
    const double size = sizeAt(segment.whole, 0.5 * (edge.from.depth + edge.to.depth));
    edge.strength = smoothStep(kLinesGoneBelow * width_, kLinesFadeBelow * width_, size);
    if (std::min(edge.from.depth, edge.to.depth) >= closest_) return edge;
    const double share = (closest_ - edge.from.depth) / (edge.to.depth - edge.from.depth);
    const Vector3 cut = segment.a + share * (segment.b - segment.a);
    const bool fromBehind = edge.from.depth < closest_;
    (fromBehind ? edge.segment.a : edge.segment.b) = cut;
    (fromBehind ? edge.from : edge.to) = place(cut);
    return edge;
  }

  /// Empty for an edge that is not seen.
  Extent extentOf(const Edge& edge) const {
    if (edge.strength <= 0) return {};
    const auto low = [&](double p, double q, int most) {
      return int(std::clamp(std::floor(std::min(p, q) - reach_), 0.0, double(most)));
    };
    const auto high = [&](double p, double q, int most) {
      return int(std::clamp(std::ceil(std::max(p, q) + reach_), 0.0, double(most)));
    };
    return {low(edge.from.x, edge.to.x, buffers_.width), low(edge.from.y, edge.to.y, buffers_.height),
            high(edge.from.x, edge.to.x, buffers_.width), high(edge.from.y, edge.to.y, buffers_.height)};
  }

  void paint(const Edge& edge, int y0, int y1) const {
    const Extent extent = extentOf(edge);
    const double dx = edge.to.x - edge.from.x, dy = edge.to.y - edge.from.y, length = std::hypot(dx, dy);
    for (int y = std::max(y0, extent.y0); y < std::min(y1, extent.y1); ++y) {
      double left = extent.x0, right = extent.x1;
      if (std::abs(dy) > 1e-6 * length) {  // the band about the whole line
        const double x = edge.from.x + (y + 0.5 - edge.from.y) / dy * dx, half = reach_ * length / std::abs(dy);
        left = std::clamp(std::floor(x - half), left, right);
        right = std::clamp(std::ceil(x + half), left, right);
      }
      for (int x = int(left); x < int(right); ++x) paintPixel(edge, dx, dy, length, x, y);
    }
  }

 private:
  /// Pixels that a length takes at a depth.
  double sizeAt(double length, double depth) const {
    return length / pixelSize(camera_, std::max(depth, closest_), buffers_.height);
  }

  void paintPixel(const Edge& edge, double dx, double dy, double length, int x, int y) const {
    const double fromX = x + 0.5 - edge.from.x, fromY = y + 0.5 - edge.from.y;
    const double t = length > 0 ? std::clamp((fromX * dx + fromY * dy) / (length * length), 0.0, 1.0) : 0.0;
    const double acrossX = fromX - t * dx, acrossY = fromY - t * dy, square = acrossX * acrossX + acrossY * acrossY;
    if (square >= reach_ * reach_) return;
    const double covered = std::min(reach_ - std::sqrt(square), 1.0);
    const std::size_t i = std::size_t(y) * buffers_.width + x;
    // straight in the picture, but in perspective not even in depth
    const double toFar = parallel_ ? 1 - t : (1 - t) * edge.to.depth, toNear = parallel_ ? t : t * edge.from.depth;
    const double s = toNear / (toFar + toNear);
    const double depth = edge.from.depth + s * (edge.to.depth - edge.from.depth);
    const double place = std::clamp((depth - nearest_) / (farthest_ - nearest_), 0.0, 1.0);
    const float strength = edge.strength * static_cast<float>(covered * (1 + place * (kFarthestLine - 1)));
    if (strength <= coverage_[i]) return;
    if (buffers_.covered(i)) {
      const Vector3 p = edge.segment.a + s * (edge.segment.b - edge.segment.a);
      // what it lies on may be sampled a pixel or two away from it
      const double tolerance = (width_ + 2) * (parallel_ ? pixel_ : pixel_ * depth);
      if ((parallel_ ? depth : (p - camera_.eye).norm()) > double(buffers_.distance[i]) + tolerance) return;
    }
    coverage_[i] = strength;
  }

  const Camera& camera_;
  const ViewBuffers& buffers_;
  bool parallel_;  ///< rays
  double pixel_;   ///< what one covers at depth 1
  double width_, reach_, closest_;
  double nearest_, farthest_;  // depths of the domain
  std::vector<float>& coverage_;
};

}  // namespace

std::vector<Cell> chosenCells(const Field& field, const ShownCells& choice) {
  const auto among = [](const std::vector<int>& levels, int level) {
    return levels.empty() || std::ranges::find(levels, level) != levels.end();
  };
  std::vector<Cell> cells;
  field.forEachCell([&](const Cell& cell) {
    if (among(choice.degrees, cell.degree) && among(choice.depths, cell.depth)) cells.push_back(cell);
  });
  return cells;
}

void addBoxes(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells, ViewBuffers& buffers) {
  prepareShown(buffers);
  const int width = buffers.width, height = buffers.height;
  const std::vector<Piece> pieces = boxesOf(view, cells);
  std::vector<Extent> extents(pieces.size());
  tbb::parallel_for(std::size_t{0}, pieces.size(),
                    [&](std::size_t n) { extents[n] = extentOf(pieces[n].box, view.camera, width, height); });
  forStrips(height, extents, [&](int y0, int y1, const std::vector<std::uint32_t>& inStrip) {
    if (inStrip.empty()) return;
    std::vector<PixelRay> rays;
    rays.reserve(std::size_t(y1 - y0) * width);
    for (int y = y0; y < y1; ++y)
      for (int x = 0; x < width; ++x) rays.push_back(rayOf(view.camera, x, y, width, height));
    for (const std::uint32_t n : inStrip) {
      const Extent& extent = extents[n];
      for (int y = std::max(y0, extent.y0); y < std::min(y1, extent.y1); ++y)
        for (int x = extent.x0; x < extent.x1; ++x) {
          const std::size_t i = std::size_t(y) * width + x;
          const PixelRay& ray = rays[std::size_t(y - y0) * width + x];
          const auto entry = enter(ray, pieces[n].box);
          if (entry && !(buffers.hit(i) && buffers.distance[i] <= static_cast<float>(entry->distance)))
            setBox(pieces[n], *entry, ray, i, buffers);
        }
    }
    addValues(field, y0, rays, buffers);
  });
}

std::vector<float> cellLines(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells,
                             const ViewBuffers& buffers, double lineWidth) {
  std::vector<float> coverage(buffers.cell.size(), 0.0F);
  const EdgePainter painter(view.camera, field.domain(), buffers, lineWidth, coverage);
  const auto mayShow = [&](const Box& box) { return painter.mayShow(box); };
  const std::vector<Segment> segments = edgesOf(field, view, cells, mayShow);
  std::vector<Edge> edges(segments.size());
  std::vector<Extent> extents(segments.size());
  tbb::parallel_for(std::size_t{0}, segments.size(), [&](std::size_t n) {
    edges[n] = painter.seen(segments[n]);
    extents[n] = painter.extentOf(edges[n]);
  });
  forStrips(buffers.height, extents, [&](int y0, int y1, const std::vector<std::uint32_t>& inStrip) {
    for (const std::uint32_t n : inStrip) painter.paint(edges[n], y0, y1);
  });
  return coverage;
}

}  // namespace hpsdf::render
