#include "contour/cells/triangle_errors.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace hpsdf::contouring {
namespace {

/// A search for the greatest error in triangles at the points of a lattice.
struct ErrorStage {
  double above;       ///< the least error known, in tolerances, with which this search is made
  std::size_t along;  ///< least number of intervals along each side
};
constexpr std::array<ErrorStage, 3> kErrorStages{{{0, 2}, {0.2, 4}, {0.5, 10}}};
constexpr std::size_t kMostAlong = 64;

/// Returns the points of a lattice in a triangle, as barycentric coordinates: multiples of 1/n, and the middle.
std::vector<Vector3> latticeOfTriangle(int n) {
  std::vector<Vector3> points;
  for (int i = 0; i <= n; ++i)
    for (int k = 0; i + k <= n; ++k) points.push_back(Vector3(i, k, n - i - k) / n);
  if (n % 3 != 0) points.push_back(Vector3::Constant(1.0 / 3));
  return points;
}

/// Returns the lattice with so many intervals along each side, at most kMostAlong.
const std::vector<Vector3>& lattice(std::size_t along) {
  static const std::vector<std::vector<Vector3>> all = [] {
    std::vector<std::vector<Vector3>> lattices(1);
    for (std::size_t n = 1; n <= kMostAlong; ++n) lattices.push_back(latticeOfTriangle(static_cast<int>(n)));
    return lattices;
  }();
  return all[std::min(along, kMostAlong)];
}

/// Returns the number of intervals of at most `spacing` along the longest side of a triangle.
std::size_t intervalsAlong(const std::array<Vector3, 3>& triangle, double spacing) {
  const auto& [a, b, c] = triangle;
  const double longest = std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
  return static_cast<std::size_t>(std::ceil(std::min(longest / spacing, double(kMostAlong))));
}

/// Raises the errors of chosen triangles by one search.
void raiseErrorsBy(const ErrorStage& stage, const Evaluate& evaluate, std::span<const std::array<Vector3, 3>> triangles,
                   std::span<const std::uint32_t> chosen, double spacing, std::span<double> errors) {
  std::vector<Vector3> points;
  std::vector<std::uint32_t> triangleOf;
  for (const std::uint32_t n : chosen) {
    const auto& [a, b, c] = triangles[n];
    for (const Vector3& place : lattice(std::max(stage.along, intervalsAlong(triangles[n], spacing)))) {
      points.emplace_back(place[0] * a + place[1] * b + place[2] * c);
      triangleOf.push_back(n);
    }
  }
  std::vector<double> values(points.size());
  evaluate(points, values);
  for (std::size_t i = 0; i < points.size(); ++i)
    errors[triangleOf[i]] = std::max(errors[triangleOf[i]], std::abs(values[i]));
}

}  // namespace

std::span<const Vector3> placesInTriangle(const std::array<Vector3, 3>& triangle, double spacing) {
  static const std::vector<Vector3> few = {Vector3(1, 1, 1) / 3, Vector3(4, 1, 1) / 6, Vector3(1, 4, 1) / 6,
                                           Vector3(1, 1, 4) / 6};
  const std::size_t intervals = intervalsAlong(triangle, spacing);
  return intervals <= 2 ? few : lattice(intervals);
}

void raiseErrors(const Evaluate& evaluate, std::span<const std::array<Vector3, 3>> triangles, double tolerance,
                 double spacing, std::span<double> errors) {
  std::vector<std::uint32_t> chosen(triangles.size());
  for (std::uint32_t n = 0; n < chosen.size(); ++n) chosen[n] = n;
  for (const ErrorStage& stage : kErrorStages) {
    std::erase_if(chosen,
                  [&](std::uint32_t n) { return errors[n] > tolerance || errors[n] < stage.above * tolerance; });
    raiseErrorsBy(stage, evaluate, triangles, chosen, spacing, errors);
  }
}

}  // namespace hpsdf::contouring
