#include "field/range/enclosure.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "basis/coefficient_cube.h"

namespace hpsdf::range {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Bounds of the derivatives of the Legendre polynomial of degree i within [−1, 1], all of which are attained at 1.
double firstDerivative(int i) { return i * (i + 1) / 2.0; }
double secondDerivative(int i) { return (i - 1.0) * i * (i + 1.0) * (i + 2.0) / 8; }

/// Returns a bound of the sum of the magnitudes of all second derivatives of L_i(x) L_j(y) L_k(z) within [−1, 1]³.
double bendOf(int i, int j, int k) {
  const double x = firstDerivative(i), y = firstDerivative(j), z = firstDerivative(k);
  return secondDerivative(i) + secondDerivative(j) + secondDerivative(k) + 2 * (x * y + y * z + z * x);
}

/// Adds the range of slope · t + square · L_2(t) for t in [−1, 1] to the enclosure's range.
void addParabola(Enclosure& enclosure, double slope, double square) {
  const auto [low, high] = std::minmax({square - slope, square + slope});
  const bool hasVertex = std::abs(slope) < 3 * std::abs(square);
  const double vertex = hasVertex ? -slope * slope / (6 * square) - square / 2 : low;
  enclosure.min += std::min(low, vertex);
  enclosure.max += std::max(high, vertex);
}

/// Returns the linear function of a cell that fits the centres of its parts.
Vector3 slopeBetween(const Parts& parts, double offset) {
  Vector3 slope = Vector3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    std::array<double, 2> sum{}, count{};
    for (int number = 0; number < 8; ++number) {
      if (!parts[number]) continue;
      const int side = number >> axis & 1;
      sum[side] += (parts[number]->lower + parts[number]->upper) / 2;
      ++count[side];
    }
    if (count[0] > 0 && count[1] > 0) slope[axis] = (sum[1] / count[1] - sum[0] / count[0]) / (2 * offset);
  }
  return slope;
}

}  // namespace

Enclosure enclosureOf(const std::vector<double>& cube, int degree) {
  Enclosure result;
  std::array<double, 3> squares{};
  double rest = 0;
  basis::forEachCoefficient(degree, [&](int i, int j, int k, int) {
    const double c = cube[basis::cubeIndex(i, j, k, degree)];
    const std::array<int, 3> order = {i, j, k};
    const int total = i + j + k;
    const auto of = [&](int n) { return std::ranges::find(order, n) - order.begin(); };
    result.bend += std::abs(c) * bendOf(i, j, k);
    if (total == 0)
      result.lower = result.upper = c;
    else if (total == 1)
      result.gradient[of(1)] = c;
    else if (total == 2 && of(2) < 3)
      squares[of(2)] = c;
    else
      rest += std::abs(c);
  });
  result.min = result.lower - rest;
  result.max = result.upper + rest;
  for (int axis = 0; axis < 3; ++axis) addParabola(result, result.gradient[axis], squares[axis]);
  result.lower -= rest;
  result.upper += rest;
  for (const double c : squares) {  // L_2 lies between −1/2 and 1
    result.lower += std::min(c, -c / 2);
    result.upper += std::max(c, -c / 2);
  }
  return result;
}

Enclosure unionOf(const Parts& parts, const PartLayout& layout) {
  Enclosure result;
  result.lower = result.min = kInfinity;
  result.upper = result.max = -kInfinity;
  result.gradient = slopeBetween(parts, layout.offset);
  for (int number = 0; number < 8; ++number) {
    if (!parts[number]) continue;
    const Enclosure& part = *parts[number];
    double centre = 0;  // the cell's linear function at the centre of the part
    for (int axis = 0; axis < 3; ++axis)
      centre += (number >> axis & 1 ? layout.offset : -layout.offset) * result.gradient[axis];
    const Vector3 slope = layout.unit * result.gradient;
    const double tilt = layout.reach * (part.gradient - slope).lpNorm<1>(), climb = layout.reach * slope.lpNorm<1>();
    result.lower = std::min(result.lower, std::max(part.lower - tilt, part.min - climb) - centre);
    result.upper = std::max(result.upper, std::min(part.upper + tilt, part.max + climb) - centre);
    result.min = std::min(result.min, part.min);
    result.max = std::max(result.max, part.max);
    result.noise = std::max(result.noise, part.noise);
    result.error = std::max(result.error, part.error);
    result.isSignUncertain |= part.isSignUncertain;
  }
  return result;
}

void tighten(Enclosure& enclosure, const Enclosure& other) {
  enclosure.min = std::max(enclosure.min, other.min);
  enclosure.max = std::min(enclosure.max, other.max);
}

}  // namespace hpsdf::range
