#include "mesh/scan/triangulate.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

namespace hpsdf::mesh {
namespace {

using Vector2 = Eigen::Vector2d;

double cross(const Vector2& u, const Vector2& v) { return u.x() * v.y() - u.y() * v.x(); }

/// Returns the polygon projected to two dimensions along the coordinate axis nearest to its normal. The result
/// runs counter-clockwise.
std::vector<Vector2> flattened(std::span<const Vector3> polygon) {
  Vector3 normal = Vector3::Zero();
  for (std::size_t i = 2; i < polygon.size(); ++i)
    normal += (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]);
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  Eigen::Index right = (axis + 1) % 3;
  Eigen::Index up = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(right, up);
  std::vector<Vector2> points;
  for (const Vector3& corner : polygon)
    points.emplace_back(corner[right] - polygon[0][right], corner[up] - polygon[0][up]);
  return points;
}

/// A set of polygon corners, stored as a bit set.
class CornerSet {
 public:
  /// Makes a set that contains all corners of a polygon with `corners` corners.
  explicit CornerSet(std::size_t corners) : words_((corners + 63) / 64, ~std::uint64_t{0}) {
    if (corners % 64 != 0) words_.back() = (std::uint64_t{1} << corners % 64) - 1;
  }

  void add(std::uint32_t corner) { words_[corner / 64] |= bit(corner); }
  void remove(std::uint32_t corner) { words_[corner / 64] &= ~bit(corner); }

  /// Returns the first corner of the set at or after `start` in cyclic order, or std::nullopt if the set is empty.
  std::optional<std::uint32_t> next(std::uint32_t start) const {
    std::uint64_t bits = words_[start / 64] & ~(bit(start) - 1);
    for (std::size_t i = 0, word = start / 64; i <= words_.size(); ++i, bits = words_[word]) {
      if (bits != 0) return static_cast<std::uint32_t>(64 * word + std::size_t(std::countr_zero(bits)));
      word = (word + 1) % words_.size();
    }
    return std::nullopt;
  }

 private:
  static std::uint64_t bit(std::uint32_t corner) { return std::uint64_t{1} << corner % 64; }

  std::vector<std::uint64_t> words_;
};

/// A uniform grid that finds the corners of a polygon within a box. It has about one cell per four corners.
class CornerGrid {
 public:
  explicit CornerGrid(const std::vector<Vector2>& points)
      : side_(static_cast<std::size_t>(std::sqrt(double(points.size())) / 2) + 1), starts_(side_ * side_ + 1) {
    for (const Vector2& p : points) box_.extend(p);
    for (const Vector2& p : points) ++starts_[cellOf(p) + 1];
    for (std::size_t cell = 1; cell < starts_.size(); ++cell) starts_[cell] += starts_[cell - 1];
    std::vector<std::uint32_t> ends(starts_.begin(), starts_.end() - 1);
    corners_.resize(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) corners_[ends[cellOf(points[i])]++] = i;
  }

  /// Returns a corner for which `is` returns true, or std::nullopt if there is none. Tests all corners in the box and
  /// some corners near it.
  template <typename Predicate>
  std::optional<std::uint32_t> find(const Eigen::AlignedBox2d& box, const Predicate& is) const {
    const std::size_t lastX = column(0, box.max().x()), lastY = column(1, box.max().y());
    for (std::size_t y = column(1, box.min().y()); y <= lastY; ++y) {
      const std::size_t row = y * side_;
      for (std::uint32_t i = starts_[row + column(0, box.min().x())]; i < starts_[row + lastX + 1]; ++i)
        if (is(corners_[i])) return corners_[i];
    }
    return std::nullopt;
  }

 private:
  std::size_t column(int axis, double x) const {
    const double at = (x - box_.min()[axis]) / (box_.max()[axis] - box_.min()[axis]) * double(side_);
    return at > 0 ? static_cast<std::size_t>(std::min(at, double(side_ - 1))) : 0;
  }
  std::size_t cellOf(const Vector2& p) const { return column(1, p.y()) * side_ + column(0, p.x()); }

  std::size_t side_;
  Eigen::AlignedBox2d box_;
  std::vector<std::uint32_t> starts_;   ///< index of each cell's first corner in `corners_`, row by row
  std::vector<std::uint32_t> corners_;  ///< indices of the corners, sorted by cell
};

/// Triangulates a polygon by ear clipping (Meisters 1975): cuts off one ear after another. An ear is a convex
/// corner whose triangle with its two neighbours contains no other corner. A corner that is not an ear is tested
/// again after a neighbour, or the corner found in its triangle, has been cut off.
class EarClipper {
 public:
  EarClipper(std::span<const Vector3> polygon, const Progress& progress)
      : progress_(progress),
        points_(flattened(polygon)),
        grid_(points_),
        maybeClear_(points_.size()),
        maybe_(points_.size()),
        blocked_(points_.size()),
        isLeft_(points_.size(), true),
        left_(points_.size()) {
    const auto n = static_cast<std::uint32_t>(left_);
    for (std::uint32_t i = 0; i < n; ++i) {
      next_.push_back((i + 1) % n);
      previous_.push_back((i + n - 1) % n);
    }
  }

