#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "bvh/triangle_frame.h"
#include "hpsdf/types.h"

namespace hpsdf::combine {

/// Cuts a triangle into convex pieces along segments in its plane.
///
/// The pieces are the leaves of a binary space partition: a segment cuts the pieces that it meets, each along the whole
/// line through it. A piece's corners lie in the plane of the triangle, up to rounding, however often it was cut. All
/// coordinates must be about 1.
class TriangleCutter {
 public:
  /// The distance within which a corner of a piece lies on a line that is to cut the piece.
  static constexpr double kOnLine = 0x1p-47;

  explicit TriangleCutter(const bvh::TriangleFrame& triangle);

  /// Cuts along the segment from a to b, whose ends are projected to the triangle's plane. Parts of it outside of the
  /// triangle do not count.
  void cut(const Vector3& a, const Vector3& b);

  /// Cuts as the function above does, along the intersection with a plane of this normal. The normal gives the
  /// direction of the line, because that of a short segment is less accurate.
  void cut(const Vector3& a, const Vector3& b, const Vector3& normal);

  bool isCut() const { return nodes_.size() > 1; }

  /// Calls take(corners) for each piece, with its corners counter-clockwise as seen from the triangle's front.
  template <typename Take>
  void forEachPiece(const Take& take) const {
    std::vector<Vector3> corners;
    for (const Node& node : nodes_) {
      if (!node.isLeaf()) continue;
      corners.clear();
      for (const Point& point : node.polygon) corners.push_back(placed(point));
      take(std::span<const Vector3>(corners));
    }
  }

 private:
  using Point = Eigen::Vector2d;

  /// The line on which normal · x = offset; the normal has unit length.
  struct Line {
    Point normal = Point::Zero();
    double offset = 0;

    double heightOf(const Point& x) const { return normal.dot(x) - offset; }
  };

  /// An inner node has a line, and its children lie on both sides; a leaf has a convex polygon.
  struct Node {
    Line line = {};
    std::uint32_t above = 0, below = 0;
    std::vector<Point> polygon = {};

    bool isLeaf() const { return above == 0; }
  };

  struct Segment {
    std::uint32_t node;
    Point a, b;
  };

  void cut(const Point& from, const Point& to, const Point& normal);
  Point projected(const Vector3& x) const;
  Vector3 placed(const Point& x) const;
  void pass(const Segment& segment, std::vector<Segment>& waiting) const;
  static bool meets(const std::vector<Point>& polygon, Point a, Point b);
  void split(std::uint32_t leaf, const Line& line);

  bvh::TriangleFrame frame_;
  std::vector<Node> nodes_;
};

}  // namespace hpsdf::combine
