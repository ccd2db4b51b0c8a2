#include "sign/inside.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

namespace hpsdf::distance {
namespace {

constexpr std::size_t kTogether = 512;  // points that learn from each other
/// So exact a winding number tells how far a hole's patch is: less would be noise that refinement chases.
constexpr double kExact = 2e-3;
/// So exact a change of the winding number over the distance to the triangles mostly tells that no patch is nearer, and
/// so exact a one adds little to that noise.
constexpr double kRoughChange = 0.1, kExactChange = kExact / 4;

/// By their order; what is no number comes last.
std::vector<std::uint32_t> farthestFirst(std::span<const double> distances) {
  std::vector<std::uint32_t> order(distances.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto finite = [&](std::uint32_t i) { return std::isfinite(distances[i]) ? distances[i] : -1; };
  std::ranges::sort(order, std::greater(), finite);
  return order;
}

}  // namespace

double besideSurface(const Box& box) {
  const double largest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  return 1e-9 * box.sizes().norm() + 1e-14 * largest;
}

/// What is known of a place.
struct Inside::Known {
  Vector3 place;
  double free;     ///< no triangle is nearer
  double nearest;  ///< so far is the surface, patches of holes included
  bool inside;
  double slack;     ///< so far from the level the winding number is at least
  double gradient;  ///< the winding number's is no longer
  double change;    ///< nor does it change by more a way
  double rim;       ///< none is nearer; no less than `free`

  /// What follows for a place of which distances are known.
  Known at(const Vector3& x, double itsFree, double distance) const {
    const double squaredWay = (x - place).squaredNorm();
    if (!(squaredWay < 0.998 * free * free)) return {x, itsFree, distance, inside, 0, 0, 0, 0};
    return after(std::sqrt(squaredWay), x, itsFree, distance);
  }

  /// Whether all places that far away are on the same side that no triangle keeps apart from here.
  bool holdsWithin(double way) const { return way < rim && after(way, place, 0, way).slack > 0; }

  /// The sign is certain, and the patch of a hole is farther than the triangles.
  bool isSettled() const { return slack > 2 * kExact + 1.01 * gradient * nearest; }

 private:
  /// After a way s every rim is at least 1 − s/rim times as far, so that what changes with the cube of that does so by
  /// no more.
  Known after(double way, const Vector3& x, double itsFree, double distance) const {
    const double nearer = 1 - way / rim;
    const double changes = change / (nearer * nearer * nearer), steepest = gradient + changes * way;
    return {x, itsFree, distance, inside, slack - steepest * way, steepest, changes, std::max(rim - way, itsFree)};
  }
};

Inside::Inside(const Hierarchy& hierarchy, const TriangleMesh& mesh, BoundaryEdges rims)
    : hierarchy_(&hierarchy), winding_(hierarchy), rims_(std::move(rims)) {
  if (rims_.empty() && signedVolume(mesh) < 0) level_ = -0.5;
}

Inside::Known Inside::find(const Vector3& x, double free, double distance) const {
  if (!std::isfinite(distance)) return {x, 0, distance, false, 0, 0, 0, 0};
  if (rims_.empty()) return {x, free, distance, winding_.inside(x, level_), 0.5, 0, 0, HUGE_VAL};
  const double scale = hierarchy_->scale();
  const auto gradientTo = [&](double change) {
    return rims_.gradient(hierarchy_->local(x), change / (distance * scale));
  };
  BoundaryEdges::Gradient rims = gradientTo(kRoughChange);
  const auto away = [&](const Winding::Estimate& found) { return std::abs(found.value - level_); };
  const auto isFar = [&](const Winding::Estimate& found) {
    return away(found) - found.error > 1.01 * (rims.value.norm() + rims.error) * scale * distance;
  };
  const Winding::Estimate found = winding_.within(x, kExact, isFar);
  if (!isFar(found) && rims.error > 0) rims = gradientTo(kExactChange);
  const bool inside = away(found) > found.error ? found.value > level_ : winding_.inside(x, level_);
  const double gradient = rims.value.norm() * scale, toPatch = away(found) / gradient;
  return {x,
          free,
          toPatch < distance ? toPatch : distance,
          inside,
          away(found) - found.error,
          gradient + rims.error * scale,
          rims.change * scale * scale,
          std::max(rims.nearest / scale, free)};
}

void Inside::sign(std::span<const Vector3> points, std::span<const double> free, std::span<double> distances) const {
  std::vector<Known> known;
  for (std::size_t first = 0; first < points.size(); first += kTogether) {
    const std::size_t count = std::min(kTogether, points.size() - first);
    signTogether(points.subspan(first, count), free.subspan(first, count), distances.subspan(first, count), known);
  }
}

void Inside::signTogether(std::span<const Vector3> points, std::span<const double> free, std::span<double> distances,
                          std::vector<Known>& known) const {
  known.clear();
  // Those first that are farthest from the triangles: they tell the most others, and the more certainly the nearer.
  for (const std::uint32_t i : farthestFirst(free)) {
    Known here = {points[i], free[i], distances[i], false, 0, 0, 0, 0};
    for (const Known& other : known)
      if (here = other.at(points[i], free[i], distances[i]); here.isSettled()) break;
    if (!here.isSettled()) here = find(points[i], free[i], distances[i]);
    known.push_back(here);
    distances[i] = here.inside ? -here.nearest : std::min(here.nearest, free[i]);
  }
}

bool Inside::boundsInside(std::uint32_t slot) const {
  const auto& [a, b, c] = hierarchy_->triangles()[slot];
  const auto vertices = hierarchy_->vertices();
  return std::abs(winding_.withoutOne((vertices[a] + vertices[b] + vertices[c]) / 3, slot) - level_) < 0.25;
}

bool Inside::contains(const Vector3& x) const { return find(x, 0, 0).inside; }

bool Inside::isSameWithin(const Vector3& x, double reach) const {
  return rims_.empty() || find(x, 0, reach).holdsWithin(reach);
}

std::vector<char> Inside::contains(std::span<const Vector3> places) const {
  std::vector<char> inside(places.size());
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) { inside[i] = contains(places[i]); });
  return inside;
}

}  // namespace hpsdf::distance
