#include "scene/cell_lines.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "image/color.h"
#include "image/strokes.h"
#include "scene/cell_boxes.h"
#include "scene/pixel_rows.h"

namespace hpsdf::render {
namespace {

// A cell edge fades if its length in the picture lies between the next two limits, in multiples of the line width.
constexpr double kFullLength = 24;  // edges of this length or more are drawn at full strength
constexpr double kGoneLength = 6;   // edges of this length or less are not drawn

constexpr double kFarthestStrength = 0.3;  // opacity of lines at the far end of the domain; at the near end it is 1
constexpr double kNearDepth = 1e-3;        // least depth at which lines are drawn, in domain diagonals

/// An edge of a cell, or the part of the edge that a clipping plane does not remove.
struct Segment {
  Vector3 a, b;
  double edgeLength;  ///< length of the whole edge, world units
};

/// A segment, its projection to the picture, and the strength of its line.
struct Edge {
  Segment segment;
  PicturePoint from, to;
  float strength = 0;  ///< opacity of the line; 0 for an edge that is not drawn
};

/// Identifies an edge of a cell. All cells of one size that share the edge have the same key for it.
struct EdgeKey {
  std::array<std::uint64_t, 3> from;  ///< lower end of the edge, in units of the smallest possible cell
  std::uint64_t kind;                 ///< axis of the edge, and octree depth of its cells
  bool operator==(const EdgeKey&) const = default;
};

/// Collects the edges of cells. An edge that cells of one size share is collected once.
class EdgeCollector {
 public:
  EdgeCollector(const Field& field, std::size_t mostCells)
      : lower_(field.domain().min()),
        cellsPerUnit_(Vector3(field.grid()[0], field.grid()[1], field.grid()[2]).cwiseQuotient(field.domain().sizes()) *
                      std::ldexp(1.0, kMaxDepth)),
        slots_(std::bit_ceil(24 * mostCells + 1), 0) {
    keys_.reserve(12 * mostCells);
  }

  /// Adds the edges of a cell. `box` is the part of the cell that a clipping plane does not remove.
  void add(const Cell& cell, const Box& box) {
    const Vector3 first = (cell.box.min() - lower_).cwiseProduct(cellsPerUnit_);
    const std::uint64_t size = std::uint64_t{1} << (kMaxDepth - cell.depth);
    const std::array<Vector3, 8> corners = cornersOf(box);
    for (int edge = 0; edge < 12; ++edge) {
      // Edges 0 to 3 run along x, 4 to 7 along y, 8 to 11 along z. The two low bits of `edge` choose the sides along
      // the other two axes.
      const int axis = edge / 4, from = (edge & 1) << (axis + 1) % 3 | (edge >> 1 & 1) << (axis + 2) % 3;
      EdgeKey key{{}, std::uint64_t(cell.depth) * 3 + axis};
      for (int k = 0; k < 3; ++k) key.from[k] = std::uint64_t(std::llround(first[k])) + (from >> k & 1 ? size : 0);
      if (insert(key)) segments.push_back({corners[from], corners[from | 1 << axis], cell.box.sizes()[axis]});
    }
  }

  std::vector<Segment> segments;

 private:
  /// Adds a key to the hash set. Returns true if the key is new. This hash set with open addressing is several
  /// times faster than `std::unordered_set`.
  bool insert(const EdgeKey& key) {
    std::uint64_t hash = key.kind;
    for (const std::uint64_t x : key.from) hash = (hash ^ x) * 0x9e3779b97f4a7c15;
    for (std::size_t i = hash >> 32;; ++i) {
      std::uint32_t& slot = slots_[i & (slots_.size() - 1)];
      if (slot != 0 && keys_[slot - 1] == key) return false;
      if (slot != 0) continue;
      keys_.push_back(key);
      slot = static_cast<std::uint32_t>(keys_.size());
      return true;
    }
  }

  Vector3 lower_;
  Vector3 cellsPerUnit_;              ///< number of cells of the greatest depth in a unit of length, along each axis
  std::vector<std::uint32_t> slots_;  ///< index of a key + 1, or 0 for a free slot
  std::vector<EdgeKey> keys_;
};

/// Draws edges as lines into a buffer that holds the coverage of each pixel.
class EdgePainter {
 public:
  EdgePainter(const Camera& camera, const Box& domain, const ViewBuffers& buffers, double lineWidth,
              std::vector<float>& coverage)
      : camera_(camera),
        buffers_(buffers),
        parallel_(camera.projection == Projection::orthographic),
        pixel_(pixelSize(camera, 1, buffers.height)),
        width_(lineWidth),
        radius_(lineWidth / 2 + 0.5),
        nearDepth_(kNearDepth * domain.diagonal().norm()),
        coverage_(coverage) {
    const double middle = (domain.center() - camera.eye).dot(camera.forward);
    const double half = 0.5 * domain.sizes().dot(camera.forward.cwiseAbs());
    nearest_ = std::max(0.0, middle - half);
    farthest_ = std::max(middle + half, nearest_ + 1e-9 * half);
  }

  /// Returns false if all edges of a box are too small in the picture or behind the eye.
  bool mayShow(const Box& box) const {
    const double middle = (box.center() - camera_.eye).dot(camera_.forward);
    const double half = 0.5 * box.sizes().dot(camera_.forward.cwiseAbs());
    return middle + half > nearDepth_ && pixelsAt(box.sizes().maxCoeff(), middle - half) > kGoneLength * width_;
  }

