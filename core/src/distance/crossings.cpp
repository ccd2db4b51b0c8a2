#include "distance/crossings.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "mesh/orientation.h"

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

bool hasArea(const Triangle& t) {
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

bool strangersMeet(const Triangle& one, const Triangle& other) {
  if (isAside(one, other) || isAside(other, one)) return false;
  for (int k = 0; k < 3; ++k)
    if (meet(one[k], one[(k + 1) % 3], other) || meet(other[k], other[(k + 1) % 3], one)) return true;
  return false;
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

/// All pairs of triangles whose boxes overlap: by boxes of four, sixteen, … neighbours in the hierarchy's order.
class Finder {
 public:
  explicit Finder(const Hierarchy& hierarchy) : hierarchy_(hierarchy), vertices_(hierarchy.vertices().size()) {
    double greatest = 0;
    for (const Vector3& x : hierarchy.vertices()) greatest = std::max(greatest, x.cwiseAbs().maxCoeff());
    // a power of two rounds nothing
    const double scale = greatest > 0 ? std::ldexp(1.0, -std::ilogb(greatest)) : 1;
    for (std::size_t v = 0; v < vertices_.size(); ++v) vertices_[v] = scale * hierarchy.vertices()[v];
    unit_ = 1 / scale;
    makeBoxes();
  }

  /// With triangles of later slots.
  void find(std::uint32_t slot, std::vector<Crossing>& found) const {
    const Triangle triangle = corners(slot);
    if (hasArea(triangle)) visit(static_cast<int>(levels_.size()) - 1, 0, slot, triangle, found);
  }

 private:
  static constexpr std::uint32_t kWide = 4;

  Triangle cornersOf(const Corners& t) const { return {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]}; }
  Triangle corners(std::uint32_t slot) const { return cornersOf(hierarchy_.triangles()[slot]); }

  void makeBoxes() {
    const auto count = static_cast<std::uint32_t>(hierarchy_.triangles().size());
    levels_.emplace_back(count);
    tbb::parallel_for(std::uint32_t{0}, count, [&](std::uint32_t slot) {
      for (const Vector3& corner : corners(slot)) levels_[0][slot].extend(corner);
    });
    while (levels_.back().size() > 1) {
      const std::vector<Box>& below = levels_.back();
      std::vector<Box> boxes((below.size() + kWide - 1) / kWide);
      for (std::size_t i = 0; i < below.size(); ++i) boxes[i / kWide].extend(below[i]);
      levels_.push_back(std::move(boxes));
    }
  }

  void visit(int level, std::uint32_t box, std::uint32_t slot, const Triangle& triangle,
             std::vector<Crossing>& found) const {
    const Box& mine = levels_[0][slot];
    if (!levels_[level][box].intersects(mine)) return;
    if (level == 0) {
      if (box != slot && meets(slot, box, triangle)) found.push_back(crossing(slot, box));
      return;
    }
    const auto end =
        static_cast<std::uint32_t>(std::min<std::size_t>((std::size_t{box} + 1) * kWide, levels_[level - 1].size()));
    for (std::uint32_t child = box * kWide; child < end; ++child)
      if ((std::uint64_t{child} + 1) << (2 * (level - 1)) > slot + std::uint64_t{1})  // its last slot comes after
        visit(level - 1, child, slot, triangle, found);
  }

  bool meets(std::uint32_t slot, std::uint32_t other, const Triangle& triangle) const {
    Corners mine = hierarchy_.triangles()[slot], its = hierarchy_.triangles()[other];
    const int shared = shareInFront(mine, its);
    const Triangle second = cornersOf(its);
    if (!hasArea(second)) return false;
    if (shared == 0) return strangersMeet(triangle, second);
    const Triangle first = cornersOf(mine);
    if (shared == 1) return meetBeyondCorner(first, second);
    return shared == 3 || meetBeyondSide(first, second);
  }

  Crossing crossing(std::uint32_t slot, std::uint32_t other) const {
    const auto [first, second] = std::minmax(hierarchy_.frames()[slot].triangle, hierarchy_.frames()[other].triangle);
    return {{first, second}, unit_ * levels_[0][slot].intersection(levels_[0][other]).center()};
  }

  const Hierarchy& hierarchy_;
  std::vector<Vector3> vertices_;         ///< of order 1
  double unit_;                           ///< of these
  std::vector<std::vector<Box>> levels_;  ///< the triangles' own first
};

}  // namespace

Crossings findCrossings(const Hierarchy& hierarchy, std::size_t limit) {
  const Finder finder(hierarchy);
  const auto count = static_cast<std::uint32_t>(hierarchy.triangles().size());
  Crossings crossings;
  std::vector<std::vector<Crossing>> ofSlot;
  // In parts that grow, so that a heap of triangles that all meet is not searched to its end.
  for (std::uint32_t begin = 0, end = 0; begin < count && crossings.all; begin = end) {
    end = begin + std::min(count - begin, 64 + begin);
    ofSlot.assign(end - begin, {});
    tbb::parallel_for(begin, end, [&](std::uint32_t slot) { finder.find(slot, ofSlot[slot - begin]); });
    for (const auto& found : ofSlot) crossings.found.insert(crossings.found.end(), found.begin(), found.end());
    crossings.all = end == count || crossings.found.size() < limit;
  }
  std::ranges::sort(crossings.found, {}, &Crossing::triangles);
  return crossings;
}

}  // namespace distance

Crossings findCrossings(const TriangleMesh& mesh, std::size_t limit) {
  distance::requireSurface(mesh);
  const distance::Hierarchy hierarchy(mesh, boundingBox(mesh));
  return distance::findCrossings(hierarchy, limit);
}

}  // namespace hpsdf
