#include "field/query/float_coefficients.h"

#include <algorithm>
#include <cmath>

#include "basis/projection.h"
#include "field/query/evaluate.h"
#include "field/query/visit_nodes.h"

namespace hpsdf {
namespace {

template <typename To, typename From>
void convert(FieldData& field) {
  const auto* from = std::get_if<std::vector<From>>(&field.coefficients);
  if (from == nullptr) return;
  std::vector<To> to(from->size());
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = static_cast<To>((*from)[i]);
  field.coefficients = std::move(to);
}

}  // namespace

Rounding roundingOf(const FieldData& field) {
  const auto& coefficients = std::get<std::vector<double>>(field.coefficients);
  Rounding rounding;
  double sum = 0;
  visitNodes(field, [&](const Visited& at) {
    const std::uint64_t bits = field.nodes[at.node];
    if (!node::isLeaf(bits)) return true;
    const double* c = &coefficients[node::offset(bits)];
    double ofCell = 0, most = 0;
    forEachCoefficient(node::degree(bits), [&](int i, int j, int k, int index) {
      const double change = c[index] - double(float(c[index]));
      ofCell += change * change * squaredNorm(i, j, k);
      most += std::abs(change);
    });
    rounding.most = std::max(rounding.most, most);
    sum += ofCell * cellSize(field, at.depth).prod();
    return true;
  });
  rounding.rms = std::sqrt(sum / field.domain.sizes().prod());
  return rounding;
}

void toFloat(FieldData& field) { convert<float, double>(field); }
void toDouble(FieldData& field) { convert<double, float>(field); }

}  // namespace hpsdf
