#include "sign/winding_sign.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

namespace hpsdf::sign {
namespace {

constexpr std::size_t kBatch = 512;  // number of points whose signs may be derived from each other
/// Tolerated error of a winding number from which the distance to a surface that closes a hole is computed. A greater
/// error would add noise to this distance, and the refinement of the field would try to resolve the noise.
constexpr double kExact = 2e-3;
/// Tolerated errors of the winding number's gradient, multiplied by the distance to the triangles. `kRoughChange`
/// usually suffices to show that the surface which closes a hole is farther away than the triangles. `kExactChange` is
/// small enough to add little to the noise of `kExact`.
constexpr double kRoughChange = 0.1, kExactChange = kExact / 4;
/// The surface that closes a hole is at the distance |w − ½|/|∇w| to first order. The triangles count as nearer only if
/// they are nearer by this factor.
constexpr double kMargin = 1.01;
constexpr double kTellsWhole = 0.4;  ///< error of an estimate from which the exact winding number follows

/// Returns the indices of the distances, sorted from the greatest to the least distance. Infinities and NaNs come last.
std::vector<std::uint32_t> farthestFirst(std::span<const double> distances) {
  std::vector<std::uint32_t> order(distances.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto finite = [&](std::uint32_t i) { return std::isfinite(distances[i]) ? distances[i] : -1; };
  std::ranges::sort(order, std::greater(), finite);
  return order;
}

/// Returns the distance of a winding number from the nearest of the levels ½, 1½, −½ …
double toHalf(double winding) { return 0.5 - std::abs(winding - std::round(winding)); }

}  // namespace

double probeDistance(const Box& box) {
  const double largest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  return 1e-9 * box.sizes().norm() + 1e-14 * largest;
}

/// The side (inside or outside) of a point, and bounds from which the sides of nearby points follow.
struct WindingSign::Sample {
  Vector3 position;
  double clearance;  ///< lower bound of the distance to the triangles
  double distance;   ///< distance to the surface, including the surfaces that close holes
  bool inside;
  double margin = 0;    ///< lower bound of |w − level_| for the winding number w
  double gradient = 0;  ///< upper bound of the length of the winding number's gradient ∇w
  /// The sum of these is an upper bound of the derivative of ∇w in any direction (`BoundaryEdges::Gradient`).
  double derivative = 0, derivativeByMoments = 0;
  double edgeDistance = 0;  ///< lower bound of the distance to the unbalanced edges, at least `clearance`

  /// Returns false if the bounds of this sample certainly do not tell the side of a point x at this distance from the
  /// triangles.
  bool mayReach(const Vector3& x, double itsDistance) const {
    const double farthest = std::min(0.999 * clearance, (margin - 2 * kExact) / gradient - kMargin * itsDistance);
    return farthest > 0 && (x - position).squaredNorm() < farthest * farthest;
  }

  /// Derives the sample for a point x, whose distances are known, from this sample.
  Sample movedTo(const Vector3& x, double itsClearance, double itsDistance) const {
    return movedBy((x - position).norm(), x, itsClearance, itsDistance);
  }

  /// Returns true if all points within `radius` of this point are certainly on the same side (inside or outside) as
  /// this point, except points that a triangle separates from it.
  bool holdsWithin(double radius) const {
    return radius < edgeDistance && movedBy(radius, position, 0, radius).margin > 0;
  }

  /// Returns true if, at all points within `radius` of this point, whose distances to the triangles are at most
  /// `farthest`, every surface that closes a hole is certainly farther away than the triangles.
  bool isCertainWithin(double radius, double farthest) const {
    return radius < edgeDistance && movedBy(radius, position, 0, farthest).isCertain();
  }

  /// Returns true if the sign is certain and every surface that closes a hole is farther away than the
  /// triangles.
  bool isCertain() const { return margin > 2 * kExact + kMargin * gradient * distance; }

