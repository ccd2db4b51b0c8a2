#include "exact_leaf_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>
#include <variant>

#include "hpsdf/detail/exact_sign.h"
#include "hpsdf/detail/triangle_list.h"

namespace hpsdf::physics {
namespace {

constexpr double kExactRounding = 1e-12;  // upper bound of the relative rounding error of a distance

/// Collects on which side of the surface the points of a ball lie, as seen from several features.
class Sides {
 public:
  explicit Sides(double radius) : radius_(radius) {}

  /// Adds a feature by its height, the distance of the ball's centre from it along its unit normal.
  void add(double height) {
    allPositive_ = allPositive_ && height > radius_;
    allNegative_ = allNegative_ && height < -radius_;
  }

  bool areMixed() const { return !allPositive_ && !allNegative_; }
  int sign() const { return allPositive_ == allNegative_ ? 0 : allPositive_ ? 1 : -1; }

 private:
  double radius_;
  bool allPositive_ = true, allNegative_ = true;
};

using Segment = std::array<Vector3, 2>;

double squaredDistance(const Segment& segment, const Vector3& x) {
  const Vector3 along = segment[1] - segment[0];
  const double squared = along.squaredNorm();
  const double t = squared > 0 ? std::clamp((x - segment[0]).dot(along) / squared, 0.0, 1.0) : 0;
  return (segment[0] + t * along - x).squaredNorm();
}

/// The shortest way between two segments begins or ends at an end of one of them, or it is perpendicular to both.
double distanceBetween(const Segment& a, const Segment& b) {
  double squared = std::min(
      {squaredDistance(a, b[0]), squaredDistance(a, b[1]), squaredDistance(b, a[0]), squaredDistance(b, a[1])});
  const Vector3 alongA = a[1] - a[0], alongB = b[1] - b[0], across = alongA.cross(alongB), between = b[0] - a[0];
  const double scale = across.squaredNorm();
  if (scale > 0) {
    const double onA = between.cross(alongB).dot(across) / scale, onB = between.cross(alongA).dot(across) / scale;
    if (onA > 0 && onA < 1 && onB > 0 && onB < 1)
      squared = std::min(squared, (between + onB * alongB - onA * alongA).squaredNorm());
  }
  return std::sqrt(squared);
}

}  // namespace

ExactLeafBound::ExactLeafBound(const ExactTriangles& exact, std::uint64_t leaf)
    : exact_(exact), leaf_(leaf), sign_(node::exactSign(leaf)), offset_(exact.offset) {
  const auto vertex = [&](std::uint32_t index) {
    return std::visit([&](const auto& vertices) { return Vector3(vertices[index].template cast<double>()); },
                      exact.vertices);
  };
  forEachTriangle(exact, leaf, [&](std::uint32_t triangle) {
    const auto& index = exact.triangles[triangle];
    triangles_.push_back(triangleOf(index, {vertex(index[0]), vertex(index[1]), vertex(index[2])}));
  });
  if (sign_ == ExactSign::winding) findOpenEdges();
}

void ExactLeafBound::findOpenEdges() {
  struct Edge {
    Segment ends;
    int count = 0;  ///< triangles along the edge from the lower to the higher index, minus those the other way
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, Edge> edges;
  for (const Triangle& triangle : triangles_)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t from = triangle.index[k], to = triangle.index[(k + 1) % 3];
      Edge& edge = edges[std::minmax(from, to)];
      edge.ends = {triangle.corner[k], triangle.corner[(k + 1) % 3]};
      edge.count += from < to ? 1 : -1;
    }
  for (const auto& [indices, edge] : edges)
    if (edge.count != 0) openEdges_.push_back(edge.ends);
}

int ExactLeafBound::signByWinding(const Ball& ball) const {
  const Vector3 reference = referenceOf(exact_, leaf_).point;
  const Segment toCenter = {reference, ball.center};
  const auto isPassed = [&](const Segment& edge) { return distanceBetween(toCenter, edge) <= ball.radius; };
  if (std::ranges::any_of(openEdges_, isPassed)) return 0;
  return windingAt(exact_, leaf_, ball.center) > 0 ? -1 : 1;
}

ExactLeafBound::Triangle ExactLeafBound::triangleOf(const std::array<std::uint32_t, 3>& index,
                                                    const std::array<Vector3, 3>& corner) {
  Triangle triangle{index, corner, {}, {}, {}};
  for (int k = 0; k < 3; ++k) {
    const Vector3 side = corner[(k + 1) % 3] - corner[k];
    triangle.length[k] = side.norm();
    triangle.direction[k] = side.normalized();
  }
  triangle.normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
  return triangle;
}

ExactLeafBound::Positions ExactLeafBound::all() const {
  Positions positions(triangles_.size());
  std::iota(positions.begin(), positions.end(), 0U);
  return positions;
}

double ExactLeafBound::leastIn(const Box& box, bool withSign, Positions& candidates) {
  const double size = box.max().cwiseAbs().cwiseMax(box.min().cwiseAbs()).maxCoeff();
  const Ball ball{box.center(), box.diagonal().norm() / 2 + kExactRounding * size};

  // No triangle farther from the centre than the nearest one plus the ball's diameter can be nearest in the ball.
  distances_.clear();
  for (const std::uint32_t position : candidates) distances_.push_back(distanceTo(triangles_[position], ball.center));
  const double nearest = *std::ranges::min_element(distances_);
  const double reach = (nearest + 2 * ball.radius) * (1 + kExactRounding);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (distances_[i] <= reach) candidates[kept++] = candidates[i];
  candidates.resize(kept);

  // The unsigned distance to the triangles lies between these bounds.
  const double rounding = kExactRounding * (nearest + size);
  const double least = nearest - ball.radius - rounding, most = nearest + ball.radius + rounding;
  int sign = sign_ == ExactSign::positive ? 1 : sign_ == ExactSign::negative ? -1 : 0;
  if (sign == 0 && withSign && least > 0)
    sign = sign_ == ExactSign::winding ? signByWinding(ball) : signIn(ball, candidates);
  return (sign > 0 ? least : -most) - offset_;
}

double ExactLeafBound::distanceTo(const Triangle& triangle, const Vector3& x) {
  const Vector3 fromCorner = x - triangle.corner[0];
  bool isAbove = triangle.normal.squaredNorm() > 0;
  double squaredToSides = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Vector3 difference = x - triangle.corner[k];
    const double along = std::clamp(difference.dot(triangle.direction[k]), 0.0, triangle.length[k]);
    isAbove = isAbove && triangle.normal.dot(triangle.direction[k].cross(difference)) > 0;
    squaredToSides = std::min(squaredToSides, (difference - along * triangle.direction[k]).squaredNorm());
  }
  return isAbove ? std::abs(fromCorner.dot(triangle.normal)) : std::sqrt(squaredToSides);
}

