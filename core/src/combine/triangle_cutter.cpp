#include "combine/triangle_cutter.h"

#include <cmath>
#include <utility>

namespace hpsdf::combine {
namespace {

constexpr double kSameLine = 0x1p-43, kBeyond = 0x1p-49;

}  // namespace

TriangleCutter::TriangleCutter(const bvh::TriangleFrame& triangle) : frame_(triangle) {
  nodes_.push_back(
      {.polygon = {Point(0, 0), Point(triangle.length, 0), Point(triangle.apexAlong, triangle.apexAcross)}});
}

void TriangleCutter::cut(const Vector3& a, const Vector3& b) {
  const Point from = projected(a), to = projected(b);
  const Point direction = (to - from).stableNormalized();
  if (direction.squaredNorm() > 0) cut(from, to, Point(-direction.y(), direction.x()));
}

void TriangleCutter::cut(const Vector3& a, const Vector3& b, const Vector3& normal) {
  const Point inPlane = Point(normal.dot(frame_.along), normal.dot(frame_.across)).stableNormalized();
  if (inPlane.squaredNorm() > 0) cut(projected(a), projected(b), inPlane);
}

/// Cuts along a segment that lies on a line with this unit normal, up to rounding.
void TriangleCutter::cut(const Point& from, const Point& to, const Point& normal) {
  const Line line{normal, normal.dot((from + to) / 2)};
  std::vector<Segment> waiting = {{0, from, to}};
  while (!waiting.empty()) {
    const Segment segment = waiting.back();
    waiting.pop_back();
    if (!nodes_[segment.node].isLeaf())
      pass(segment, waiting);
    else if (meets(nodes_[segment.node].polygon, segment.a, segment.b))
      split(segment.node, line);
  }
}

TriangleCutter::Point TriangleCutter::projected(const Vector3& x) const {
  const Vector3 from = x - frame_.origin;
  return {from.dot(frame_.along), from.dot(frame_.across)};
}

Vector3 TriangleCutter::placed(const Point& x) const {
  return frame_.origin + x.x() * frame_.along + x.y() * frame_.across;
}

/// Passes a segment that has reached an inner node on to the children in which it lies. A segment along the node's
/// line, up to kSameLine, ends there, because the line cuts already. Beyond the line it goes on even for a short way,
/// kBeyond, because pieces with an acute corner are narrow there.
void TriangleCutter::pass(const Segment& segment, std::vector<Segment>& waiting) const {
  const Node& node = nodes_[segment.node];
  const double atA = node.line.heightOf(segment.a), atB = node.line.heightOf(segment.b);
  if (std::abs(atA) <= kSameLine && std::abs(atB) <= kSameLine) return;
  const bool reachesAbove = atA > kBeyond || atB > kBeyond, reachesBelow = atA < -kBeyond || atB < -kBeyond;
  if (reachesAbove != reachesBelow) {
    waiting.push_back({reachesAbove ? node.above : node.below, segment.a, segment.b});
  } else if (reachesAbove) {
    const Point middle = segment.a + (segment.b - segment.a) * (atA / (atA - atB));
    waiting.push_back({atA > 0 ? node.above : node.below, segment.a, middle});
    waiting.push_back({atB > 0 ? node.above : node.below, middle, segment.b});
  }
}

/// Returns true if a segment has points within a convex polygon, up to rounding.
bool TriangleCutter::meets(const std::vector<Point>& polygon, Point a, Point b) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point& corner = polygon[i];
    const Point side = polygon[(i + 1) % polygon.size()] - corner;
    const double length = side.norm();
    if (!(length > 0)) continue;
    const Point inward(-side.y() / length, side.x() / length);
    const double atA = inward.dot(a - corner), atB = inward.dot(b - corner);
    if (atA <= 0 && atB <= 0) return false;
    if (atA < 0) a += (b - a) * (atA / (atA - atB));
    if (atB < 0) b += (a - b) * (atB / (atB - atA));
  }
  return true;
}

void TriangleCutter::split(std::uint32_t leaf, const Line& line) {
  const std::vector<Point> polygon = std::move(nodes_[leaf].polygon);
  std::vector<double> heights;
  for (const Point& corner : polygon) heights.push_back(line.heightOf(corner));
  std::vector<Point> above, below;
  bool hasAbove = false, hasBelow = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t next = (i + 1) % polygon.size();
    const double height = heights[i], nextHeight = heights[next];
    hasAbove = hasAbove || height > kOnLine;
    hasBelow = hasBelow || height < -kOnLine;
    if (height >= -kOnLine) above.push_back(polygon[i]);
    if (height <= kOnLine) below.push_back(polygon[i]);
    if ((height > kOnLine && nextHeight < -kOnLine) || (height < -kOnLine && nextHeight > kOnLine)) {
      const Point crossing = polygon[i] + (polygon[next] - polygon[i]) * (height / (height - nextHeight));
      above.push_back(crossing);
      below.push_back(crossing);
    }
  }
  if (!hasAbove || !hasBelow) {
    nodes_[leaf].polygon = polygon;
    return;
  }
  nodes_[leaf].line = line;
  nodes_[leaf].above = static_cast<std::uint32_t>(nodes_.size());
  nodes_[leaf].below = nodes_[leaf].above + 1;
  nodes_.push_back({.polygon = std::move(above)});
  nodes_.push_back({.polygon = std::move(below)});
}

}  // namespace hpsdf::combine