 private:
  /// Returns the sample for a point x at the distance `step` from this sample. The distance to an unbalanced edge
  /// shrinks at most by the factor 1 − step/edgeDistance. Therefore the two bounds of the gradient's derivative grow at
  /// most by the inverse third and sixth power of this factor.
  Sample movedBy(double step, const Vector3& x, double itsClearance, double itsDistance) const {
    const double nearer = 1 - step / edgeDistance;
    const double cubed = nearer * nearer * nearer;
    const double byLengths = derivative / cubed, byMoments = derivativeByMoments / (cubed * cubed);
    const double steepest = gradient + (byLengths + byMoments) * step;
    return {x,
            itsClearance,
            itsDistance,
            inside,
            margin - steepest * step,
            steepest,
            byLengths,
            byMoments,
            std::max(edgeDistance - step, itsClearance)};
  }
};

WindingSign::WindingSign(const bvh::Hierarchy& hierarchy, const TriangleMesh& mesh, BoundaryEdges edges)
    : WindingSign(hierarchy, std::move(edges)) {
  if (edges_.empty() && signedVolume(mesh) < 0) level_ = -0.5;
}

WindingSign::WindingSign(const bvh::Hierarchy& hierarchy, BoundaryEdges edges)
    : hierarchy_(&hierarchy), winding_(hierarchy), edges_(std::move(edges)) {}

/// Returns the first estimate of the winding number that satisfies `isEnough`, or one whose error is at most `error`.
template <typename Enough>
WindingNumber::Estimate WindingSign::windingNumber(const Vector3& x, double error, Enough isEnough) const {
  if (!edges_.haveFans()) return winding_.estimateWithin(x, error, isEnough);
  const WindingNumber::Estimate found = winding_.estimateWithin(x, kTellsWhole, isEnough);
  if (isEnough(found)) return found;
  if (const auto exact = edges_.exactWinding(hierarchy_->local(x), found.value, found.error))
    return {*exact, WindingNumber::kRounding};
  return winding_.estimateWithin(x, error, isEnough);
}

double WindingSign::numberAt(const Vector3& x, double error) const {
  constexpr double kFar = 1e15;  // in local coordinates; squares of greater ones may overflow, and w is 0 to rounding
  if (!(hierarchy_->local(x).cwiseAbs().maxCoeff() < kFar) || !x.allFinite()) return 0;
  const auto needsAll = [](const WindingNumber::Estimate&) { return false; };
  if (!edges_.empty()) return windingNumber(x, error, needsAll).value;
  return std::round(winding_.estimateWithin(x, kTellsWhole, needsAll).value) + 0.0;  // adding 0 turns -0 into 0
}

WindingSign::Sample WindingSign::sampleAt(const Vector3& x, double clearance, double distance) const {
  if (!std::isfinite(distance)) return {x, 0, distance, false};
  if (edges_.empty()) return {x, clearance, distance, winding_.isAbove(x, level_), 0.5, 0, 0, 0, HUGE_VAL};
  const double scale = hierarchy_->scale();
  const auto gradientWithin = [&](double change) {
    return edges_.gradient(hierarchy_->local(x), change / (distance * scale));
  };
  BoundaryEdges::Gradient gradient = gradientWithin(kRoughChange);
  const auto fromLevel = [&](const WindingNumber::Estimate& found) { return std::abs(found.value - level_); };
  const auto isFarFromLevel = [&](const WindingNumber::Estimate& found) {
    return fromLevel(found) - found.error > kMargin * (gradient.value.norm() + gradient.error) * scale * distance;
  };
  const WindingNumber::Estimate found = windingNumber(x, kExact, isFarFromLevel);
  if (!isFarFromLevel(found) && gradient.error > 0) gradient = gradientWithin(kExactChange);
  const bool inside = fromLevel(found) > found.error ? found.value > level_ : winding_.isAbove(x, level_);
  const double toClosingSurface = fromLevel(found) / (gradient.value.norm() * scale);
  Sample sample = sampleOf(x, clearance, gradient);
  sample.distance = std::min(distance, toClosingSurface);
  sample.inside = inside;
  sample.margin = fromLevel(found) - found.error;
  return sample;
}

void WindingSign::applyTo(std::span<double> distances, std::span<const Vector3> points,
                          std::span<const double> clearances) const {
  std::vector<Sample> samples;
  for (std::size_t first = 0; first < points.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, points.size() - first);
    applyToBatch(distances.subspan(first, count), points.subspan(first, count), clearances.subspan(first, count),
                 samples);
  }
}

void WindingSign::applyToBatch(std::span<double> distances, std::span<const Vector3> points,
                               std::span<const double> clearances, std::vector<Sample>& samples) const {
  samples.clear();
  // Process points far from all triangles first, because a sample far away determines the signs of more other points.
  for (const std::uint32_t i : farthestFirst(clearances)) {
    Sample here = {points[i], clearances[i], distances[i], false};
    for (const Sample& other : samples) {
      if (!other.mayReach(points[i], distances[i])) continue;
      here = other.movedTo(points[i], clearances[i], distances[i]);
      if (here.isCertain()) break;
    }
    if (!here.isCertain()) here = sampleAt(points[i], clearances[i], distances[i]);
    // The bounds of an uncertain sample hardly ever reach a point that is nearer to the triangles.
    if (here.isCertain()) samples.push_back(here);
    distances[i] = here.inside ? -here.distance : std::min(here.distance, clearances[i]);
  }
}

/// Returns a sample with the bounds of a gradient, but without a winding number.
WindingSign::Sample WindingSign::sampleOf(const Vector3& x, double distance,
                                          const BoundaryEdges::Gradient& gradient) const {
  const double scale = hierarchy_->scale();
  return {.position = x,
          .clearance = distance,
          .distance = distance,
          .inside = false,
          .gradient = (gradient.value.norm() + gradient.error) * scale,
          .derivative = gradient.derivative * scale * scale,
          .derivativeByMoments = gradient.derivativeByMoments * scale * scale,
          .edgeDistance = std::max(gradient.edgeDistance / scale, distance)};
}

bool WindingSign::isFarFromHoles(const Vector3& x, double radius, double distance) const {
  if (edges_.empty()) return true;
  const double farthest = distance + radius;
  Sample sample =
      sampleOf(x, distance, edges_.gradient(hierarchy_->local(x), kRoughChange / (farthest * hierarchy_->scale())));
  const auto isCertain = [&](const WindingNumber::Estimate& found) {
    sample.margin = toHalf(found.value) - found.error;
    return sample.isCertainWithin(radius, farthest);
  };
  return isCertain(windingNumber(x, kExact, isCertain));
}

WindingSign::Sides WindingSign::sidesOf(std::uint32_t slot) const {
  constexpr double kError = 0.05;
  const auto& [a, b, c] = hierarchy_->triangles()[slot];
  const auto vertices = hierarchy_->vertices();
  const Vector3 centroid = (vertices[a] + vertices[b] + vertices[c]) / 3;
  // Without the triangle, the winding number at its centroid is the mean of the numbers on its two sides, which differ
  // by 1.
  const double winding = winding_.withoutTriangle(centroid, slot);
  if (!edges_.empty()) {
    // The number may change along the triangle, but must stay on the same side of every level.
    const double radius =
        std::sqrt(std::max({(vertices[a] - centroid).squaredNorm(), (vertices[b] - centroid).squaredNorm(),
                            (vertices[c] - centroid).squaredNorm()}));
    Sample sample = sampleOf(centroid, 0, edges_.gradient(hierarchy_->local(centroid), 0));
    sample.margin = toHalf(winding + 0.5) - kError;
    if (!sample.holdsWithin(radius)) return Sides::unknown;
  }
  const double fromLevel = winding - level_;
  if (std::abs(fromLevel) < 0.25) return Sides::separates;
  return fromLevel > 0.75 ? Sides::bothInside : Sides::unknown;
}

bool WindingSign::separatesOutsideFromInside(std::uint32_t slot) const { return sidesOf(slot) == Sides::separates; }

bool WindingSign::isInside(const Vector3& x) const { return sampleAt(x, 0, 0).inside; }

std::int32_t WindingSign::windingAt(const Vector3& x) const {
  const auto isEnough = [](const WindingNumber::Estimate& found) { return toHalf(found.value) > found.error; };
  return static_cast<std::int32_t>(std::lround(windingNumber(x, kExact, isEnough).value + 0.5 - level_));
}

bool WindingSign::isSameSideWithin(const Vector3& x, double radius) const {
  return edges_.empty() || sampleAt(x, 0, radius).holdsWithin(radius);
}

}  // namespace hpsdf::sign
