#include "sign/boundary_edges.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "bvh/triangle_frame.h"
#include "sign/winding_number.h"

namespace hpsdf::sign {
namespace {

constexpr std::uint32_t kFew = 512;      // if there are fewer edges than this, all are summed one by one
constexpr std::uint32_t kSmallest = 8;   // clusters of at most this many edges are not divided
constexpr double kCoarsestRatio = 0.25;  // greatest ratio of a cluster's radius to its distance

/// If there are more triangles in the fans, or more than this share of the mesh's triangles, the sum over their solid
/// angles takes longer than a good estimate of the mesh's winding number.
constexpr std::size_t kMostInFans = 4096;
constexpr double kMostShareInFans = 0.25;

/// The common point of the fans, in local coordinates. It is arbitrary, so that the lines from it to the edges do not
/// pass through the points of regular grids.
const Vector3 kCommonPoint(0.2718281828459045, 0.3141592653589793, 0.1618033988749895);

double cube(double x) { return x * x * x; }

/// Returns the vector ε_ijk M_jk of a matrix M, where ε is the Levi-Civita symbol. For M = a⊗b this vector is a × b.
Vector3 axial(const Eigen::Matrix3d& m) { return {m(1, 2) - m(2, 1), m(2, 0) - m(0, 2), m(0, 1) - m(1, 0)}; }

}  // namespace

BoundaryEdges::BoundaryEdges(const bvh::Hierarchy& hierarchy)
    : BoundaryEdges(hierarchy, mesh::directedEdgesOf(hierarchy.triangles())) {}

BoundaryEdges::BoundaryEdges(const bvh::Hierarchy& hierarchy, const std::vector<mesh::DirectedEdge>& sides) {
  const auto position = [&](std::uint32_t vertex) { return hierarchy.local(hierarchy.vertices()[vertex]); };
  mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> edge) {
    int multiplicity = 0;
    for (const mesh::DirectedEdge& side : edge) multiplicity += side.rising ? 1 : -1;
    if (multiplicity != 0)
      edges_.push_back({position(edge.front().low()), position(edge.front().high()), double(multiplicity)});
  });
  const auto count = static_cast<std::uint32_t>(edges_.size());
  if (count < kFew) {
    clusters_ = {Cluster{.end = count, .next = 1}};
  } else {
    addCluster(0, count);
    tbb::parallel_for(std::size_t{0}, clusters_.size(), [&](std::size_t n) { measure(clusters_[n]); });
  }
  addFans(std::min(kMostInFans, std::size_t(kMostShareInFans * double(hierarchy.triangles().size()))));
}

