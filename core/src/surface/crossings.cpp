#include "surface/crossings.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "bvh/segment.h"
#include "bvh/triangle_frame.h"
#include "surface/exact_orientation.h"

namespace hpsdf {
namespace distance {
namespace {

using Corners = std::array<std::uint32_t, 3>;
using Triangle = std::array<Vector3, 3>;
using Axes = std::array<int, 2>;

bool inBox(const Vector3& x, const Vector3& a, const Vector3& b, const Axes& axes) {
  return std::ranges::all_of(axes, [&](int k) { return std::min(a[k], b[k]) <= x[k] && x[k] <= std::max(a[k], b[k]); });
}

/// Two axes along whose plane the triangle is seen with an area; the same ones twice where it has none.
Axes axesOf(const Triangle& t) {
  for (const Axes axes : {Axes{0, 1}, Axes{1, 2}, Axes{2, 0}})
    if (orientation(axes, t[0], t[1], t[2]) != 0) return axes;
  return {0, 0};
}

bool spansPlane(const Triangle& t) {
  const Axes axes = axesOf(t);
  return axes[0] != axes[1];
}

bool contains(const Triangle& t, const Vector3& x, const Axes& axes) {
  const int turn = orientation(axes, t[0], t[1], t[2]);
  for (int k = 0; k < 3; ++k)
    if (orientation(axes, t[k], t[(k + 1) % 3], x) * turn < 0) return false;
  return true;
}

bool segmentsMeet(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d, const Axes& axes) {
  const int atC = orientation(axes, a, b, c), atD = orientation(axes, a, b, d);
  const int atA = orientation(axes, c, d, a), atB = orientation(axes, c, d, b);
  if (atC * atD < 0 && atA * atB < 0) return true;
  return (atC == 0 && inBox(c, a, b, axes)) || (atD == 0 && inBox(d, a, b, axes)) ||
         (atA == 0 && inBox(a, c, d, axes)) || (atB == 0 && inBox(b, c, d, axes));
}

/// A segment and a triangle with an area, both with their ends and sides.
bool meet(const Vector3& from, const Vector3& to, const Triangle& t) {
  const int start = orientation(t[0], t[1], t[2], from), end = orientation(t[0], t[1], t[2], to);
  if (start * end > 0) return false;
  if (start == 0 && end == 0) {
    const Axes axes = axesOf(t);
    if (contains(t, from, axes) || contains(t, to, axes)) return true;
    for (int k = 0; k < 3; ++k)
      if (segmentsMeet(from, to, t[k], t[(k + 1) % 3], axes)) return true;
    return false;
  }
  bool left = false, right = false;
  for (int k = 0; k < 3; ++k) {
    const int side = orientation(from, to, t[k], t[(k + 1) % 3]);
    left |= side > 0;
    right |= side < 0;
  }
  return !left || !right;
}

/// All three corners of one are strictly on one side of the other.
bool isAside(const Triangle& t, std::span<const Vector3> corners) {
  int sum = 0;
  for (const Vector3& corner : corners) sum += orientation(t[0], t[1], t[2], corner);
  return static_cast<std::size_t>(std::abs(sum)) == corners.size();
}

/// The first corner is shared. A point that both have besides lies on a ray from there, which leaves one of them by the
/// side across, within the other.
bool meetBeyondCorner(const Triangle& one, const Triangle& other) {
  if (isAside(one, {other.begin() + 1, 2}) || isAside(other, {one.begin() + 1, 2})) return false;
  return meet(one[1], one[2], other) || meet(other[1], other[2], one);
}

/// The first two corners are shared: folded flat on each other, or not at all.
bool meetBeyondSide(const Triangle& one, const Triangle& other) {
  if (orientation(one[0], one[1], one[2], other[2]) != 0) return false;
  const Axes axes = axesOf(one);
  return orientation(axes, one[0], one[1], one[2]) == orientation(axes, one[0], one[1], other[2]);
}

/// Brings the corners that are shared to the front of both; how many these are.
int shareInFront(Corners& one, Corners& other) {
  int shared = 0;
  for (int i = 0; i < 3; ++i) {
    const auto same = std::find(other.begin() + shared, other.end(), one[i]);
    if (same == other.end()) continue;
    std::swap(one[i], one[shared]);
    std::iter_swap(same, other.begin() + shared++);
  }
  return shared;
}

// Nearness, to rounding: what follows decides only whether triangles are too near to tell apart.

double squaredDistance(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  const auto toSegment = [](const Vector3& x, const Vector3& from, const Vector3& to) {
    return (from + closestParameter(x, from, to) * (to - from) - x).squaredNorm();
  };
  double least = std::min({toSegment(a, c, d), toSegment(b, c, d), toSegment(c, a, b), toSegment(d, a, b)});
  const Vector3 u = b - a, v = d - c, across = u.cross(v), between = c - a;
  const double squared = across.squaredNorm();
  if (!(squared > 0)) return least;
  const double s = between.cross(v).dot(across) / squared, t = between.cross(u).dot(across) / squared;
  if (s >= 0 && s <= 1 && t >= 0 && t <= 1) {
    const double height = between.dot(across);
    least = std::min(least, height * height / squared);
  }
  return least;
}

/// All corners are on one side of the triangle's plane, and farther from it than the margin.
bool isFarAside(const Triangle& t, std::span<const Vector3> corners, double margin) {
  const Vector3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double least = margin * normal.norm();
  int above = 0, below = 0;
  for (const Vector3& corner : corners) {
    const double height = normal.dot(corner - t[0]);
    above += height > least;
    below += height < -least;
  }
  return std::max(above, below) == static_cast<int>(corners.size());
}

/// A point or a segment, or all of a triangle, is within the margin of the other.
bool isNear(const Triangle& t, std::span<const Vector3> corners, double margin) {
  if (isFarAside(t, corners, margin)) return false;
  const TriangleFrame frame = makeFrame(t, 0);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (distance::squaredDistance(frame, corners[i]) < margin * margin) return true;
    if (i + 1 == corners.size() && corners.size() < 3) break;
    for (int k = 0; k < 3; ++k)
      if (squaredDistance(corners[i], corners[(i + 1) % corners.size()], t[k], t[(k + 1) % 3]) < margin * margin)
        return true;
  }
  return false;
}

/// Two triangles come that near each other elsewhere than around the corners they share, which come first.
bool areNear(const Triangle& one, const Triangle& other, int shared, double margin) {
  const auto beyond = [&](const Triangle& t) { return std::span(t).subspan(static_cast<std::size_t>(shared)); };
  return isNear(one, beyond(other), margin) || isNear(other, beyond(one), margin);
}

/// All pairs of triangles whose boxes overlap, or nearly: by boxes of four, sixteen, … neighbours in the hierarchy's
/// order.
class Finder {
 public:
  /// `margin`, of coordinates of order 1: triangles meet that come as near; 0 for those that do, without rounding.
  Finder(const Hierarchy& hierarchy, double margin)
      : hierarchy_(hierarchy), margin_(margin), vertices_(hierarchy.vertices().size()) {
    const double scale = scaleToOne(hierarchy.vertices());
    for (std::size_t v = 0; v < vertices_.size(); ++v) vertices_[v] = scale * hierarchy.vertices()[v];
    unit_ = 1 / scale;
    makeBoxes();
  }

