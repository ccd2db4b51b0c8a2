#include "view/surface_blocks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace hpsdf::render {
namespace {

/// A rectangle of blocks, half-open.
struct BlockRect {
  int x0, y0, x1, y1;
};

/// The bounds of a box's projection to the view, in coordinates in which the view is [−1, 1]².
struct Projected {
  double x0 = std::numeric_limits<double>::infinity(), y0 = x0, x1 = -x0, y1 = -x0;
  int behind = 0;                    ///< number of corners behind the eye, which perspective leaves out of the bounds
  std::array<int, 4> outside{};      ///< number of corners beyond each edge of the view's frustum
  Vector3 corner = Vector3::Zero();  ///< the box's lower corner in the camera's frame
};

class BlockFinder {
 public:
  BlockFinder(const FieldData& field, const std::vector<SurfaceBounds>& bounds, const GridSpace& space,
              const RayGeometry& rays, double offset)
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
        for (std::uint32_t x = 0; x < field_.grid[0]; ++x) markBlocks(node++, Vector3(x, y, z), 1);
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

  /// Guesses the sign of f − offset, 1 or −1, at the point p, where rays start. A wrong guess costs time but does not
  /// change the picture.
  float sideAt(const Vector3& p) const {
    std::uint32_t node = 0;
    for (int axis = 2; axis >= 0; --axis)
      node = node * field_.grid[axis] + std::min(static_cast<std::uint32_t>(p[axis]), field_.grid[axis] - 1);
    return 0.5 * (double(bounds_[node].lo) + bounds_[node].hi) >= offset_ ? 1 : -1;
  }

  /// Marks the blocks whose rays may reach parts of a node where f − offset may have another sign than `side_`.
  void markBlocks(std::uint32_t node, const Vector3& lo, double size) {
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
      markBlocks(first + child, lo + 0.5 * size * Vector3(child & 1, child >> 1 & 1, child >> 2), 0.5 * size);
  }

  Projected projected(const Vector3& lo, double size) const {
    Projected result;
    result.corner = viewFromGrid_ * (lo - rays_.eye);
    const Eigen::Matrix3d edges = viewFromGrid_ * size;
    for (int i = 0; i < 8; ++i) {
      Vector3 p = result.corner;
      for (int axis = 0; axis < 3; ++axis)
        if (i >> axis & 1) p += edges.col(axis);
      const double edge = rays_.parallel ? 1 : p.x();
      result.outside[0] += p.y() > edge;
      result.outside[1] += -p.y() > edge;
      result.outside[2] += p.z() > edge;
      result.outside[3] += -p.z() > edge;
      if (!(p.x() > near_)) {
        ++result.behind;
        if (!rays_.parallel) continue;
      }
      result.x0 = std::min(result.x0, p.y() / edge);
      result.x1 = std::max(result.x1, p.y() / edge);
      result.y0 = std::min(result.y0, -p.z() / edge);
      result.y1 = std::max(result.y1, -p.z() / edge);
    }
    return result;
  }

  /// The blocks of the view whose rays may pass a box.
  BlockRect blocksOf(const Vector3& lo, double size) const {
    const BlockRect whole{0, 0, columns_, rows_};
    const Projected box = projected(lo, size);
    if (!box.corner.allFinite()) return whole;
    if (box.behind == 8 || std::ranges::count(box.outside, 8) > 0) return {0, 0, 0, 0};
    if (box.behind > 0 && !rays_.parallel) return whole;
    if (!std::isfinite(box.x0 + box.x1 + box.y0 + box.y1)) return whole;
    // Pixel i has its centre at the view coordinate x for which 2i + 1 = (1 + x) · width. The rectangle gets a margin
    // of one pixel.
    const auto first = [](double x, int pixels) { return std::floor((0.5 * ((1 + x) * pixels - 1) - 1) / kBlock); };
    const auto last = [](double x, int pixels) { return std::floor((0.5 * ((1 + x) * pixels - 1) + 1) / kBlock) + 1; };
    const auto clamped = [](double block, int blocks) { return int(std::clamp(block, 0.0, double(blocks))); };
    return {clamped(first(box.x0, rays_.width), columns_), clamped(first(box.y0, rays_.height), rows_),
            clamped(last(box.x1, rays_.width), columns_), clamped(last(box.y1, rays_.height), rows_)};
  }

  /// A lower bound of the distance along any ray from its start to a box, with a margin for rounding.
  float distance(const Vector3& lo, double size) const {
    constexpr double kRoundingFactor = 1 - 1e-6;
    if (rays_.parallel) {
      const Vector3 toMiddle = lo + Vector3::Constant(0.5 * size) - rays_.eye;
      const Vector3 half = 0.5 * size * worldFromGrid_;
      const double toCorner =
          rays_.forward.dot(toMiddle.cwiseProduct(worldFromGrid_)) - rays_.forward.cwiseAbs().dot(half);
      return static_cast<float>(kRoundingFactor * std::max(0.0, toCorner));
    }
    const Vector3 nearest = rays_.eye.cwiseMax(lo).cwiseMin(lo + Vector3::Constant(size));
    return static_cast<float>(kRoundingFactor * (nearest - rays_.eye).cwiseProduct(worldFromGrid_).norm());
  }

  /// Lowers `Block::start` of all blocks in a rectangle to `start`, unless it is lower already.
  void mark(const BlockRect& rect, float start) {
    for (int y = rect.y0; y < rect.y1; ++y)
      for (int x = rect.x0; x < rect.x1; ++x) {
        float& known = starts_[std::size_t(y) * columns_ + x];
        known = std::min(known, start);
      }
  }

  const FieldData& field_;
  const std::vector<SurfaceBounds>& bounds_;
  const RayGeometry& rays_;
  double offset_;
  double near_;  ///< depth up to which a corner counts as behind the eye, world units
  Vector3 worldFromGrid_;
  Eigen::Matrix3d viewFromGrid_;  ///< transform to the camera's frame, whose axes are its forward, right and up vectors
  float side_;
  int columns_, rows_;
  std::vector<float> starts_;  ///< `Block::start` of every block of the view, kNone for blocks that see nothing
};

}  // namespace

SurfaceBlocks surfaceBlocks(const FieldData& field, const std::vector<SurfaceBounds>& bounds, const GridSpace& space,
                            const RayGeometry& rays, double offset) {
  return BlockFinder(field, bounds, space, rays, offset).find();
}

void keepChosen(std::span<const std::uint8_t> chosen, int width, int height, std::vector<Block>& blocks) {
  for (Block& block : blocks) {
    const int left = static_cast<int>(block.x), top = static_cast<int>(block.y);
    block.chosen = {0, 0};
    for (int y = 0; y < std::min(kBlock, height - top); ++y)
      for (int x = 0; x < std::min(kBlock, width - left); ++x)
        if (chosen.empty() || chosen[std::size_t(top + y) * width + left + x] != 0)
          block.chosen[y * kBlock / 32] |= 1U << (y * kBlock + x) % 32;
  }
  std::erase_if(blocks, [](const Block& block) { return block.chosen == std::array{0U, 0U}; });
}

}  // namespace hpsdf::render
