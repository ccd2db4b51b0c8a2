#include "field/query/float_coefficients.h"

#include <algorithm>
#include <cmath>

#include "basis/projection.h"
#include "field/query/evaluate.h"

namespace hpsdf::query {
namespace {

template <typename To, typename From>
void convert(FieldData& field) {
  const auto* from = std::get_if<std::vector<From>>(&field.coefficients);
  if (from == nullptr) return;
  std::vector<To> to(from->size());
  std::ranges::transform(*from, to.begin(), [](From c) { return static_cast<To>(c); });
  field.coefficients = std::move(to);
}

}  // namespace

Rounding floatRounding(const FieldData& field) {
  const auto& coefficients = std::get<std::vector<double>>(field.coefficients);
  Rounding rounding;
  double sum = 0;
  visitNodes(field, [&](const OctreeNode& at) {
    const std::uint64_t bits = field.nodes[at.node];
    if (!node::isLeaf(bits) || node::isExact(bits)) return true;
    const double* c = &coefficients[node::offset(bits)];
    double squares = 0, max = 0;
    basis::forEachCoefficient(node::degree(bits), [&](int i, int j, int k, int index) {
      const double change = c[index] - double(float(c[index]));
      squares += change * change * basis::squaredNorm(i, j, k);
      max += std::abs(change);
    });
    rounding.max = std::max(rounding.max, max);
    sum += squares * cellSize(field, at.depth).prod();
    return true;
  });
  rounding.rms = std::sqrt(sum / field.domain.sizes().prod());
  return rounding;
}

bool hasFloatVertices(const ExactTriangles& exact) {
  const auto* vertices = std::get_if<std::vector<Eigen::Vector3d>>(&exact.vertices);
  return vertices == nullptr ||
         std::ranges::all_of(*vertices, [](const Eigen::Vector3d& v) { return v.cast<float>().cast<double>() == v; });
}

void roundVertices(ExactTriangles& exact) {
  const auto* vertices = std::get_if<std::vector<Eigen::Vector3d>>(&exact.vertices);
  if (vertices == nullptr) return;
  std::vector<Eigen::Vector3f> rounded(vertices->size());
  std::ranges::transform(*vertices, rounded.begin(), [](const Eigen::Vector3d& v) { return v.cast<float>().eval(); });
  exact.vertices = std::move(rounded);
}

void toFloat(FieldData& field) { convert<float, double>(field); }
void toDouble(FieldData& field) { convert<double, float>(field); }

}  // namespace hpsdf::query