  /// Those of triangles of the slots [begin, end) with those of later ones, by the former's slots; nothing if there are
  /// so many or more.
  std::optional<std::vector<Crossing>> findFewer(std::uint32_t begin, std::uint32_t end, std::size_t most,
                                                 const Progress& progress) const {
    std::vector<std::vector<Crossing>> ofSlot(end - begin);
    std::atomic<std::size_t> count = 0;
    tbb::parallel_for(begin, end, [&](std::uint32_t slot) {
      progress.pause();
      find(slot, [&](const Crossing& crossing) {
        ofSlot[slot - begin].push_back(crossing);
        return ++count < most;
      });
    });
    if (count >= most) return std::nullopt;
    std::vector<Crossing> found;
    for (const auto& crossings : ofSlot) found.insert(found.end(), crossings.begin(), crossings.end());
    return found;
  }

  /// The first ones of a slot's.
  std::vector<Crossing> findFirst(std::uint32_t slot, std::size_t most) const {
    std::vector<Crossing> found;
    find(slot, [&](const Crossing& crossing) {
      found.push_back(crossing);
      return found.size() < most;
    });
    return found;
  }

 private:
  /// With triangles of later slots, as long as `take` wants more.
  template <typename Take>
  void find(std::uint32_t slot, const Take& take) const {
    if (spansPlane(corners(slot))) visit(static_cast<int>(levels_.size()) - 1, 0, slot, take);
  }

  static constexpr std::uint32_t kWide = 4;

  Triangle cornersOf(const Corners& t) const { return {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]}; }
  Triangle corners(std::uint32_t slot) const { return cornersOf(hierarchy_.triangles()[slot]); }

  void makeBoxes() {
    const auto count = static_cast<std::uint32_t>(hierarchy_.triangles().size());
    levels_.emplace_back(count);
    tbb::parallel_for(std::uint32_t{0}, count, [&](std::uint32_t slot) {
      Box& box = levels_[0][slot];
      for (const Vector3& corner : corners(slot)) box.extend(corner);
      box = Box(box.min().array() - margin_, box.max().array() + margin_);
    });
    while (levels_.back().size() > 1) {
      const std::vector<Box>& below = levels_.back();
      std::vector<Box> boxes((below.size() + kWide - 1) / kWide);
      for (std::size_t i = 0; i < below.size(); ++i) boxes[i / kWide].extend(below[i]);
      levels_.push_back(std::move(boxes));
    }
  }

  template <typename Take>
  bool visit(int level, std::uint32_t box, std::uint32_t slot, const Take& take) const {
    const Box& mine = levels_[0][slot];
    if (!levels_[level][box].intersects(mine)) return true;
    if (level == 0) return box == slot || !meets(slot, box) || take(crossing(slot, box));
    const auto end =
        static_cast<std::uint32_t>(std::min<std::size_t>((std::size_t{box} + 1) * kWide, levels_[level - 1].size()));
    for (std::uint32_t child = box * kWide; child < end; ++child)
      if ((std::uint64_t{child} + 1) << (2 * (level - 1)) > slot + std::uint64_t{1} &&  // its last slot comes after
          !visit(level - 1, child, slot, take))
        return false;
    return true;
  }

