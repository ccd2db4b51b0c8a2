#include "surface/crossings.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "bvh/triangle_frame.h"
#include "hpsdf/detail/crossings.h"
#include "surface/exact_orientation.h"
#include "util/morton_order.h"

namespace hpsdf {
namespace surface {
namespace {

using Indices = std::array<std::uint32_t, 3>;
using Axes = std::array<int, 2>;

bool inBox(const Vector3& x, const Vector3& a, const Vector3& b, const Axes& axes) {
  return std::ranges::all_of(axes, [&](int k) { return std::min(a[k], b[k]) <= x[k] && x[k] <= std::max(a[k], b[k]); });
}

/// Returns two coordinate axes for projecting the triangle: its projection to their plane has an area above 0. Returns
/// the same axis twice if the triangle is degenerate.
Axes projectionAxes(const Corners& t) {
  for (const Axes axes : {Axes{0, 1}, Axes{1, 2}, Axes{2, 0}})
    if (orientation(axes, t[0], t[1], t[2]) != 0) return axes;
  return {0, 0};
}

bool isDegenerate(const Corners& t) {
  const Axes axes = projectionAxes(t);
  return axes[0] == axes[1];
}

bool contains(const Corners& t, const Vector3& x, const Axes& axes) {
  const int turn = orientation(axes, t[0], t[1], t[2]);
  for (int k = 0; k < 3; ++k)
    if (orientation(axes, t[k], t[(k + 1) % 3], x) * turn < 0) return false;
  return true;
}

bool segmentsIntersect(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d, const Axes& axes) {
  const int atC = orientation(axes, a, b, c), atD = orientation(axes, a, b, d);
  const int atA = orientation(axes, c, d, a), atB = orientation(axes, c, d, b);
  if (atC * atD < 0 && atA * atB < 0) return true;
  return (atC == 0 && inBox(c, a, b, axes)) || (atD == 0 && inBox(d, a, b, axes)) ||
         (atA == 0 && inBox(a, c, d, axes)) || (atB == 0 && inBox(b, c, d, axes));
}

/// Returns true if a segment and a triangle have a point in common, including end points and boundary. The triangle
/// must not be degenerate.
bool segmentIntersects(const Vector3& from, const Vector3& to, const Corners& t) {
  const int start = orientation(t[0], t[1], t[2], from), end = orientation(t[0], t[1], t[2], to);
  if (start * end > 0) return false;
  if (start == 0 && end == 0) {
    const Axes axes = projectionAxes(t);
    if (contains(t, from, axes) || contains(t, to, axes)) return true;
    for (int k = 0; k < 3; ++k)
      if (segmentsIntersect(from, to, t[k], t[(k + 1) % 3], axes)) return true;
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

/// Returns true if all points lie strictly on one side of the triangle's plane.
bool lieOnOneSide(const Corners& t, std::span<const Vector3> points) {
  int sum = 0;
  for (const Vector3& point : points) sum += orientation(t[0], t[1], t[2], point);
  return static_cast<std::size_t>(std::abs(sum)) == points.size();
}

/// Returns true if two triangles that share their first corner have another point in common. It suffices to test
/// the edges opposite to the shared corner: the ray from this corner through a common point leaves one of the
/// triangles through its opposite edge, at a point of the other triangle.
bool intersectBeyondCorner(const Corners& one, const Corners& other) {
  if (lieOnOneSide(one, {other.begin() + 1, 2}) || lieOnOneSide(other, {one.begin() + 1, 2})) return false;
  return segmentIntersects(one[1], one[2], other) || segmentIntersects(other[1], other[2], one);
}

/// Returns true if two triangles that share their first two corners have a common point that is not on the
/// shared edge. This is the case only if the triangles are folded flat onto each other.
bool intersectBeyondEdge(const Corners& one, const Corners& other) {
  if (orientation(one[0], one[1], one[2], other[2]) != 0) return false;
  const Axes axes = projectionAxes(one);
  return orientation(axes, one[0], one[1], one[2]) == orientation(axes, one[0], one[1], other[2]);
}

/// Moves the corners that the two triangles share to the front of both index lists. Returns the number of
/// shared corners.
int moveSharedToFront(Indices& one, Indices& other) {
  int shared = 0;
  for (int i = 0; i < 3; ++i) {
    const auto same = std::find(other.begin() + shared, other.end(), one[i]);
    if (same == other.end()) continue;
    std::swap(one[i], one[shared]);
    std::iter_swap(same, other.begin() + shared++);
  }
  return shared;
}

// The distance tests below need not be exact, because they only detect triangles that are too close together for
// an inside test by pseudonormals.

/// Returns the squared distance between the segments ab and cd.
double squaredDistance(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  const auto toSegment = [](const Vector3& x, const Vector3& from, const Vector3& to) {
    return (from + bvh::closestParameter(x, from, to) * (to - from) - x).squaredNorm();
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

/// A triangle with the normal that filters of pairs use.
struct Facet {
  explicit Facet(const Corners& t)
      : corners(t),
        normal((t[1] - t[0]).cross(t[2] - t[0])),
        squaredSides((t[1] - t[0]).squaredNorm() * (t[2] - t[0]).squaredNorm()) {}

  Corners corners;
  Vector3 normal;       ///< not of unit length: twice the area
  double squaredSides;  ///< product of the squared lengths of the sides at the first corner
};

/// Returns true only if all points certainly lie on one side of the triangle's plane, farther from it than the margin.
bool lieFarOnOneSide(const Facet& t, std::span<const Vector3> points, double margin) {
  // A bound of the rounding errors of the heights below, relative to the lengths of two sides, for coordinates of
  // magnitudes of about 1.
  constexpr double kRounding = 2e-14;
  const double least = margin * t.normal.norm() + kRounding * std::sqrt(t.squaredSides);
  int above = 0, below = 0;
  for (const Vector3& point : points) {
    const double height = t.normal.dot(point - t.corners[0]);
    above += height > least;
    below += height < -least;
  }
  return std::max(above, below) == static_cast<int>(points.size());
}

/// Returns true if the distance between `corners` and the triangle t is less than `margin`. One corner stands for
/// a point, two for a segment, three for the boundary of a triangle.
bool isNear(const Corners& t, std::span<const Vector3> corners, double margin) {
  if (lieFarOnOneSide(Facet(t), corners, margin)) return false;
  const bvh::TriangleFrame frame = bvh::makeFrame(t, 0);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (bvh::squaredDistance(frame, corners[i]) < margin * margin) return true;
    if (i + 1 == corners.size() && corners.size() < 3) break;
    for (int k = 0; k < 3; ++k)
      if (squaredDistance(corners[i], corners[(i + 1) % corners.size()], t[k], t[(k + 1) % 3]) < margin * margin)
        return true;
  }
  return false;
}

/// Returns the corners that come after those that a triangle shares with another one.
std::span<const Vector3> unsharedOf(const Corners& t, int shared) {
  return std::span(t).subspan(static_cast<std::size_t>(shared));
}

/// Returns true if one of two triangles comes nearer than `margin` to the unshared corners of the other one, or to the
/// edges between these corners. The triangles have `shared` common corners, which come first in both.
bool areNear(const Corners& one, const Corners& other, int shared, double margin) {
  return isNear(one, unsharedOf(other, shared), margin) || isNear(other, unsharedOf(one, shared), margin);
}

/// Returns true only if a line along an edge of the triangle t, in its plane, certainly has all points on its outer
/// side, farther from t than the margin. Only edges between the first `shared` corners count, or edges at the first
/// corner if that alone is shared.
bool lieFarBeyondEdge(const Facet& facet, std::span<const Vector3> points, int shared, double margin) {
  // A bound of the rounding errors of the products below, for unit axes and coordinates of magnitudes of about 1. It is
  // so large that it also covers the rounding of an axis that should be perpendicular to an edge at a shared corner.
  constexpr double kRounding = 1e-11;
  const Corners& t = facet.corners;
  const auto isBeyond = [&](std::size_t k) {
    const Vector3 outward = (t[(k + 1) % 3] - t[k]).cross(facet.normal);
    const auto height = [&](const Vector3& x) { return outward.dot(x - t[k]); };
    const double inner = std::max({height(t[0]), height(t[1]), height(t[2])});
    const double least = inner + (margin + kRounding) * outward.norm();
    return std::ranges::all_of(points, [&](const Vector3& x) { return height(x) > least; });
  };
  return isBeyond(0) || (shared < 2 && isBeyond(2)) || (shared < 1 && isBeyond(1));
}

/// Returns true if the sine of the angle at the triangle's first corner is below 1/1000.
bool isThinAtFirstCorner(const Facet& t) { return !(t.normal.squaredNorm() > 1e-6 * t.squaredSides); }

/// Returns true only if two triangles certainly have no points in common but their first `shared` corners, at most two,
/// and the edge between these, and if either is farther than `margin` from the unshared corners of the other one, and
/// from the edges between them. Planes along a triangle, or normal to it along an edge, show that for nearly all pairs
/// of triangles whose boxes overlap. The exact tests take longer, and longest for points in one plane.
bool areCertainlyApart(const Corners& one, const Corners& other, int shared, double margin) {
  const auto isApart = [&](const Facet& t, std::span<const Vector3> points) {
    return lieFarOnOneSide(t, points, margin) ||
           ((shared == 0 || !isThinAtFirstCorner(t)) && lieFarBeyondEdge(t, points, shared, margin));
  };
  if (shared == 0) return isApart(Facet(one), other) || isApart(Facet(other), one);
  return isApart(Facet(one), unsharedOf(other, shared)) && isApart(Facet(other), unsharedOf(one, shared));
}

/// Triangles in an order in which successive ones are near each other.
struct OrderedTriangles {
  std::span<const Vector3> vertices;
  std::span<const Triangle> triangles;  ///< a position in this list is called a slot
  std::vector<std::uint32_t> numbers;   ///< by slot: the triangle's index in the mesh
};

OrderedTriangles inOrderOf(const bvh::Hierarchy& hierarchy) {
  OrderedTriangles ordered{hierarchy.vertices(), hierarchy.triangles(), {}};
  ordered.numbers.assign(hierarchy.numbers().begin(), hierarchy.numbers().end());
  return ordered;
}

/// Finds pairs of intersecting triangles by a tree of axis-aligned bounding boxes. Each box contains up to four
/// boxes of the next lower level; the lowest boxes bound the triangles in their order.
class Finder {
 public:
  /// `margin` is the distance below which triangles count as intersecting, as in `findCrossings`.
  Finder(const OrderedTriangles& ordered, double margin)
      : ordered_(ordered), margin_(margin), vertices_(ordered.vertices.size()) {
    const double scale = scaleToOne(ordered.vertices);
    for (std::size_t v = 0; v < vertices_.size(); ++v) vertices_[v] = scale * ordered.vertices[v];
    unit_ = 1 / scale;
    makeBoxes();
  }

  /// Returns the crossings of the triangles at the slots [begin, end) with
  /// triangles at later slots, sorted by the earlier slot. Returns std::nullopt if there are `most`
  /// crossings or more.
  std::optional<std::vector<Crossing>> findFewer(std::uint32_t begin, std::uint32_t end, std::size_t most,
                                                 const Progress& progress) const {
    std::vector<std::vector<Crossing>> ofSlot(end - begin);
    std::atomic<std::size_t> count = 0;
    tbb::parallel_for(std::uint32_t{0}, (end - begin + kGroup - 1) / kGroup, [&](std::uint32_t group) {
      progress.throwIfCancelled();
      const std::uint32_t first = begin + group * kGroup;
      find(first, std::min(first + kGroup, end), [&](std::uint32_t slot, const Crossing& crossing) {
        ofSlot[slot - begin].push_back(crossing);
        return ++count < most;
      });
    });
    if (count >= most) return std::nullopt;
    std::vector<Crossing> found;
    for (const auto& crossings : ofSlot) found.insert(found.end(), crossings.begin(), crossings.end());
    return found;
  }

  /// Returns the first `most` crossings of the triangle at a slot with triangles at later slots.
  std::vector<Crossing> findFirst(std::uint32_t slot, std::size_t most) const {
    std::vector<Crossing> found;
    find(slot, slot + 1, [&](std::uint32_t, const Crossing& crossing) {
      found.push_back(crossing);
      return found.size() < most;
    });
    return found;
  }

 private:
  static constexpr std::uint32_t kWidth = 4;   ///< number of boxes that one box of the next higher level contains
  static constexpr std::uint32_t kGroup = 16;  ///< number of triangles that search the tree together

  /// Calls take(slot, crossing) for each crossing of a triangle at a slot in [begin, end) with a triangle at a later
  /// slot, until `take` returns false.
  template <typename Take>
  void find(std::uint32_t begin, std::uint32_t end, const Take& take) const {
    Box box;
    for (std::uint32_t slot = begin; slot < end; ++slot) box.extend(levels_[0][slot]);
    std::vector<std::uint32_t> others;
    collect(static_cast<int>(levels_.size()) - 1, 0, begin, box, others);
    for (std::uint32_t slot = begin; slot < end; ++slot) {
      if (isDegenerate(corners(slot))) continue;
      for (const std::uint32_t other : others)
        if (other > slot && levels_[0][other].intersects(levels_[0][slot]) && isCrossing(slot, other) &&
            !take(slot, crossing(slot, other)))
          return;
    }
  }

  Corners cornersOf(const Indices& t) const { return {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]}; }
  Corners corners(std::uint32_t slot) const { return cornersOf(ordered_.triangles[slot]); }

  void makeBoxes() {
    const auto count = static_cast<std::uint32_t>(ordered_.triangles.size());
    levels_.emplace_back(count);
    tbb::parallel_for(std::uint32_t{0}, count, [&](std::uint32_t slot) {
      Box& box = levels_[0][slot];
      for (const Vector3& corner : corners(slot)) box.extend(corner);
      box = Box(box.min().array() - margin_, box.max().array() + margin_);
    });
    while (levels_.back().size() > 1) {
      const std::vector<Box>& below = levels_.back();
      std::vector<Box> boxes((below.size() + kWidth - 1) / kWidth);
      for (std::size_t i = 0; i < below.size(); ++i) boxes[i / kWidth].extend(below[i]);
      levels_.push_back(std::move(boxes));
    }
  }

  /// Appends to `found` the slots after `slot` of the triangles in a box of the tree whose boxes intersect `query`,
  /// in ascending order.
  void collect(int level, std::uint32_t box, std::uint32_t slot, const Box& query,
               std::vector<std::uint32_t>& found) const {
    if (!levels_[level][box].intersects(query)) return;
    if (level == 0) {
      if (box > slot) found.push_back(box);
      return;
    }
    const auto end =
        static_cast<std::uint32_t>(std::min<std::size_t>((std::size_t{box} + 1) * kWidth, levels_[level - 1].size()));
    for (std::uint32_t child = box * kWidth; child < end; ++child) {
      const bool endsAfterSlot = (std::uint64_t{child} + 1) << (2 * (level - 1)) > slot + std::uint64_t{1};
      if (endsAfterSlot) collect(level - 1, child, slot, query, found);
    }
  }

  bool isCrossing(std::uint32_t slot, std::uint32_t otherSlot) const {
    Indices one = ordered_.triangles[slot], other = ordered_.triangles[otherSlot];
    const int shared = moveSharedToFront(one, other);
    if (shared == 3) return true;
    const Corners first = cornersOf(one), second = cornersOf(other);
    if (areCertainlyApart(first, second, shared, margin_) || isDegenerate(second)) return false;
    return intersectBeyondShared(first, second, shared) || (margin_ > 0 && areNear(first, second, shared, margin_));
  }

  /// Returns true if two triangles with at most two shared corners, which come first, have any other point in common.
  static bool intersectBeyondShared(const Corners& first, const Corners& second, int shared) {
    if (shared == 0) return intersect(first, second);
    if (shared == 1) return intersectBeyondCorner(first, second);
    return intersectBeyondEdge(first, second);
  }

  Crossing crossing(std::uint32_t slot, std::uint32_t other) const {
    const auto [first, second] = std::minmax(ordered_.numbers[slot], ordered_.numbers[other]);
    return {{first, second}, unit_ * levels_[0][slot].intersection(levels_[0][other]).center()};
  }

  const OrderedTriangles& ordered_;
  double margin_;
  std::vector<Vector3> vertices_;         ///< the vertices, scaled to magnitudes of about 1
  double unit_;                           ///< factor that converts `vertices_` to mesh units
  std::vector<std::vector<Box>> levels_;  ///< level n holds the boxes of 4^n consecutive triangles each
};

}  // namespace

bool intersect(const Corners& one, const Corners& other) {
  if (lieOnOneSide(one, other) || lieOnOneSide(other, one)) return false;
  for (int k = 0; k < 3; ++k)
    if (segmentIntersects(one[k], one[(k + 1) % 3], other) || segmentIntersects(other[k], other[(k + 1) % 3], one))
      return true;
  return false;
}

bool edgesIntersect(const Corners& one, const Corners& other, const std::array<bool, 3>& counts) {
  Eigen::Index steepest = 0;
  (other[1] - other[0]).cross(other[2] - other[0]).cwiseAbs().maxCoeff(&steepest);
  const Axes axes = {int(steepest + 1) % 3, int(steepest + 2) % 3};
  for (int k = 0; k < 3; ++k) {
    if (!counts[k]) continue;
    const Vector3 &from = other[k], &to = other[(k + 1) % 3];
    if (contains(one, from, axes)) return true;
    for (int i = 0; i < 3; ++i)
      if (segmentsIntersect(from, to, one[i], one[(i + 1) % 3], axes)) return true;
  }
  return false;
}

bool areCoplanar(const Corners& one, const Corners& other) {
  constexpr double kRounding = 1e-12;
  const Vector3 normal = (one[1] - one[0]).cross(one[2] - one[0]).stableNormalized();
  return std::ranges::all_of(other, [&](const Vector3& x) { return std::abs(normal.dot(x - one[0])) < kRounding; });
}

double scaleToOne(std::span<const Vector3> vertices) {
  double greatest = 0;
  for (const Vector3& x : vertices) greatest = std::max(greatest, x.cwiseAbs().maxCoeff());
  return greatest > 0 ? std::ldexp(1.0, -std::ilogb(greatest)) : 1;
}

namespace {

/// Finds at most `limit` crossings of the triangles at the first `count` slots with those at later ones.
Crossings findOrdered(const OrderedTriangles& ordered, std::uint32_t count, std::size_t limit, double margin,
                      const Progress& progress) {
  const Finder finder(ordered, margin);
  Crossings crossings;
  const auto add = [&](const std::vector<Crossing>& found) {
    crossings.found.insert(crossings.found.end(), found.begin(), found.end());
  };
  // Search the triangles range by range. The ranges grow, up to a fiftieth of all triangles. If the crossings of a
  // range would exceed `limit`, stop early and halve the range. Repeat this until the range is the single triangle at
  // which the limit is reached. Thus most pairs are never tested or stored, even if all triangles intersect each other.
  constexpr std::uint32_t kLeast = 64;
  const std::uint32_t largest = std::max(kLeast, count / 50);
  std::uint32_t size = kLeast;
  bool halving = false;
  for (std::uint32_t begin = 0; begin < count && crossings.complete;) {
    progress.update("finding self-intersections", double(begin) / count);
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
      crossings.complete = false;
    }
  }
  std::ranges::sort(crossings.found, {}, &Crossing::triangles);
  return crossings;
}

/// Returns the numbers of triangles in the order of their middles along a Morton curve.
std::vector<std::uint32_t> inMortonOrder(const TriangleMesh& mesh, std::span<const std::uint32_t> numbers) {
  std::vector<Vector3> middles;
  Box box;
  for (const std::uint32_t number : numbers) {
    const auto [a, b, c] = hpsdf::cornersOf(mesh, mesh.triangles[number]);
    middles.push_back(a / 3 + b / 3 + c / 3);
    box.extend(middles.back());
  }
  std::vector<std::uint32_t> ordered;
  for (const std::uint32_t i : detail::mortonOrder(middles, box)) ordered.push_back(numbers[i]);
  return ordered;
}

}  // namespace

Crossings findCrossings(const bvh::Hierarchy& hierarchy, std::size_t limit, double margin, const Progress& progress) {
  const OrderedTriangles ordered = inOrderOf(hierarchy);
  return findOrdered(ordered, static_cast<std::uint32_t>(ordered.triangles.size()), limit, margin, progress);
}

Crossings findCrossingsOf(const TriangleMesh& mesh, const std::vector<bool>& chosen, std::size_t limit,
                          const Progress& progress) {
  bvh::requireSurface(mesh);
  std::array<std::vector<std::uint32_t>, 2> numbers;  // those chosen, and the others
  for (std::uint32_t n = 0; n < mesh.triangles.size(); ++n) numbers[chosen[n] ? 0 : 1].push_back(n);
  const auto count = static_cast<std::uint32_t>(numbers[0].size());
  // Vertices that no triangle uses may be far away and must not decide how coordinates are scaled.
  std::vector<Vector3> vertices(mesh.vertices.size(), Vector3::Zero());
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t v : triangle) vertices[v] = mesh.vertices[v];
  OrderedTriangles ordered{vertices, {}, {}};
  for (const std::vector<std::uint32_t>& part : numbers) {
    const std::vector<std::uint32_t> inOrder = inMortonOrder(mesh, part);
    ordered.numbers.insert(ordered.numbers.end(), inOrder.begin(), inOrder.end());
  }
  std::vector<Triangle> triangles;
  for (const std::uint32_t number : ordered.numbers) triangles.push_back(mesh.triangles[number]);
  ordered.triangles = triangles;
  return findOrdered(ordered, count, limit, 0, progress);
}

}  // namespace surface

Crossings findCrossings(const TriangleMesh& mesh, std::size_t limit, const Progress& progress) {
  return surface::findCrossingsOf(mesh, std::vector<bool>(mesh.triangles.size(), true), limit, progress);
}

}  // namespace hpsdf
