#include "field/cells/build_tree.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "field/cells/exact_lists.h"
#include "field/query/float_coefficients.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {

Box BuildTree::boxOf(const CellPlace& place) const {
  const double scale = std::ldexp(1.0, -int(place.depth));
  Vector3 lo, hi;
  for (int axis = 0; axis < 3; ++axis) {
    const double origin = domain.min()[axis];
    const double size = domain.max()[axis] - origin;
    lo[axis] = origin + place.index[axis] * scale / grid[axis] * size;
    hi[axis] = origin + (place.index[axis] + 1.0) * scale / grid[axis] * size;
  }
  return Box(lo, hi);
}

void BuildTree::addBaseCells() {
  nodes.resize(baseCells());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    nodes[n].cellIndex = {static_cast<std::uint32_t>(n % grid[0]), static_cast<std::uint32_t>(n / grid[0] % grid[1]),
                          static_cast<std::uint32_t>(n / grid[0] / grid[1])};
  }
}

void BuildTree::setChildIndices(std::uint32_t parent) {
  const BuildNode& above = nodes[parent];
  for (std::uint32_t child = 0; child < 8; ++child) {
    const CellPlace place = CellPlace{above.depth, above.cellIndex}.child(child);
    nodes[above.firstChild + child].depth = place.depth;
    nodes[above.firstChild + child].cellIndex = place.index;
  }
}

void requireRoomForChildren(std::size_t nodes) {
  if (nodes > 0xffffffffu - 8)
    throw Error("the field needs more than 2^32 cells; raise the target error or lower the maximum depth");
}

void BuildTree::split(std::uint32_t leaf, std::array<Fit, 8>&& children, Fit own) {
  requireRoomForChildren(nodes.size());
  const auto first = static_cast<std::uint32_t>(nodes.size());
  nodes[leaf].firstChild = first;
  nodes[leaf].fit = std::move(own);
  for (Fit& child : children) nodes.emplace_back().fit = std::move(child);
  setChildIndices(leaf);
}

double bytesOf(const TriangleList& list) {
  return double(list.triangles.size() * (sizeof(list.triangles[0]) + sizeof(list.octants[0])));
}

static std::size_t countCoefficients(const BuildTree& tree) {
  std::size_t count = 0;
  for (const BuildNode& node : tree.nodes)
    if (node.firstChild == 0) count += node.fit.coefficients.size();
  if (count > 0xffffffffu)
    throw Error("the field needs " + std::to_string(count) + " coefficients, more than 2^32; raise the target error");
  return count;
}

/// Returns a packer that knows which triangles the exact leaves use, or std::nullopt if there are no exact leaves.
static std::optional<ExactListPacker> makePacker(const BuildTree& tree, const TriangleSearch* search) {
  std::optional<ExactListPacker> packer;
  for (const BuildNode& node : tree.nodes) {
    if (node.firstChild != 0 || !node.fit.isExact()) continue;
    if (!packer) packer.emplace(*search);
    packer->mark(node.fit.list);
  }
  return packer;
}

ExactSize exactSize(const BuildTree& tree, const TriangleSearch* search, CoefficientType type) {
  std::optional<ExactListPacker> packer = makePacker(tree, search);
  ExactSize size;
  if (!packer) return size;
  for (const BuildNode& node : tree.nodes) {
    if (node.firstChild != 0 || !node.fit.isExact()) continue;
    packer->pack(node.fit.list, node.fit.sign);
    size.inTree += bytesOf(node.fit.list);
  }
  const ExactTriangles exact = packer->finish();
  const bool isFloat =
      query::hasFloatVertices(exact) || (type != CoefficientType::float64 && query::mayRoundVertices(exact));
  const std::size_t vertices = std::get<std::vector<Eigen::Vector3d>>(exact.vertices).size();
  size.inField = double(exact.lists.size() * sizeof(exact.lists[0])) +
                 double(exact.triangles.size() * sizeof(exact.triangles[0])) +
                 double(vertices * (isFloat ? sizeof(Eigen::Vector3f) : sizeof(Eigen::Vector3d)));
  return size;
}

/// Does what `layOut` does. Calls release(n) once the fit of the node with number n has been copied.
template <typename Release>
static FieldData layOutTree(const BuildTree& tree, FieldMetadata metadata, const TriangleSearch* search,
                            const Release& release) {
  FieldData data;
  data.domain = tree.domain;
  data.grid = tree.grid;
  data.nodes.resize(tree.nodes.size());
  std::vector<double> coefficients;
  coefficients.reserve(countCoefficients(tree));
  std::optional<ExactListPacker> packer = makePacker(tree, search);

  const std::size_t baseCells = tree.baseCells();
  auto nextGroup = static_cast<std::uint32_t>(baseCells);
  struct Pair {
    std::uint32_t from, to;
  };
  std::vector<Pair> stack;
  for (std::uint32_t base = 0; base < baseCells; ++base) {
    stack.push_back({base, base});
    while (!stack.empty()) {
      const Pair pair = stack.back();
      stack.pop_back();
      const BuildNode& node = tree.nodes[pair.from];
      if (node.firstChild == 0 && node.fit.isElsewhere()) {
        data.nodes[pair.to] = node::exactLeaf({}, 0);
        continue;
      }
      if (node.firstChild == 0 && node.fit.isExact()) {
        data.nodes[pair.to] = node::exactLeaf(node.fit.sign.rule, packer->pack(node.fit.list, node.fit.sign));
        release(pair.from);
        continue;
      }
      if (node.firstChild == 0) {
        data.nodes[pair.to] = node::leaf(node.fit.degree, static_cast<std::uint32_t>(coefficients.size()));
        coefficients.insert(coefficients.end(), node.fit.coefficients.begin(), node.fit.coefficients.end());
        release(pair.from);
        continue;
      }
      data.nodes[pair.to] = node::internal(nextGroup);
      for (std::uint32_t child = 8; child-- > 0;) stack.push_back({node.firstChild + child, nextGroup + child});
      nextGroup += 8;
    }
  }

  data.coefficients = std::move(coefficients);
  if (packer) data.exact = packer->finish();
  data.metadata = std::move(metadata);
  return data;
}

FieldData layOut(const BuildTree& tree, FieldMetadata metadata, const TriangleSearch* search) {
  return layOutTree(tree, std::move(metadata), search, [](std::uint32_t) {});
}

FieldData layOut(BuildTree&& tree, FieldMetadata metadata, const TriangleSearch* search) {
  return layOutTree(tree, std::move(metadata), search, [&](std::uint32_t n) { tree.nodes[n].fit = Fit{}; });
}

}  // namespace hpsdf::detail
