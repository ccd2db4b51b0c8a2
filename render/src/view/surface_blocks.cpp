#include "view/surface_blocks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace hpsdf::render {
namespace {

/// Blocks, half-open.
struct BlockRect {
  int x0, y0, x1, y1;
};

class Finder {
 public:
  Finder(const FieldData& field, const std::vector<NodeBounds>& bounds, const GridSpace& space, const RayGeometry& rays,
         double offset)
      : field_(field),
        bounds_(bounds),
        rays_(rays),
        offset_(offset),
        near_(1e-9 * space.diagonal),
        worldFromGrid_(space.size.cwiseQuotient(space.grid)),
        columns_((rays.width + kBlock - 1) / kBlock),
        rows_((rays.height + kBlock - 1) / kBlock),
        starts_(std::size_t(columns_) * rows_, kNone) {
    Eigen::Matrix3d axes;
    axes << rays.forward, rays.right, rays.up;
    viewFromGrid_ = axes.inverse() * worldFromGrid_.asDiagonal();
    side_ = sideAt(rays.eye.cwiseMax(0).cwiseMin(space.grid));
  }

  SurfaceBlocks find() {
    std::uint32_t node = 0;
    for (std::uint32_t z = 0; z < field_.grid[2]; ++z)
      for (std::uint32_t y = 0; y < field_.grid[1]; ++y)
        for (std::uint32_t x = 0; x < field_.grid[0]; ++x) visit(node++, Vector3(x, y, z), 1);
    SurfaceBlocks found{side_, {}};
    for (int y = 0; y < rows_; ++y)
      for (int x = 0; x < columns_; ++x) {
        const float start = starts_[std::size_t(y) * columns_ + x];
        if (start < kNone) found.blocks.push_back({float(kBlock * x), float(kBlock * y), start});
      }
    return found;
  }

 private:
  static constexpr float kNone = std::numeric_limits<float>::infinity();

  /// A guess, which decides how much can be left out and nothing else.
  float sideAt(const Vector3& p) const {
    std::uint32_t node = 0;
    for (int axis = 2; axis >= 0; --axis)
      node = node * field_.grid[axis] + std::min(static_cast<std::uint32_t>(p[axis]), field_.grid[axis] - 1);
    return 0.5 * (double(bounds_[node].lo) + bounds_[node].hi) >= offset_ ? 1 : -1;
  }

  void visit(std::uint32_t node, const Vector3& lo, double size) {
    const bool above = bounds_[node].lo > offset_;
    const bool below = bounds_[node].hi < offset_;
    if (side_ > 0 ? above : below) return;
    const BlockRect rect = blocksOf(lo, size);
    const int across = std::max(rect.x1 - rect.x0, rect.y1 - rect.y0);
    if (rect.x0 >= rect.x1 || rect.y0 >= rect.y1) return;
    if (above || below || node::isLeaf(field_.nodes[node]) || across <= 1) {
      mark(rect, distance(lo, size));
      return;
    }
    const std::uint32_t first = node::firstChild(field_.nodes[node]);
    for (std::uint32_t child = 0; child < 8; ++child)
      visit(first + child, lo + 0.5 * size * Vector3(child & 1, child >> 1 & 1, child >> 2), 0.5 * size);
  }

  /// Blocks of the view whose rays may pass the box.
  BlockRect blocksOf(const Vector3& lo, double size) const {
    const BlockRect whole{0, 0, columns_, rows_};
    double x0 = std::numeric_limits<double>::infinity(), y0 = x0, x1 = -x0, y1 = -x0;
    int behind = 0;
    std::array<int, 4> beyond{};  // corners beyond each edge of the view, also those behind the eye
    const Vector3 corner = viewFromGrid_ * (lo - rays_.eye);
    const Eigen::Matrix3d edges = viewFromGrid_ * size;
    for (int i = 0; i < 8; ++i) {
      Vector3 p = corner;
      for (int axis = 0; axis < 3; ++axis)
        if (i >> axis & 1) p += edges.col(axis);
      const double edge = rays_.parallel ? 1 : p.x();
      beyond[0] += p.y() > edge;
      beyond[1] += -p.y() > edge;
      beyond[2] += p.z() > edge;
      beyond[3] += -p.z() > edge;
      if (!(p.x() > near_)) {
        ++behind;
        if (!rays_.parallel) continue;
      }
      x0 = std::min(x0, p.y() / edge);
      x1 = std::max(x1, p.y() / edge);
      y0 = std::min(y0, -p.z() / edge);
      y1 = std::max(y1, -p.z() / edge);
    }
    if (!corner.allFinite()) return whole;
    if (behind == 8 || std::ranges::count(beyond, 8) > 0) return {0, 0, 0, 0};
    if (behind > 0 && !rays_.parallel) return whole;
    // the centre of pixel i is at 2i + 1 = (1 + x) · width; a pixel more on either side
    const auto first = [](double x, int pixels) { return std::floor((0.5 * ((1 + x) * pixels - 1) - 1) / kBlock); };
    const auto last = [](double x, int pixels) { return std::floor((0.5 * ((1 + x) * pixels - 1) + 1) / kBlock) + 1; };
    const auto within = [](double block, int blocks) { return int(std::clamp(block, 0.0, double(blocks))); };
    if (!std::isfinite(x0 + x1 + y0 + y1)) return whole;
    return {within(first(x0, rays_.width), columns_), within(first(y0, rays_.height), rows_),
            within(last(x1, rays_.width), columns_), within(last(y1, rays_.height), rows_)};
  }

  /// From where rays start to the box, a little less for rounding.
  float distance(const Vector3& lo, double size) const {
    constexpr double kLess = 1 - 1e-6;
    if (rays_.parallel) {
      const Vector3 toMiddle = lo + Vector3::Constant(0.5 * size) - rays_.eye;
      const Vector3 half = 0.5 * size * worldFromGrid_;
      const double toCorner =
          rays_.forward.dot(toMiddle.cwiseProduct(worldFromGrid_)) - rays_.forward.cwiseAbs().dot(half);
      return static_cast<float>(kLess * std::max(0.0, toCorner));
    }
    const Vector3 nearest = rays_.eye.cwiseMax(lo).cwiseMin(lo + Vector3::Constant(size));
    return static_cast<float>(kLess * (nearest - rays_.eye).cwiseProduct(worldFromGrid_).norm());
  }

  void mark(const BlockRect& rect, float start) {
    for (int y = rect.y0; y < rect.y1; ++y)
      for (int x = rect.x0; x < rect.x1; ++x) {
        float& known = starts_[std::size_t(y) * columns_ + x];
        known = std::min(known, start);
      }
  }

  const FieldData& field_;
  const std::vector<NodeBounds>& bounds_;
  const RayGeometry& rays_;
  double offset_;
  double near_;  ///< world units: what is closer before the eye counts as behind it
  Vector3 worldFromGrid_;
  Eigen::Matrix3d viewFromGrid_;  ///< forward, right and up as multiples of the camera's
  float side_;
  int columns_, rows_;
  std::vector<float> starts_;
};

}  // namespace

SurfaceBlocks surfaceBlocks(const FieldData& field, const std::vector<NodeBounds>& bounds, const GridSpace& space,
                            const RayGeometry& rays, double offset) {
  return Finder(field, bounds, space, rays, offset).find();
}

}  // namespace hpsdf::render