/// Adds the triangles that join the edges to a common point, but none at all if there are more than `most`.
void BoundaryEdges::addFans(std::size_t most) {
  double count = 0;
  for (const Edge& edge : edges_) count += std::abs(edge.multiplicity);
  if (count == 0 || count > double(most)) return;
  fans_.resize((std::size_t(count) + bvh::kWidth - 1) / bvh::kWidth);
  std::size_t triangle = 0;
  for (const Edge& edge : edges_) {
    const bool isForward = edge.multiplicity > 0;  // then triangles of the fans run back along the edge
    const std::array<Vector3, 3> corners = {isForward ? edge.to : edge.from, isForward ? edge.from : edge.to,
                                            kCommonPoint};
    for (auto copies = static_cast<std::size_t>(std::abs(edge.multiplicity)); copies > 0; --copies, ++triangle)
      for (int k = 0; k < 3; ++k)
        for (int axis = 0; axis < 3; ++axis)
          fans_[triangle / bvh::kWidth].corner[k][axis][triangle % bvh::kWidth] = corners[k][axis];
    for (const Vector3& end : {edge.from, edge.to}) toEnds_.push_back((end - kCommonPoint).normalized());
  }
  // Edges share their ends, which are to be looked at once.
  std::sort(toEnds_.begin(), toEnds_.end(), [](const Vector3& a, const Vector3& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  toEnds_.erase(std::unique(toEnds_.begin(), toEnds_.end()), toEnds_.end());
}

/// Returns true if two triangles of a fan may have solid angles that add up to a wrong sum, because the point lies
/// nearly on the edge between them.
bool BoundaryEdges::isOnLineToEnd(const Vector3& local) const {
  constexpr double kAngle = 1e-8;  // the error of a solid angle is about the rounding error over the angle to the line
  const Vector3 offset = local - kCommonPoint;
  const double distance = offset.norm();
  if (distance < kAngle) return true;
  const Vector3 direction = offset / distance;
  double least = HUGE_VAL;
  for (const Vector3& toEnd : toEnds_) least = std::min(least, (toEnd - direction).squaredNorm());
  return least < kAngle * kAngle;
}

std::optional<double> BoundaryEdges::exactWinding(const Vector3& local, double estimate, double error) const {
  if (isOnLineToEnd(local)) return std::nullopt;
  BlockAngles angles;
  for (const AngleBlock& block : fans_) addHalfSolidAngles(block, local, angles);
  const double fans = angles.value() / (2 * std::numbers::pi), whole = std::round(estimate + fans);
  if (!(std::abs(estimate + fans - whole) <= error + WindingNumber::kRounding)) return std::nullopt;
  return whole - fans;
}

/// Adds a cluster of the edges [begin, end) and, recursively, the clusters of its two halves. A cluster is
/// divided along the axis on which the midpoints of its edges extend farthest.
void BoundaryEdges::addCluster(std::uint32_t begin, std::uint32_t end) {
  const std::size_t self = clusters_.size();
  clusters_.push_back(Cluster{.begin = begin, .end = end});
  if (end - begin > kSmallest) {
    Box midpoints;
    for (std::uint32_t e = begin; e < end; ++e) midpoints.extend((edges_[e].from + edges_[e].to) / 2);
    Eigen::Index axis = 0;
    midpoints.sizes().maxCoeff(&axis);
    const std::uint32_t half = begin + (end - begin) / 2;
    std::ranges::nth_element(edges_.begin() + begin, edges_.begin() + half, edges_.begin() + end, {},
                             [axis](const Edge& edge) { return edge.from[axis] + edge.to[axis]; });
    addCluster(begin, half);
    addCluster(half, end);
  }
  clusters_[self].next = static_cast<std::uint32_t>(clusters_.size());
}

void BoundaryEdges::measure(Cluster& cluster) const {
  Box box;
  for (std::uint32_t e = cluster.begin; e < cluster.end; ++e) box.extend(edges_[e].from).extend(edges_[e].to);
  cluster.center = box.center();
  cluster.radius = 0;
  for (std::uint32_t e = cluster.begin; e < cluster.end; ++e) cluster.add(edges_[e]);
}

void BoundaryEdges::Cluster::add(const Edge& edge) {
  const Vector3 a = edge.from - center, b = edge.to - center, sum = a + b, along = edge.multiplicity * (b - a);
  const double edgeLength = along.norm();
  radius = std::max({radius, a.norm(), b.norm()});
  length += edgeLength;
  cubes += edgeLength * (cube(a.norm()) + cube(b.norm())) / 2;  // upper bound: the integrand |d|³ is convex
  first += along;
  second += sum / 2 * along.transpose();
  const Eigen::Matrix3d spread = (a * a.transpose() + b * b.transpose() + sum * sum.transpose()) / 6;
  for (int k = 0; k < 3; ++k) third[k] += along[k] * spread;
}

Vector3 BoundaryEdges::Cluster::series(const Vector3& toCenter, double squaredDistance) const {
  const double inverse = 1 / squaredDistance;
  const Vector3 traces(third[0].trace(), third[1].trace(), third[2].trace());
  Eigen::Matrix3d towards;
  for (int k = 0; k < 3; ++k) towards.col(k) = inverse * third[k] * toCenter;
  const Vector3 higher = (second - 2.5 * towards).transpose() * toCenter + traces / 2;
  return inverse * std::sqrt(inverse) * (axial(second - 3 * towards) + toCenter.cross(first - 3 * inverse * higher));
}

/// The k-th derivatives of s/|s|³ in any directions are at most (k + 1)! / |s|^(k + 2). A matrix M is the sum of three
/// products of a direction with a vector whose lengths add up to at most √3 |M|, with the Frobenius norm |M|. The terms
/// beyond the second order are at most Σ (k + 1)(k + 2) r^(k − 3)/R^(k + 3) ∫|d|³ dl for k ≥ 3.
void BoundaryEdges::Cluster::addDerivative(Gradient& sum, double distance) const {
  const double inverse = 1 / distance, nearest = distance - radius;
  const double thirds = std::sqrt(third[0].squaredNorm() + third[1].squaredNorm() + third[2].squaredNorm());
  const double beyond = 20 * cubes * inverse / cube(1 - radius * inverse);
  const double byMoments =
      cube(inverse) *
      (2 * first.norm() + inverse * (6 * std::sqrt(3.0) * second.norm() + inverse * (36 * thirds + beyond)));
  const double byLength = 2 * length / cube(nearest);  // every edge is at least `nearest` away
  if (byMoments < byLength)
    sum.derivativeByMoments += byMoments;
  else
    sum.derivative += byLength;
}

inline void BoundaryEdges::Edge::addTo(Gradient& sum, const Vector3& local) const {
  const Vector3 a = from - local, b = to - local, along = b - a;
  const double la = a.norm(), lb = b.norm(), product = la * lb;
  const double below = product * (product + a.dot(b));
  if (below > 0) sum.value += multiplicity * (la + lb) / below * a.cross(b);
  const double nearest = (a + bvh::closestParameter(Vector3::Zero(), a, b) * along).norm();
  // The derivative of this edge's contribution is at most the integral of 2/r³ along the edge, where r is the distance
  // from the point. This integral is at most the edge's length times 2/nearest³. It is also at most 4/nearest², which
  // is the integral along an infinite line at the distance `nearest`.
  sum.derivative += 2 * std::abs(multiplicity) * std::min(along.norm() / nearest, 2.0) / (nearest * nearest);
  sum.edgeDistance = std::min(sum.edgeDistance, nearest);
  ++sum.terms;
}

BoundaryEdges::Gradient BoundaryEdges::sum(const Vector3& local, double ratio) const {
  Gradient sum;
  const double errorFactor = (4 - 3 * ratio) / ((1 - ratio) * (1 - ratio));
  for (std::size_t n = 0; n < clusters_.size();) {
    const Cluster& cluster = clusters_[n];
    const Vector3 toCenter = cluster.center - local;
    const double squared = toCenter.squaredNorm(), distance = std::sqrt(squared);
    if (cluster.radius < ratio * distance) {
      const double nearest = distance - cluster.radius;
      sum.value += cluster.series(toCenter, squared);
      sum.error += errorFactor * cluster.cubes / (squared * squared * distance);
      cluster.addDerivative(sum, distance);
      sum.edgeDistance = std::min(sum.edgeDistance, nearest);
      ++sum.terms;
      n = cluster.next;
    } else if (++n == cluster.next) {  // the cluster is not divided into smaller clusters
      for (std::uint32_t e = cluster.begin; e < cluster.end; ++e) edges_[e].addTo(sum, local);
    }
  }
  constexpr double kSphere = 4 * std::numbers::pi;
  return {sum.value / kSphere,      sum.error / kSphere,
          sum.derivative / kSphere, sum.derivativeByMoments / kSphere,
          sum.edgeDistance,         sum.terms};
}

BoundaryEdges::Gradient BoundaryEdges::gradient(const Vector3& local, double error) const {
  for (double ratio = kCoarsestRatio;;) {
    const Gradient found = sum(local, ratio);
    if (found.error <= error) return found;
    ratio *= 0.9 * std::cbrt(error / found.error);  // the error is proportional to the cube of the ratio
  }
}

}  // namespace hpsdf::sign
