#include "field/build_tree.h"

#include <cmath>
#include <string>
#include <utility>

#include "basis/projection.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

/// Squared L2 norm of the change that rounding to float makes to one cell, over the cell's volume.
double squaredRounding(std::span<const double> coefficients, int degree) {
  double sum = 0;
  forEachCoefficient(degree, [&](int i, int j, int k, int index) {
    const double change = coefficients[index] - double(float(coefficients[index]));
    sum += change * change * squaredNorm(i, j, k);
  });
  return sum;
}

}  // namespace

Box BuildTree::boxOf(const BuildNode& node) const {
  const double scale = std::ldexp(1.0, -int(node.depth));
  Vector3 lo, hi;
  for (int axis = 0; axis < 3; ++axis) {
    const double origin = domain.min()[axis];
    const double size = domain.max()[axis] - origin;
    lo[axis] = origin + node.place[axis] * scale / grid[axis] * size;
    hi[axis] = origin + (node.place[axis] + 1.0) * scale / grid[axis] * size;
  }
  return Box(lo, hi);
}

void BuildTree::split(std::uint32_t leaf, std::array<Fit, 8>&& children, Fit own) {
  const auto first = static_cast<std::uint32_t>(nodes.size());
  nodes[leaf].firstChild = first;
  nodes[leaf].fit = std::move(own);
  for (std::uint32_t child = 0; child < 8; ++child) {
    BuildNode node;
    node.depth = nodes[leaf].depth + 1;
    for (int axis = 0; axis < 3; ++axis) node.place[axis] = 2 * nodes[leaf].place[axis] + ((child >> axis) & 1);
    node.fit = std::move(children[child]);
    nodes.push_back(std::move(node));
  }
}

FieldData freeze(BuildTree&& tree, CoefficientType type, FieldMetadata metadata) {
  FieldData data;
  data.domain = tree.domain;
  data.grid = tree.grid;
  data.nodes.resize(tree.nodes.size());
  std::vector<double> coefficients;
  std::size_t total = 0;
  for (const BuildNode& node : tree.nodes)
    if (node.firstChild == 0) total += node.fit.coefficients.size();
  if (total > 0xffffffffu)
    throw Error("the field needs " + std::to_string(total) + " coefficients, more than 2^32; raise the target error");
  coefficients.reserve(total);

  const std::size_t baseCells = tree.baseCells();
  double rounding = 0;
  auto nextGroup = static_cast<std::uint32_t>(baseCells);
  struct Pair {
    std::uint32_t from, to;
  };
  std::vector<Pair> stack;
  for (std::uint32_t base = 0; base < baseCells; ++base) {
    stack.push_back({base, base});
    while (!stack.empty()) {
      const Pair at = stack.back();
      stack.pop_back();
      BuildNode& node = tree.nodes[at.from];
      if (node.firstChild == 0) {
        data.nodes[at.to] = node::leaf(node.fit.degree, static_cast<std::uint32_t>(coefficients.size()));
        rounding += squaredRounding(node.fit.coefficients, node.fit.degree) * tree.boxOf(node).sizes().prod();
        coefficients.insert(coefficients.end(), node.fit.coefficients.begin(), node.fit.coefficients.end());
        node.fit = Fit{};
        continue;
      }
      data.nodes[at.to] = node::internal(nextGroup);
      for (std::uint32_t child = 8; child-- > 0;) stack.push_back({node.firstChild + child, nextGroup + child});
      nextGroup += 8;
    }
  }

  const double roundingRms = std::sqrt(rounding / tree.domain.sizes().prod());
  const bool single = type == CoefficientType::float32 ||
                      (type == CoefficientType::automatic && roundingRms < 0.01 * metadata.rmsEstimate(tree.domain));
  if (single) {
    metadata.roundingRms = roundingRms;
    std::vector<float> rounded(coefficients.size());
    for (std::size_t i = 0; i < coefficients.size(); ++i) rounded[i] = static_cast<float>(coefficients[i]);
    data.coefficients = std::move(rounded);
  } else {
    metadata.roundingRms = 0;
    data.coefficients = std::move(coefficients);
  }
  data.metadata = std::move(metadata);
  return data;
}

}  // namespace hpsdf
