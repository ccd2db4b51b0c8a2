#include "hpsdf/combine/combined_distance.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "combine/boolean_surface.h"
#include "combine/distance_node.h"
#include "combine/expression_words.h"
#include "combine/similarity.h"
#include "hpsdf/detail/threads.h"

namespace hpsdf {
namespace combine {
namespace {

/// A Boolean expression of meshes, whose boundary is not made yet.
struct BooleanSolid {
  std::vector<MeshSolid> solids;
  BooleanTree tree;
};

/// A part of an expression: either a Boolean expression of meshes, or a node.
struct CompiledPart {
  std::optional<BooleanSolid> solid = {};
  NodePtr node = {};
};

/// Returns one Boolean expression of several.
BooleanSolid joined(BooleanTree::Kind kind, std::vector<BooleanSolid> parts) {
  BooleanSolid all{.solids = {}, .tree = {.kind = kind}};
  for (BooleanSolid& part : parts) {
    const auto first = static_cast<std::uint32_t>(all.solids.size());
    part.tree.renumber([first](std::uint32_t solid) { return first + solid; });
    std::ranges::move(part.solids, std::back_inserter(all.solids));
    all.tree.children.push_back(std::move(part.tree));
  }
  return all;
}

/// Keeps each solid once, also where the expression names it several times in one place.
void unify(BooleanSolid& all) {
  std::map<const ExactDistance*, std::uint32_t> numberOf;
  std::vector<MeshSolid> once;
  std::vector<std::uint32_t> numbers;
  for (MeshSolid& solid : all.solids) {
    const auto [known, isNew] = numberOf.emplace(solid.distance.get(), static_cast<std::uint32_t>(once.size()));
    numbers.push_back(known->second);
    if (isNew) once.push_back(std::move(solid));
  }
  all.solids = std::move(once);
  all.tree.renumber([&](std::uint32_t solid) { return numbers[solid]; });
}

/// Returns true if an expression is that of its one solid, which its triangles bound.
bool isOneMesh(const BooleanSolid& all) {
  return all.solids.size() == 1 && all.solids[0].hasOrientedTriangles() &&
         all.tree.contains([](std::uint32_t) { return true; });
}

/// Returns the box of a leaf's solid, or an empty one if it is unknown.
Box boxOf(const Expression::Node& leaf) {
  if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleMesh>>(&leaf.operand)) return boundingBox(**mesh);
  if (const auto* field = std::get_if<std::shared_ptr<const Field>>(&leaf.operand)) return (*field)->domain();
  if (!leaf.domain.isEmpty()) return leaf.domain;
  return std::get<std::shared_ptr<const DistanceFunction>>(leaf.operand)->source().box;
}

/// Returns true if the mesh is known to be closed. Pseudonormals that a caller forces upon it prove nothing.
bool boundsSolid(const ExactDistance& distance) {
  const InsideTestChoice& choice = distance.insideTestChoice();
  if (choice.insideTest == InsideTest::pseudonormal) return !choice.reason.empty();
  return choice.insideTest == InsideTest::winding && distance.hasGradients();
}

/// Turns an expression into nodes. Transforms are passed down to the leaves, where they are applied.
class Compiler {
 public:
  Compiler(const DistanceOptions& options, const Progress& progress) : options_(options), progress_(progress) {}

  CompiledPart compile(const Expression& expression, const Similarity& placement) {
    const Expression::Node& node = expression.node();
    const std::vector<double>& numbers = node.numbers;
    switch (node.operation) {
      case Operation::operand:
        return leaf(node, placement);
      case Operation::unite:
        return grouped(compileAll(node.operands, placement), BooleanTree::Kind::unite);
      case Operation::intersect:
        return grouped(compileAll(node.operands, placement), BooleanTree::Kind::intersect);
      case Operation::subtract:
        return difference(compileAll(node.operands, placement));
      case Operation::smoothUnite:
        return {.node = uniteNode(nodesOf(compileAll(node.operands, placement)), placement.scale * numbers[0])};
      case Operation::smoothIntersect:
        return {.node = intersectNode(nodesOf(compileAll(node.operands, placement)), placement.scale * numbers[0])};
      case Operation::smoothSubtract:
        return {.node = subtractNode(nodesOf(compileAll(node.operands, placement)), placement.scale * numbers[0])};
      case Operation::offset:
        return {.node = offsetNode(nodeOf(compile(node.operands[0], placement)), placement.scale * numbers[0])};
      case Operation::shell:
        return {.node =
                    shellNode(nodeOf(compile(node.operands[0], placement)), placement.scale * numbers[0], node.side)};
      case Operation::move:
        return compile(node.operands[0], after(placement, moveBy(numbers)));
      case Operation::rotate:
        return compile(node.operands[0], after(placement, rotateBy(numbers)));
      default:
        return compile(node.operands[0], after(placement, scaleBy(numbers)));
    }
  }

