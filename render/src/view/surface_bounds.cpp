#include "view/surface_bounds.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace hpsdf::render {
namespace {

constexpr double kWiden = 4e-6;  // some rounding errors of single precision, relative to the sum of the coefficients

/// Largest |L_i'| and |L_i''| on [-1, 1]: at its ends.
double firstDerivative(int i) { return 0.5 * i * (i + 1); }
double secondDerivative(int i) { return 0.125 * (i - 1) * i * (i + 1) * (i + 2); }

template <typename T>
std::array<float, 4> linearPart(const T* c, int degree) {
  if (degree == 0) return {0, 0, 0, float(c[0])};
  // in lexicographic order
  const int x = coefficientCount(degree) - coefficientCount(degree - 1);
  return {float(c[x]), float(c[degree + 1]), float(c[1]), float(c[0])};
}

template <typename T>
NodeBounds leafBounds(const T* c, int degree) {
  double sum = 0;
  double rest = 0;
  Vector3 bend = Vector3::Zero();
  Vector3 pure = Vector3::Zero();   // second derivatives xx, yy, zz
  Vector3 mixed = Vector3::Zero();  // yz, zx, xy
  const T* next = c;
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; j <= degree - i; ++j)
      for (int k = 0; k <= degree - i - j; ++k) {
        const double magnitude = std::abs(double(*next++));
        sum += magnitude;
        if (i + j + k < 2) continue;
        rest += magnitude;
        const Vector3 first(firstDerivative(i), firstDerivative(j), firstDerivative(k));
        bend += magnitude * first;
        pure += magnitude * Vector3(secondDerivative(i), secondDerivative(j), secondDerivative(k));
        mixed += magnitude * Vector3(first.y() * first.z(), first.z() * first.x(), first.x() * first.y());
      }
  const double mean = c[0];
  const double range = sum - std::abs(mean) + kWiden * sum;
  // the Frobenius norm of the bounds is none below the matrix's own
  const double curve = std::sqrt(pure.squaredNorm() + 2 * mixed.squaredNorm());
  return {.lo = static_cast<float>(mean - range),
          .hi = static_cast<float>(mean + range),
          .bend = static_cast<float>(bend.norm() * (1 + kWiden) + kWiden * sum),
          .rest = static_cast<float>(rest + kWiden * sum),
          .curve = static_cast<float>(curve * (1 + kWiden) + kWiden * sum),
          .linear = linearPart(c, degree)};
}

}  // namespace

std::vector<NodeBounds> nodeBounds(const FieldData& field, const std::vector<ZoneBounds>& zones) {
  std::vector<NodeBounds> bounds(field.nodes.size());
  std::visit(
      [&](const auto& coefficients) {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bounds.size()), [&](const auto& range) {
          for (std::size_t n = range.begin(); n < range.end(); ++n) {
            if (!node::isLeaf(field.nodes[n])) continue;
            bounds[n] = leafBounds(coefficients.data() + node::offset(field.nodes[n]), node::degree(field.nodes[n]));
            if (zones.empty()) continue;
            bounds[n].lo -= zones[n].apart;
            bounds[n].hi += zones[n].apart;
          }
        });
      },
      field.coefficients);
  // children stand behind their parents
  for (std::size_t n = bounds.size(); n-- > 0;) {
    if (node::isLeaf(field.nodes[n])) continue;
    const NodeBounds* children = &bounds[node::firstChild(field.nodes[n])];
    bounds[n] = {.lo = children[0].lo, .hi = children[0].hi, .bend = -1, .rest = 0, .curve = 0, .linear = {}};
    for (int child = 1; child < 8; ++child) {
      bounds[n].lo = std::min(bounds[n].lo, children[child].lo);
      bounds[n].hi = std::max(bounds[n].hi, children[child].hi);
    }
  }
  return bounds;
}

std::uint32_t packOutwards(float lo, float hi) {
  // dropping a float's lower half rounds towards zero; one more in the upper half is the next such number away from it
  const auto half = [](float x, bool awayFromZero) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
    return (bits >> 16) + (awayFromZero && (bits & 0xffff) != 0 ? 1 : 0);
  };
  return half(hi, hi > 0) << 16 | half(lo, lo < 0);
}

}  // namespace hpsdf::render