  std::vector<Triangle> clip() {
    // Cut off thin ears only if there is no other ear. Rounding, mostly to float, moves corners off a straight side.
    // Ears as thin as these rounding errors, and ears whose cut passes another corner as closely, would yield slivers
    // with random normals. The tolerance is relative to the length of the sides.
    constexpr double kRounding = 1e-4;
    while (left_ > 3) {
      std::optional<std::uint32_t> ear = findEar(kRounding, maybeClear_);
      if (!ear) ear = findEar(0, maybe_);
      cut(ear ? *ear : flattestCorner());
    }
    if (left_ == 3) cut(start_);
    return std::move(triangles_);
  }

 private:
  /// Reports progress whenever many corners have been looked at.
  void report() {
    constexpr std::size_t kBetweenReports = 1'000'000;
    if (looked_ < kBetweenReports) return;
    looked_ = 0;
    progress_.update("Triangulating a polygon of the mesh", 1 - double(left_) / double(points_.size()));
  }

  std::optional<std::uint32_t> findEar(double tolerance, CornerSet& candidates) {
    std::optional<std::uint32_t> corner = candidates.next(start_);
    for (; corner && !isEar(*corner, tolerance); corner = candidates.next(*corner)) {
      candidates.remove(*corner);
      report();
    }
    return corner;
  }

  /// Returns true if `corner` is an ear that can be cut off. The corner must deviate from a straight angle by
  /// more than `tolerance`, and all other corners must be outside its triangle by more than `tolerance`. The
  /// tolerance is relative to the triangle's sides.
  bool isEar(std::uint32_t corner, double tolerance) {
    const std::uint32_t before = previous_[corner], after = next_[corner];
    const std::array<Vector2, 3> ear = {points_[before], points_[corner], points_[after]};
    const Vector2 in = ear[1] - ear[0];
    const Vector2 out = ear[2] - ear[1];
    if (!(cross(in, out) > tolerance * in.norm() * out.norm())) return false;
    const auto other = grid_.find(boxAround(ear, tolerance), [&](std::uint32_t p) {
      ++looked_;
      return isLeft_[p] && p != before && p != corner && p != after && isNear(points_[p], ear, tolerance);
    });
    if (other) blocked_[*other].push_back(corner);
    return !other;
  }

  /// Returns the bounding box of the triangle `ear` with every side moved outwards by `tolerance` times the side's
  /// length. The box contains all points for which `isNear` returns true.
  static Eigen::AlignedBox2d boxAround(const std::array<Vector2, 3>& ear, double tolerance) {
    Eigen::AlignedBox2d box;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector2 in = ear[i] - ear[(i + 2) % 3], out = ear[(i + 1) % 3] - ear[i];
      box.extend(ear[i] + tolerance / cross(in, out) * (out.squaredNorm() * in - in.squaredNorm() * out));
    }
    return box;
  }

  /// Returns true if p is in or near the triangle `ear` but not at one of its corners. Corner positions do not
  /// count because a polygon with a slit passes through the same point twice.
  static bool isNear(const Vector2& p, const std::array<Vector2, 3>& ear, double tolerance) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector2 side = ear[(i + 1) % 3] - ear[i];
      if (p == ear[i] || cross(side, p - ear[i]) < -tolerance * side.squaredNorm()) return false;
    }
    return true;
  }

  /// Returns the corner that makes the smallest triangle with its two neighbours. The clipper cuts this corner off if
  /// the polygon has no ear, because it is flat or intersects itself.
  std::uint32_t flattestCorner() {
    looked_ += left_;
    report();
    std::uint32_t best = start_;
    double least = std::numeric_limits<double>::infinity();
    std::uint32_t corner = start_;
    for (std::size_t i = 0; i < left_; ++i, corner = next_[corner]) {
      const Vector2& p = points_[corner];
      const double area = std::abs(cross(p - points_[previous_[corner]], points_[next_[corner]] - p));
      if (area >= least) continue;
      least = area;
      best = corner;
    }
    return best;
  }

  void cut(std::uint32_t corner) {
    const std::uint32_t before = previous_[corner];
    const std::uint32_t after = next_[corner];
    triangles_.push_back({before, corner, after});
    next_[before] = after;
    previous_[after] = before;
    start_ = next_[after];  // Starting at the neighbour `after` would yield a fan of slivers.
    --left_;
    isLeft_[corner] = false;
    maybeClear_.remove(corner);
    maybe_.remove(corner);
    testAgain(before);
    testAgain(after);
    for (const std::uint32_t other : blocked_[corner]) testAgain(other);
  }

  void testAgain(std::uint32_t corner) {
    if (!isLeft_[corner]) return;
    maybeClear_.add(corner);
    maybe_.add(corner);
  }

  const Progress& progress_;
  std::size_t looked_ = 0;  ///< corners looked at since the last report
  std::vector<Vector2> points_;
  CornerGrid grid_;
  CornerSet maybeClear_, maybe_;                     ///< corners to test as ears, with and without a tolerance
  std::vector<std::vector<std::uint32_t>> blocked_;  ///< for each corner, the corners whose triangles contain it
  std::vector<bool> isLeft_;
  std::vector<std::uint32_t> next_;
  std::vector<std::uint32_t> previous_;
  std::vector<Triangle> triangles_;
  std::uint32_t start_ = 0;
  std::size_t left_;  ///< number of corners not yet cut off
};

}  // namespace

std::vector<Triangle> triangulate(std::span<const Vector3> polygon, const Progress& progress) {
  if (polygon.size() == 3) return {{0, 1, 2}};
  return EarClipper(polygon, progress).clip();
}

}  // namespace hpsdf::mesh