int ExactLeafBound::signIn(const Ball& ball, const Positions& candidates) {
  const Vector3& center = ball.center;
  const double radius = ball.radius;
  Sides sides(radius);
  for (const std::uint32_t position : candidates) {
    Triangle& triangle = triangles_[position];
    if (triangle.features.empty()) findFeatures(triangle);
    for (const Feature& feature : triangle.features) {
      const Vector3 difference = center - feature.at;
      const auto reaches = [&](const Feature::HalfSpace& part) {
        return part.outwards.dot(difference) <= part.limit + radius;
      };
      if (std::ranges::all_of(feature.region, reaches)) sides.add(difference.dot(feature.normal));
    }
    if (sides.areMixed()) return 0;
  }
  return sides.sign();
}

void ExactLeafBound::findFeatures(Triangle& triangle) const {
  if (triangle.normal.squaredNorm() > 0) triangle.features.push_back(faceOf(triangle));
  for (int k = 0; k < 3; ++k) {
    triangle.features.push_back(sideOf(triangle, k));
    triangle.features.push_back(cornerOf(triangle, k));
  }
}

ExactLeafBound::Feature ExactLeafBound::faceOf(const Triangle& triangle) {
  Feature face{triangle.corner[0], triangle.normal};
  for (int k = 0; k < 3; ++k) {
    const Vector3 outwards = -triangle.inwards(k);
    face.region.push_back({outwards, outwards.dot(triangle.corner[k] - face.at)});
  }
  return face;
}

ExactLeafBound::Feature ExactLeafBound::sideOf(const Triangle& triangle, int side) const {
  const std::uint32_t from = triangle.index[side], to = triangle.index[(side + 1) % 3];
  const Vector3& along = triangle.direction[side];
  Feature feature{triangle.corner[side], Vector3::Zero(), {{-along, 0}, {along, triangle.length[side]}}};
  for (const Triangle& other : triangles_)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t start = other.index[k], end = other.index[(k + 1) % 3];
      if (!(start == from && end == to) && !(start == to && end == from)) continue;
      feature.normal += other.normal;
      feature.region.push_back({other.inwards(k), 0});
    }
  feature.normal.normalize();
  return feature;
}

ExactLeafBound::Feature ExactLeafBound::cornerOf(const Triangle& triangle, int corner) const {
  Feature feature{triangle.corner[corner], Vector3::Zero()};
  for (const Triangle& other : triangles_)
    for (int k = 0; k < 3; ++k) {
      if (other.index[k] != triangle.index[corner]) continue;
      const Vector3 &next = other.direction[k], previous = -other.direction[(k + 2) % 3];
      feature.normal += std::acos(std::clamp(next.dot(previous), -1.0, 1.0)) * other.normal;
      feature.region.push_back({next, 0});
      feature.region.push_back({previous, 0});
    }
  feature.normal.normalize();
  return feature;
}

}  // namespace hpsdf::physics