  /// Projects a segment to the picture, without the part behind the eye, and sets the strength of its line.
  Edge projected(Segment segment) const {
    const auto toPicture = [&](const Vector3& p) { return project(camera_, p, buffers_.width, buffers_.height); };
    Edge edge{segment, toPicture(segment.a), toPicture(segment.b)};
    if (std::max(edge.from.depth, edge.to.depth) <= nearDepth_) return edge;
    const double length = pixelsAt(segment.edgeLength, 0.5 * (edge.from.depth + edge.to.depth));
    edge.strength = smoothStep(kGoneLength * width_, kFullLength * width_, length);
    if (std::min(edge.from.depth, edge.to.depth) >= nearDepth_) return edge;
    const double share = (nearDepth_ - edge.from.depth) / (edge.to.depth - edge.from.depth);
    const Vector3 cut = segment.a + share * (segment.b - segment.a);
    const bool fromBehind = edge.from.depth < nearDepth_;
    (fromBehind ? edge.segment.a : edge.segment.b) = cut;
    (fromBehind ? edge.from : edge.to) = toPicture(cut);
    return edge;
  }

  /// The pixels that an edge may cover; empty for an edge that is not drawn.
  PixelRect rectOf(const Edge& edge) const {
    if (edge.strength <= 0) return {};
    return pixelsNear({edge.from.x, edge.from.y}, {edge.to.x, edge.to.y}, radius_,
                      {0, 0, buffers_.width, buffers_.height});
  }

  /// Draws the part of an edge in the rows from y0 to y1 − 1.
  void paint(const Edge& edge, int y0, int y1) const {
    forEachPixelNear({edge.from.x, edge.from.y}, {edge.to.x, edge.to.y}, radius_, {0, y0, buffers_.width, y1},
                     [&](const NearPixel& near) { paintPixel(edge, near); });
  }

 private:
  /// The size in pixels of a world length that lies at a given depth from the eye.
  double pixelsAt(double length, double depth) const {
    return length / pixelSize(camera_, std::max(depth, nearDepth_), buffers_.height);
  }

  void paintPixel(const Edge& edge, const NearPixel& near) const {
    const double t = near.t, covered = std::min(radius_ - near.distance, 1.0);
    const std::size_t i = std::size_t(near.y) * buffers_.width + near.x;
    // Find the parameter s of the point along the edge in space, because equal steps in a perspective picture are not
    // equal steps in space.
    const double toFar = parallel_ ? 1 - t : (1 - t) * edge.to.depth, toNear = parallel_ ? t : t * edge.from.depth;
    const double s = toNear / (toFar + toNear);
    const double depth = edge.from.depth + s * (edge.to.depth - edge.from.depth);
    const double relativeDepth = std::clamp((depth - nearest_) / (farthest_ - nearest_), 0.0, 1.0);
    const float strength = edge.strength * static_cast<float>(covered * (1 + relativeDepth * (kFarthestStrength - 1)));
    if (strength <= coverage_[i]) return;
    if (buffers_.covered(i)) {
      const Vector3 p = edge.segment.a + s * (edge.segment.b - edge.segment.a);
      // Allow a tolerance, because the buffers show the surface at sample points up to two pixels away from the line.
      const double tolerance = (width_ + 2) * (parallel_ ? pixel_ : pixel_ * depth);
      if ((parallel_ ? depth : (p - camera_.eye).norm()) > double(buffers_.distance[i]) + tolerance) return;
    }
    coverage_[i] = strength;
  }

  const Camera& camera_;
  const ViewBuffers& buffers_;
  bool parallel_;              ///< whether the camera's rays are parallel
  double pixel_;               ///< height of a pixel at depth 1, world units
  double width_;               ///< width of lines, pixels
  double radius_;              ///< distance from a line's middle up to which pixels are covered, pixels
  double nearDepth_;           ///< least depth at which lines are drawn, world units
  double nearest_, farthest_;  ///< least and greatest depth of the domain
  std::vector<float>& coverage_;
};

}  // namespace

std::vector<float> cellLines(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells,
                             const ViewBuffers& buffers, double lineWidth) {
  std::vector<float> coverage(buffers.cell.size(), 0.0F);
  const EdgePainter painter(view.camera, field.domain(), buffers, lineWidth, coverage);
  EdgeCollector collector(field, cells.size());
  for (const Cell& cell : cells)
    if (const Box box = clipped(cell.box, view); !box.isEmpty() && painter.mayShow(cell.box)) collector.add(cell, box);
  const std::vector<Segment>& segments = collector.segments;
  std::vector<Edge> edges(segments.size());
  std::vector<PixelRect> rects(segments.size());
  tbb::parallel_for(std::size_t{0}, segments.size(), [&](std::size_t n) {
    edges[n] = painter.projected(segments[n]);
    rects[n] = painter.rectOf(edges[n]);
  });
  forEachStrip(buffers.height, rects, [&](int y0, int y1, const std::vector<std::uint32_t>& inStrip) {
    for (const std::uint32_t n : inStrip) painter.paint(edges[n], y0, y1);
  });
  return coverage;
}

}  // namespace hpsdf::render
