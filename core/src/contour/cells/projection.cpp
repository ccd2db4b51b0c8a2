#include "contour/cells/projection.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace hpsdf::contouring {

void projectOntoSurface(const ImplicitSurface& surface, double accuracy, std::span<Vector3> points,
                        std::span<double> magnitudes, std::span<const Box> rooms) {
  constexpr int kMostSteps = 6;
  constexpr double kFlat = 0.01;  // least squared length of a gradient along which a step is made
  std::vector<Vector3> tried(points.begin(), points.end());
  std::vector<std::uint32_t> numbers(points.size());  // by point in `tried`: its place in `points`
  std::vector<ValueAndGradient> found(points.size());
  for (std::uint32_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
  std::ranges::fill(magnitudes, std::numeric_limits<double>::infinity());
  for (int step = 0; step <= kMostSteps && !tried.empty(); ++step) {
    surface.valuesAndGradients(tried, std::span(found).first(tried.size()));
    std::size_t left = 0;
    for (std::size_t i = 0; i < tried.size(); ++i) {
      const auto& [value, gradient] = found[i];
      const std::uint32_t n = numbers[i];
      if (std::abs(value) < magnitudes[n]) {
        magnitudes[n] = std::abs(value);
        points[n] = tried[i];
      }
      const double squared = gradient.squaredNorm();
      if (magnitudes[n] <= accuracy || !(squared > kFlat)) continue;
      Vector3 next = tried[i] - gradient * (value / squared);
      if (!rooms.empty()) next = next.cwiseMax(rooms[n].min()).cwiseMin(rooms[n].max());
      tried[left] = next;
      numbers[left++] = n;
    }
    tried.resize(left);
  }
}

}  // namespace hpsdf::contouring
