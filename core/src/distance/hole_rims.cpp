#include "distance/hole_rims.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

namespace hpsdf::distance {
namespace {

/// A triangle's side, by its lower and higher vertex.
struct Edge {
  std::uint32_t low, high;
  int rising;  ///< 1: runs from low to high, else -1

  auto key() const { return std::pair(low, high); }
};

std::vector<Edge> edgesOf(const Hierarchy& hierarchy) {
  std::vector<Edge> edges;
  edges.reserve(3 * hierarchy.triangles().size());
  for (const auto& corners : hierarchy.triangles())
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t from = corners[k], to = corners[(k + 1) % 3];
      if (from != to) edges.push_back({std::min(from, to), std::max(from, to), from < to ? 1 : -1});
    }
  std::ranges::sort(edges, {}, &Edge::key);
  return edges;
}

double distanceTo(const Vector3& x, const Vector3& a, const Vector3& b) {
  const Vector3 along = b - a;
  const double squared = along.squaredNorm();
  const double t = squared > 0 ? std::clamp((x - a).dot(along) / squared, 0.0, 1.0) : 0.0;
  return (x - a - t * along).norm();
}

}  // namespace

HoleRims::HoleRims(const Hierarchy& hierarchy) {
  const std::vector<Edge> edges = edgesOf(hierarchy);
  const auto vertices = hierarchy.vertices();
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    int times = 0;
    for (; end < edges.size() && edges[end].key() == edges[begin].key(); ++end) times += edges[end].rising;
    if (times != 0)
      sides_.push_back(
          {hierarchy.local(vertices[edges[begin].low]), hierarchy.local(vertices[edges[begin].high]), double(times)});
  }
}

Vector3 HoleRims::gradient(const Vector3& local) const {
  Vector3 sum = Vector3::Zero();
  for (const Side& side : sides_) {
    const Vector3 a = side.from - local, b = side.to - local;
    const double la = a.norm(), lb = b.norm(), product = la * lb;
    const double below = product * (product + a.dot(b));
    if (below > 0) sum += side.times * (la + lb) / below * a.cross(b);
  }
  return sum / (4 * std::numbers::pi);
}

double HoleRims::greatestGradient(const Vector3& local, double within) const {
  double sum = 0;
  for (const Side& side : sides_) {
    const double nearest = distanceTo(local, side.from, side.to) - within;
    if (!(nearest > 0)) return HUGE_VAL;
    sum += std::abs(side.times) * (side.to - side.from).norm() / (nearest * nearest);
  }
  return sum / (4 * std::numbers::pi);
}

}  // namespace hpsdf::distance