  /// Returns the node of a part. Makes the boundary of a Boolean expression of meshes.
  NodePtr nodeOf(CompiledPart part) {
    if (!part.solid) return std::move(part.node);
    BooleanSolid& solid = *part.solid;
    unify(solid);
    if (isOneMesh(solid)) {
      boundary_ = solid.solids[0].mesh;
      return meshNode(std::move(solid.solids[0].distance));
    }
    boundary_ = std::make_shared<const TriangleMesh>(boundaryOf(solid.solids, solid.tree, progress_));
    return booleanNode(std::move(solid.solids), std::move(solid.tree), *boundary_);
  }

  /// Returns the boundary that the last call of `nodeOf` made.
  std::shared_ptr<const TriangleMesh> lastBoundary() const { return boundary_; }

 private:
  std::vector<CompiledPart> compileAll(const std::vector<Expression>& operands, const Similarity& placement) {
    std::vector<CompiledPart> parts;
    for (const Expression& operand : operands) parts.push_back(compile(operand, placement));
    return parts;
  }

  std::vector<NodePtr> nodesOf(std::vector<CompiledPart> parts) {
    std::vector<NodePtr> nodes;
    for (CompiledPart& part : parts) nodes.push_back(nodeOf(std::move(part)));
    return nodes;
  }

  /// Returns the union or intersection of parts. Those that are Boolean expressions of meshes become one, which is
  /// exact.
  CompiledPart grouped(std::vector<CompiledPart> parts, BooleanTree::Kind kind) {
    std::vector<BooleanSolid> solids;
    std::vector<CompiledPart> others;
    for (CompiledPart& part : parts) {
      if (part.solid)
        solids.push_back(std::move(*part.solid));
      else
        others.push_back(std::move(part));
    }
    if (solids.size() == 1) others.push_back({.solid = std::move(solids[0])});
    if (solids.size() > 1) others.push_back({.solid = joined(kind, std::move(solids))});
    if (others.size() == 1) return std::move(others[0]);
    std::vector<NodePtr> nodes = nodesOf(std::move(others));
    return {.node =
                kind == BooleanTree::Kind::unite ? uniteNode(std::move(nodes), 0) : intersectNode(std::move(nodes), 0)};
  }

  /// Returns the first part without the union of the others.
  CompiledPart difference(std::vector<CompiledPart> parts) {
    CompiledPart first = std::move(parts[0]);
    parts.erase(parts.begin());
    CompiledPart others = grouped(std::move(parts), BooleanTree::Kind::unite);
    if (first.solid && others.solid) {
      std::vector<BooleanSolid> solids;
      solids.push_back(std::move(*first.solid));
      solids.push_back(std::move(*others.solid));
      return {.solid = joined(BooleanTree::Kind::subtract, std::move(solids))};
    }
    std::vector<NodePtr> nodes;
    nodes.push_back(nodeOf(std::move(first)));
    nodes.push_back(nodeOf(std::move(others)));
    return {.node = subtractNode(std::move(nodes), 0)};
  }

  CompiledPart leaf(const Expression::Node& node, const Similarity& placement) {
    if (const auto* name = std::get_if<std::string>(&node.operand))
      throw Error(ErrorKind::option, *name, "the name of an operand stands for nothing; replace it by a solid first");
    try {
      requireUsable(placement, boxOf(node));
      return solidOf(node, placement);
    } catch (const Error& error) {
      const Error named = error.subject() == node.name ? error : Error(error.kind(), node.name, error.what());
      throw node.column == 0 ? named : expressionError(error.kind(), node.column, named.what());
    }
  }

