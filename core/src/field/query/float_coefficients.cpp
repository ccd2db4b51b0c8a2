#include "field/query/float_coefficients.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "basis/projection.h"
#include "field/query/evaluate.h"
#include "hpsdf/error.h"

namespace hpsdf::query {
namespace {

template <typename To, typename From>
void convert(FieldData& field) {
  const auto* from = std::get_if<FieldArray<From>>(&field.coefficients);
  if (from == nullptr) return;
  std::vector<To> to(from->size());
  std::ranges::transform(from->all(), to.begin(), [](From c) { return static_cast<To>(c); });
  field.coefficients = std::move(to);
}

const std::vector<Eigen::Vector3d>* doubleVertices(const ExactTriangles& exact) {
  return std::get_if<std::vector<Eigen::Vector3d>>(&exact.vertices);
}

/// Returns the change of a field with double coefficients by rounding. rounded(node, c) returns a pointer to the
/// rounded coefficients of a leaf, whose own are c.
template <typename Rounded>
Rounding roundingOf(const FieldData& field, const detail::AcrossParts& parts, const Rounded& rounded) {
  const std::span<const double> coefficients = std::get<FieldArray<double>>(field.coefficients).all();
  Rounding rounding;
  const double ofVertices = vertexRounding(field.exact);
  rounding.max = ofVertices;
  detail::ExactSum sum;
  visitNodes(field, [&](const OctreeNode& at) {
    const std::uint64_t bits = field.nodes[at.node];
    if (node::isExact(bits)) sum.add(ofVertices * ofVertices * cellSize(field, at.depth).prod());
    if (!node::isLeaf(bits) || node::isExact(bits)) return true;
    const double* c = &coefficients[node::offset(bits)];
    const auto* after = rounded(at.node, c);
    double squares = 0, max = 0;
    basis::forEachCoefficient(node::degree(bits), [&](int i, int j, int k, int index) {
      const double change = c[index] - double(after[index]);
      squares += change * change * basis::squaredNorm(i, j, k);
      max += std::abs(change);
    });
    rounding.max = std::max(rounding.max, max);
    sum.add(squares * cellSize(field, at.depth).prod());
    return true;
  });
  parts.add(sum);
  rounding.max = parts.greatest(rounding.max);
  rounding.rms = std::sqrt(sum.value() / field.domain.sizes().prod());
  return rounding;
}

}  // namespace

double vertexRounding(const ExactTriangles& exact) {
  const auto* vertices = doubleVertices(exact);
  if (vertices == nullptr || !mayRoundVertices(exact)) return 0;
  double greatest = 0;
  for (const Eigen::Vector3d& vertex : *vertices) greatest = std::max(greatest, (throughFloat(vertex) - vertex).norm());
  return greatest;
}

Rounding floatRounding(const FieldData& field, const detail::AcrossParts& parts) {
  std::vector<float> rounded;
  return roundingOf(field, parts, [&](std::uint32_t node, const double* c) {
    rounded.assign(c, c + coefficientCount(node::degree(field.nodes[node])));
    return rounded.data();
  });
}

Rounding quantizedRounding(const FieldData& field, std::span<const std::uint64_t> nodes,
                           const QuantizedCoefficients& coefficients, const detail::AcrossParts& parts) {
  std::vector<double> rounded(coefficientCount(kMaxDegree));
  return roundingOf(field, parts, [&](std::uint32_t node, const double*) {
    decodeLeaf(coefficients, nodes[node], rounded.data());
    return rounded.data();
  });
}

double throughFloat(double number) { return static_cast<float>(number); }

Vector3 throughFloat(const Vector3& vertex) {
  return {throughFloat(vertex.x()), throughFloat(vertex.y()), throughFloat(vertex.z())};
}

bool hasFloatVertices(const ExactTriangles& exact) {
  const auto* vertices = doubleVertices(exact);
  return vertices == nullptr ||
         std::ranges::all_of(*vertices, [](const Eigen::Vector3d& v) { return throughFloat(v) == v; });
}

bool mayRoundVertices(const ExactTriangles& exact) {
  constexpr double kGreatestTurn = 0.1;  // greatest change of a unit normal
  const auto* vertices = doubleVertices(exact);
  if (vertices == nullptr) return true;
  return std::ranges::all_of(exact.triangles, [&](const std::array<std::uint32_t, 3>& triangle) {
    const Eigen::Vector3d &a = (*vertices)[triangle[0]], &b = (*vertices)[triangle[1]], &c = (*vertices)[triangle[2]];
    const Eigen::Vector3d before = (b - a).cross(c - a);
    const Eigen::Vector3d after = (throughFloat(b) - throughFloat(a)).cross(throughFloat(c) - throughFloat(a));
    return (before.normalized() - after.normalized()).norm() <= kGreatestTurn;  // a vector without length stays 0
  });
}

void roundVertices(ExactTriangles& exact) {
  const auto* vertices = doubleVertices(exact);
  if (vertices == nullptr || !mayRoundVertices(exact)) return;
  std::vector<Eigen::Vector3f> floats(vertices->size());
  std::ranges::transform(*vertices, floats.begin(), [](const Eigen::Vector3d& v) { return v.cast<float>().eval(); });
  exact.vertices = std::move(floats);
}

void toFloat(FieldData& field) { convert<float, double>(field); }

void toDouble(FieldData& field) {
  convert<double, float>(field);
  const auto* quantized = std::get_if<QuantizedCoefficients>(&field.coefficients);
  if (quantized == nullptr) return;
  std::vector<double> coefficients;
  for (std::uint64_t& node : field.nodes) {
    if (!node::isLeaf(node) || node::isExact(node)) continue;
    const std::size_t offset = coefficients.size();
    const int degree = node::degree(node);
    if (offset + std::size_t(coefficientCount(degree)) > 0xffffffff)
      throw Error("the field has more than 2^32 coefficients, which are too many unless they are quantized");
    coefficients.resize(offset + coefficientCount(degree));
    decodeLeaf(*quantized, node, &coefficients[offset]);
    node = node::leaf(degree, std::uint32_t(offset));
  }
  field.coefficients = std::move(coefficients);
}

}  // namespace hpsdf::query
