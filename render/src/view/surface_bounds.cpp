#include "view/surface_bounds.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "view/exact_leaf.h"
#include "view/grid_space.h"

namespace hpsdf::render {
namespace {

/// Greatest magnitudes of the derivatives L_i' and L_i'' of a Legendre polynomial on [−1, 1], at the interval's ends.
double firstDerivative(int i) { return 0.5 * i * (i + 1); }
double secondDerivative(int i) { return 0.125 * (i - 1) * i * (i + 1) * (i + 2); }

template <typename T>
std::array<float, 4> linearPart(const T* c, int degree) {
  if (degree == 0) return {0, 0, 0, float(c[0])};
  // The coefficients c_ijk are in lexicographic order, in which c_100 has the index x.
  const int x = coefficientCount(degree) - coefficientCount(degree - 1);
  return {float(c[x]), float(c[degree + 1]), float(c[1]), float(c[0])};
}

template <typename T>
SurfaceBounds leafBounds(const T* c, int degree) {
  // Sum the magnitudes of the coefficients, multiplied by the greatest derivatives of their basis functions.
  double sum = 0;
  double nonlinear = 0;
  Vector3 gradient = Vector3::Zero();  // bound of the nonlinear part's gradient
  Vector3 pure = Vector3::Zero();      // bounds of the second derivatives xx, yy, zz
  Vector3 mixed = Vector3::Zero();     // bounds of the second derivatives yz, zx, xy
  const T* next = c;
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; j <= degree - i; ++j)
      for (int k = 0; k <= degree - i - j; ++k) {
        const double magnitude = std::abs(double(*next++));
        sum += magnitude;
        if (i + j + k < 2) continue;
        nonlinear += magnitude;
        const Vector3 first(firstDerivative(i), firstDerivative(j), firstDerivative(k));
        gradient += magnitude * first;
        pure += magnitude * Vector3(secondDerivative(i), secondDerivative(j), secondDerivative(k));
        mixed += magnitude * Vector3(first.y() * first.z(), first.z() * first.x(), first.x() * first.y());
      }
  const double rounding = kFloatRounding * sum;
  const auto widened = [&](double bound) { return static_cast<float>(bound * (1 + kFloatRounding) + rounding); };
  const double mean = c[0];
  const double range = sum - std::abs(mean) + rounding;
  // Bound the Hessian's spectral norm by the Frobenius norm of a matrix of upper bounds of the Hessian's entries.
  const double hessian = std::sqrt(pure.squaredNorm() + 2 * mixed.squaredNorm());
  return {.lo = static_cast<float>(mean - range),
          .hi = static_cast<float>(mean + range),
          .gradientDeviation = widened(gradient.norm()),
          .valueDeviation = static_cast<float>(nonlinear + rounding),
          .secondDerivative = widened(hessian),
          .linear = linearPart(c, degree)};
}

/// Bounds of an exact leaf whose distance at the centre is `central`. `half` is half of the leaf's box. A distance
/// changes by at most the length of the way, so that the linear part is the value at the centre alone.
SurfaceBounds exactLeafBounds(double central, const Vector3& half, double rounding) {
  const double range = half.norm() * (1 + kFloatRounding) + rounding;
  return {.lo = static_cast<float>(central - range),
          .hi = static_cast<float>(central + range),
          .gradientDeviation = static_cast<float>(half.maxCoeff() * (1 + kFloatRounding)),
          .valueDeviation = static_cast<float>(range),
          .secondDerivative = kExactCurve,
          .linear = {0, 0, 0, static_cast<float>(central)}};
}

/// Sets the bounds of the exact leaves below a node. `half` is half of the node's box.
void setExactBounds(const FieldData& field, std::uint32_t n, const Vector3& centre, const Vector3& half,
                    std::vector<SurfaceBounds>& bounds) {
  const std::uint64_t bits = field.nodes[n];
  if (node::isExact(bits)) {
    const double central = evaluateExactLeaf(field.exact, bits, centre).value;
    bounds[n] = exactLeafBounds(central, half, kFloatRounding * (std::abs(central) + field.domain.sizes().norm()));
  }
  if (node::isLeaf(bits)) return;
  for (std::uint32_t child = 0; child < 8; ++child) {
    const Vector3 side(child & 1 ? 0.5 : -0.5, child & 2 ? 0.5 : -0.5, child & 4 ? 0.5 : -0.5);
    setExactBounds(field, node::firstChild(bits) + child, centre + side.cwiseProduct(half), half / 2, bounds);
  }
}

/// Sets the bounds of all exact leaves.
void setExactBounds(const FieldData& field, std::vector<SurfaceBounds>& bounds) {
  if (field.exact.empty()) return;
  const GridSpace space(field);
  const Vector3 cell = space.size.cwiseQuotient(space.grid);
  const std::size_t cells = std::size_t(field.grid[0]) * field.grid[1] * field.grid[2];
  tbb::parallel_for(std::size_t{0}, cells, [&](std::size_t n) {
    const Vector3 corner(double(n % field.grid[0]), double(n / field.grid[0] % field.grid[1]),
                         double(n / field.grid[0] / field.grid[1]));
    setExactBounds(field, static_cast<std::uint32_t>(n),
                   space.lo + (corner + Vector3::Constant(0.5)).cwiseProduct(cell), cell / 2, bounds);
  });
}

}  // namespace

std::vector<SurfaceBounds> surfaceBounds(const FieldData& field, const std::vector<BlendZoneBounds>& zones) {
  std::vector<SurfaceBounds> bounds(field.nodes.size());
  // Compute the bounds of all leaves.
  setExactBounds(field, bounds);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bounds.size()), [&](const auto& range) {
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      const std::uint64_t bits = field.nodes[n];
      if (!node::isLeaf(bits)) continue;
      if (!node::isExact(bits))
        bounds[n] = withCoefficients(field, bits, [&](const auto* c) { return leafBounds(c, node::degree(bits)); });
      if (zones.empty()) continue;
      bounds[n].lo -= zones[n].valueDifference;
      bounds[n].hi += zones[n].valueDifference;
    }
  });
  // Set the range of each parent to the union of its children's ranges. The loop runs backwards because children
  // follow their parents.
  for (std::size_t n = bounds.size(); n-- > 0;) {
    if (node::isLeaf(field.nodes[n])) continue;
    const SurfaceBounds* children = &bounds[node::firstChild(field.nodes[n])];
    SurfaceBounds& parent = bounds[n];
    parent = children[0];
    for (int child = 1; child < 8; ++child) {
      parent.lo = std::min(parent.lo, children[child].lo);
      parent.hi = std::max(parent.hi, children[child].hi);
    }
    parent = {parent.lo, parent.hi, -1, 0, 0, {}};
  }
  return bounds;
}

std::uint32_t packOutwards(float lo, float hi) {
  // Keep the upper half of a float's bits. Dropping the lower half rounds towards zero, and adding one to the
  // upper half rounds away from zero.
  const auto half = [](float x, bool awayFromZero) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
    return (bits >> 16) + (awayFromZero && (bits & 0xffff) != 0 ? 1 : 0);
  };
  return half(hi, hi > 0) << 16 | half(lo, lo < 0);
}

}  // namespace hpsdf::render
