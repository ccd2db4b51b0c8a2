#include "contour/cells/triangle_errors.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace hpsdf::contouring {
namespace {

/// A search for the greatest error in triangles at the points of a lattice.
struct ErrorStage {
  double above;                 ///< the least error known, in tolerances, with which this search is made
  std::vector<Vector3> places;  ///< barycentric coordinates
};

/// Returns the points of a lattice in a triangle, as barycentric coordinates: multiples of 1/n, and the middle.
std::vector<Vector3> latticeOfTriangle(int n) {
  std::vector<Vector3> points;
  for (int i = 0; i <= n; ++i)
    for (int k = 0; i + k <= n; ++k) points.push_back(Vector3(i, k, n - i - k) / n);
  if (n % 3 != 0) points.push_back(Vector3::Constant(1.0 / 3));
  return points;
}

const std::vector<ErrorStage>& errorStages() {
  static const std::vector<ErrorStage> stages = {
      {0, latticeOfTriangle(2)}, {0.2, latticeOfTriangle(4)}, {0.5, latticeOfTriangle(10)}};
  return stages;
}

/// Raises the errors of chosen triangles to those at some places.
void raiseErrorsAt(std::span<const Vector3> places, const Evaluate& evaluate,
                   std::span<const std::array<Vector3, 3>> triangles, std::span<const std::uint32_t> chosen,
                   std::span<double> errors) {
  std::vector<Vector3> points;
  points.reserve(places.size() * chosen.size());
  for (const std::uint32_t n : chosen) {
    const auto& [a, b, c] = triangles[n];
    for (const Vector3& place : places) points.emplace_back(place[0] * a + place[1] * b + place[2] * c);
  }
  std::vector<double> values(points.size());
  evaluate(points, values);
  for (std::size_t i = 0; i < points.size(); ++i) {
    double& error = errors[chosen[i / places.size()]];
    error = std::max(error, std::abs(values[i]));
  }
}

}  // namespace

void raiseErrors(const Evaluate& evaluate, std::span<const std::array<Vector3, 3>> triangles, double tolerance,
                 std::span<double> errors) {
  std::vector<std::uint32_t> chosen(triangles.size());
  for (std::uint32_t n = 0; n < chosen.size(); ++n) chosen[n] = n;
  for (const ErrorStage& stage : errorStages()) {
    std::erase_if(chosen,
                  [&](std::uint32_t n) { return errors[n] > tolerance || errors[n] < stage.above * tolerance; });
    raiseErrorsAt(stage.places, evaluate, triangles, chosen, errors);
  }
}

}  // namespace hpsdf::contouring
