#include "hpsdf/detail/exact_sign.h"

#include <array>
#include <cmath>
#include <variant>

#include "hpsdf/detail/triangle_list.h"

namespace hpsdf {
namespace {

/// A segment from the origin.
struct Segment {
  Vector3 end;

  /// The volume that the segment spans with a side of a triangle.
  struct Volume {
    double size;  ///< six times the volume
    bool isLeft;  ///< the side runs counter-clockwise around the segment, as seen from the segment's end
  };

  /// A segment that meets the side counts as one whose end is moved a little along x or, if that changes nothing, along
  /// y or z. As this is the same for all sides, a segment through a vertex crosses a closed surface once.
  Volume volumeWith(const Vector3& from, const Vector3& to) const {
    const Vector3 normal = from.cross(to);
    const double volume = end.dot(normal);
    for (const double side : {volume, normal.x(), normal.y(), normal.z()})
      if (side != 0) return {std::abs(volume), side > 0};
    return {0, false};
  }
};

/// A triangle relative to the start of a segment, with the indices of its corners.
struct Corners {
  std::array<std::uint32_t, 3> index;
  std::array<Vector3, 3> at;
};

/// Returns 1 if a segment passes through a triangle from its outer to its inner side, −1 if it passes the other way,
/// and 0 if it does not pass through.
int crossingOf(const Segment& segment, const Corners& corners) {
  std::array<double, 3> weight;  // of the corners, by the volume with the opposite side
  int left = 0;                  // number of sides that run counter-clockwise
  for (int k = 0; k < 3; ++k) {
    const int from = (k + 1) % 3, to = (k + 2) % 3;
    // Both triangles at an edge compute its volume from the lower to the higher index.
    const bool isForward = corners.index[from] < corners.index[to];
    const Segment::Volume volume = isForward ? segment.volumeWith(corners.at[from], corners.at[to])
                                             : segment.volumeWith(corners.at[to], corners.at[from]);
    left += static_cast<int>(volume.isLeft == isForward);
    weight[k] = volume.size;
  }
  if (left != 0 && left != 3) return 0;
  // The crossing is at the mean of the corners with these weights. It lies between the segment's ends if its projection
  // does.
  double along = 0, sum = 0;
  for (int k = 0; k < 3; ++k) {
    along += weight[k] * corners.at[k].dot(segment.end);
    sum += weight[k];
  }
  const bool isBetween = along > 0 && along < sum * segment.end.squaredNorm();
  return !isBetween ? 0 : left == 0 ? 1 : -1;
}

}  // namespace

std::int32_t windingAt(const ExactTriangles& exact, std::uint64_t leaf, const Vector3& x) {
  const WindingReference reference = TriangleListView(exact, leaf).reference();
  const Vector3 origin = reference.point.cast<double>();
  const Segment segment{x - origin};
  std::int32_t winding = reference.winding;
  std::visit(
      [&](const auto& vertices) {
        forEachTriangle(exact, leaf, [&](std::uint32_t triangle) {
          const auto& index = exact.triangles[triangle];
          Corners corners{index, {}};
          for (int k = 0; k < 3; ++k) corners.at[k] = vertices[index[k]].template cast<double>() - origin;
          winding += crossingOf(segment, corners);
        });
      },
      exact.vertices);
  return winding;
}

int slopeByWinding(const ExactTriangles& exact, std::uint64_t leaf, const Vector3& x, const Vector3& normal,
                   double height) {
  constexpr double kTouching = 1e-9;  // much more than the rounding errors of positions
  const auto isInside = [&](const Vector3& point) { return windingAt(exact, leaf, point) > 0; };
  const Vector3 origin = TriangleListView(exact, leaf).reference().point.cast<double>();
  const double touching = kTouching * ((x - origin).norm() + 1e-3 * x.norm());
  if (std::abs(height) < touching) {
    const Vector3 foot = x - height * normal;
    const bool inFront = isInside(foot + touching * normal), behind = isInside(foot - touching * normal);
    if (inFront != behind) return behind ? 1 : -1;
  }
  return (height < 0) == isInside(x) ? 1 : -1;
}

}  // namespace hpsdf