  CompiledPart solidOf(const Expression::Node& node, const Similarity& placement) {
    if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleMesh>>(&node.operand))
      return meshLeaf(*mesh, placement);
    if (const auto* field = std::get_if<std::shared_ptr<const Field>>(&node.operand))
      return {.node = fieldNode(*field, placement)};
    return {.node =
                functionNode(std::get<std::shared_ptr<const DistanceFunction>>(node.operand), placement, node.domain)};
  }

  CompiledPart meshLeaf(const std::shared_ptr<const TriangleMesh>& mesh, const Similarity& placement) {
    MeshSolid solid = placed(mesh, placement);
    if (!boundsSolid(*solid.distance)) return {.node = meshNode(std::move(solid.distance))};
    return {.solid = BooleanSolid{.solids = {std::move(solid)}, .tree = {}}};
  }

  /// Returns a mesh in its place with the distance to it, which are made once for each place.
  MeshSolid placed(const std::shared_ptr<const TriangleMesh>& mesh, const Similarity& placement) {
    PlacementKey key = {mesh.get(), {placement.scale}};
    std::copy_n(placement.rotation.data(), 9, key.second.begin() + 1);
    std::copy_n(placement.translation.data(), 3, key.second.begin() + 10);
    if (const auto known = placed_.find(key); known != placed_.end()) return known->second;
    MeshSolid solid{.mesh = std::make_shared<const TriangleMesh>(transformed(*mesh, placement)), .distance = {}};
    DistanceOptions options = options_;
    options.thickness *= placement.scale;
    solid.distance = std::make_shared<const ExactDistance>(*solid.mesh, options, progress_);
    return placed_.emplace(key, std::move(solid)).first->second;
  }

  /// A mesh with the numbers of its placement: scale, rotation and translation.
  using PlacementKey = std::pair<const TriangleMesh*, std::array<double, 13>>;

  const DistanceOptions& options_;
  const Progress& progress_;
  std::map<PlacementKey, MeshSolid> placed_;
  std::shared_ptr<const TriangleMesh> boundary_;
};

/// Returns a text that is short enough for the name in a field's file.
std::string shortened(std::string text) {
  constexpr std::size_t kLongestName = 4000;  // bytes; field files allow 4096
  if (text.size() <= kLongestName) return text;
  std::size_t end = kLongestName;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U) --end;
  return text.substr(0, end) + "…";
}

}  // namespace
}  // namespace combine

struct CombinedDistance::Data {
  combine::NodePtr root;
  std::shared_ptr<const TriangleMesh> boundary;  ///< if the whole expression is a Boolean one of meshes
  Source source;
};

CombinedDistance::CombinedDistance(const Expression& expression, const DistanceOptions& options,
                                   const Progress& progress) {
  auto data = std::make_shared<Data>();
  withThreads(options.threads, [&] {
    combine::Compiler compiler(options, progress);
    combine::CompiledPart whole = compiler.compile(expression, {});
    const bool isBoolean = whole.solid.has_value();
    data->root = compiler.nodeOf(std::move(whole));
    if (isBoolean) data->boundary = compiler.lastBoundary();
  });
  data->source = {.name = combine::shortened(textOf(expression)),
                  .fingerprint = fingerprint(expression),
                  .box = data->root->box,
                  .exactness = data->root->exactSides.exactness()};
  data_ = std::move(data);
}

double CombinedDistance::operator()(const Vector3& x) const {
  double value = 0;
  (*this)({&x, 1}, {&value, 1});
  return value;
}

void CombinedDistance::operator()(std::span<const Vector3> points, std::span<double> out) const {
  assert(points.size() == out.size());
  data_->root->evaluate(points, {out, {}});
}

bool CombinedDistance::hasGradients() const { return data_->root->hasGradients; }

void CombinedDistance::withGradients(std::span<const Vector3> points, std::span<double> out,
                                     std::span<Vector3> gradients) const {
  assert(points.size() == out.size() && points.size() == gradients.size() && hasGradients());
  data_->root->evaluate(points, {out, gradients});
}

Exactness CombinedDistance::exactness() const { return *data_->source.exactness; }

const Source& CombinedDistance::source() const { return data_->source; }

const TriangleMesh* CombinedDistance::boundary() const { return data_->boundary.get(); }

std::size_t CombinedDistance::bytes() const { return data_->root->bytes; }

}  // namespace hpsdf
