#include "distance/inside.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>
#include <vector>

namespace hpsdf::distance {
namespace {

constexpr std::size_t kTogether = 512;  // points that learn from each other
constexpr double kSure = 0.05;          // so exact a winding number tells how far a hole's patch is

struct Ball {
  Vector3 center;
  double radius;
};

Ball around(std::span<const Vector3> points) {
  Box box;
  for (const Vector3& x : points) box.extend(x);
  Ball ball{box.center(), 0};
  for (const Vector3& x : points) ball.radius = std::max(ball.radius, (x - ball.center).norm());
  return ball;
}

/// By their order; what is no number comes last.
std::vector<std::uint32_t> farthestFirst(std::span<const double> distances) {
  std::vector<std::uint32_t> order(distances.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto finite = [&](std::uint32_t i) { return std::isfinite(distances[i]) ? distances[i] : -1; };
  std::ranges::sort(order, std::greater(), finite);
  return order;
}

}  // namespace

/// What is known of a place.
struct Inside::Known {
  Vector3 place;
  double free;     ///< no triangle is nearer
  double nearest;  ///< unsigned, patches of holes included
  double slack;    ///< so far from the level the winding number is at least
  bool inside;
};

Inside::Inside(const Hierarchy& hierarchy, const TriangleMesh& mesh)
    : hierarchy_(&hierarchy), winding_(hierarchy), rims_(hierarchy) {
  if (rims_.empty() && signedVolume(mesh) < 0) level_ = -0.5;
}

Inside::Known Inside::find(const Vector3& x, double distance) const {
  if (!std::isfinite(distance)) return {x, 0, distance, 0, false};
  if (rims_.empty()) return {x, distance, distance, 0.5, winding_.inside(x, level_)};
  const Winding::Estimate found = winding_.within(x, kSure);
  const double away = std::abs(found.value - level_);
  const bool inside = away > found.error ? found.value > level_ : winding_.inside(x, level_);
  const double toPatch = away / (rims_.gradient(hierarchy_->local(x)).norm() * hierarchy_->scale());
  return {x, distance, toPatch < distance ? toPatch : distance, away - found.error, inside};
}

void Inside::sign(std::span<const Vector3> points, std::span<double> distances) const {
  std::vector<Known> known;
  for (std::size_t first = 0; first < points.size(); first += kTogether) {
    const std::size_t count = std::min(kTogether, points.size() - first);
    signTogether(points.subspan(first, count), distances.subspan(first, count), known);
  }
}

void Inside::signTogether(std::span<const Vector3> points, std::span<double> distances,
                          std::vector<Known>& known) const {
  const Ball ball = around(points);
  const double scale = hierarchy_->scale();
  const double greatest =
      rims_.empty() ? 0 : scale * rims_.greatestGradient(hierarchy_->local(ball.center), scale * ball.radius);
  known.clear();
  // Those first that are farthest from the triangles: around each of them, as far as its distance goes, there is none,
  // so that the winding number changes there by no more than the greatest gradient times the way.
  for (const std::uint32_t i : farthestFirst(distances)) {
    const Vector3& x = points[i];
    const double distance = distances[i];
    const auto slackFrom = [&](const Known& other) { return other.slack - greatest * (x - other.place).norm(); };
    const auto tells = [&](const Known& other) {
      // the sign is the same, and the patch of a hole is farther than the triangles
      return (x - other.place).squaredNorm() < 0.999 * other.free * other.free &&
             slackFrom(other) > 2 * kSure + 1.01 * greatest * distance;
    };
    const auto other = std::ranges::find_if(known, tells);
    known.push_back(other == known.end() ? find(x, distance)
                                         : Known{x, distance, distance, slackFrom(*other), other->inside});
    distances[i] = known.back().inside ? -known.back().nearest : known.back().nearest;
  }
}

}  // namespace hpsdf::distance