  bool meets(std::uint32_t slot, std::uint32_t other) const {
    Corners mine = hierarchy_.triangles()[slot], its = hierarchy_.triangles()[other];
    const int shared = shareInFront(mine, its);
    const Triangle first = cornersOf(mine), second = cornersOf(its);
    if (!spansPlane(second)) return false;
    return meet(first, second, shared) || (margin_ > 0 && areNear(first, second, shared, margin_));
  }

  static bool meet(const Triangle& first, const Triangle& second, int shared) {
    if (shared == 0) return distance::meet(first, second);
    if (shared == 1) return meetBeyondCorner(first, second);
    return shared == 3 || meetBeyondSide(first, second);
  }

  Crossing crossing(std::uint32_t slot, std::uint32_t other) const {
    const auto [first, second] = std::minmax(hierarchy_.frames()[slot].triangle, hierarchy_.frames()[other].triangle);
    return {{first, second}, unit_ * levels_[0][slot].intersection(levels_[0][other]).center()};
  }

  const Hierarchy& hierarchy_;
  double margin_;
  std::vector<Vector3> vertices_;         ///< of order 1
  double unit_;                           ///< of these
  std::vector<std::vector<Box>> levels_;  ///< the triangles' own first
};

}  // namespace

bool meet(const Triangle& one, const Triangle& other) {
  if (isAside(one, other) || isAside(other, one)) return false;
  for (int k = 0; k < 3; ++k)
    if (meet(one[k], one[(k + 1) % 3], other) || meet(other[k], other[(k + 1) % 3], one)) return true;
  return false;
}

bool sidesCut(const Triangle& one, const Triangle& other, const std::array<bool, 3>& counts) {
  Eigen::Index steepest = 0;
  (other[1] - other[0]).cross(other[2] - other[0]).cwiseAbs().maxCoeff(&steepest);
  const Axes axes = {int(steepest + 1) % 3, int(steepest + 2) % 3};
  for (int k = 0; k < 3; ++k) {
    if (!counts[k]) continue;
    const Vector3 &from = other[k], &to = other[(k + 1) % 3];
    if (contains(one, from, axes)) return true;
    for (int i = 0; i < 3; ++i)
      if (segmentsMeet(from, to, one[i], one[(i + 1) % 3], axes)) return true;
  }
  return false;
}

bool lieInOnePlane(const Triangle& one, const Triangle& other) {
  constexpr double kRounding = 1e-12;
  const Vector3 normal = (one[1] - one[0]).cross(one[2] - one[0]).stableNormalized();
  return std::ranges::all_of(other, [&](const Vector3& x) { return std::abs(normal.dot(x - one[0])) < kRounding; });
}

double scaleToOne(std::span<const Vector3> vertices) {
  double greatest = 0;
  for (const Vector3& x : vertices) greatest = std::max(greatest, x.cwiseAbs().maxCoeff());
  return greatest > 0 ? std::ldexp(1.0, -std::ilogb(greatest)) : 1;
}

Crossings findCrossings(const Hierarchy& hierarchy, std::size_t limit, double margin, const Progress& progress) {
  const Finder finder(hierarchy, margin);
  const auto count = static_cast<std::uint32_t>(hierarchy.triangles().size());
  Crossings crossings;
  const auto add = [&](const std::vector<Crossing>& found) {
    crossings.found.insert(crossings.found.end(), found.begin(), found.end());
  };
  // In parts that grow, to a fiftieth of all. One with too many is given up as soon as that shows, and halved until it
  // is clear at which slot the limit is reached: a heap of triangles that all meet is neither searched to its end nor
  // kept.
  constexpr std::uint32_t kLeast = 64;
  const std::uint32_t largest = std::max(kLeast, count / 50);
  std::uint32_t size = kLeast;
  bool halving = false;
  for (std::uint32_t begin = 0; begin < count && crossings.all;) {
    progress.at("looking where faces meet", double(begin) / count);
    const std::uint32_t end = begin + std::min(count - begin, size);
    const std::size_t left = limit - crossings.found.size();
    if (const auto found = finder.findFewer(begin, end, left + 1, progress)) {
      add(*found);
      begin = end;
      size = halving ? (size + 1) / 2 : std::min(2 * size, largest);
    } else if (end - begin > 1) {
      halving = true;
      size = (end - begin + 1) / 2;
    } else {
      if (left > 0) add(finder.findFirst(begin, left));
      crossings.all = false;
    }
  }
  std::ranges::sort(crossings.found, {}, &Crossing::triangles);
  return crossings;
}

}  // namespace distance

Crossings findCrossings(const TriangleMesh& mesh, std::size_t limit, const Progress& progress) {
  distance::requireSurface(mesh);
  const distance::Hierarchy hierarchy(mesh, boundingBox(mesh));
  return distance::findCrossings(hierarchy, limit, 0, progress);
}

}  // namespace hpsdf
