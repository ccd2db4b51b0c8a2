#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "combine/boolean_surface.h"
#include "combine/boolean_tree.h"
#include "combine/similarity.h"
#include "hpsdf/combine/expression.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/field.h"

namespace hpsdf::combine {

/// Values at some points, and gradients if these are asked for; else the gradients are empty.
struct Samples {
  std::span<double> values;
  std::span<Vector3> gradients;

  bool hasGradients() const { return !gradients.empty(); }
  std::size_t size() const { return values.size(); }
};

/// On which sides of the surface values are exact.
struct ExactSides {
  bool outside = false, inside = false;

  Exactness exactness() const;
};

/// A part of an expression that is ready to be evaluated. Thread-safe.
class DistanceNode {
 public:
  virtual ~DistanceNode() = default;

  /// Evaluates the samples at the points. Gradients may be asked for if `hasGradients` is true.
  virtual void evaluate(std::span<const Vector3> points, const Samples& out) const = 0;

  Box box = {};  ///< holds the surface; empty if it is unknown
  ExactSides exactSides = {};
  bool hasGradients = false;  ///< gradients can be asked for
  std::size_t bytes = 0;
};

using NodePtr = std::unique_ptr<const DistanceNode>;

/// The distance to one mesh.
NodePtr meshNode(std::shared_ptr<const ExactDistance> distance);

/// The exact distance of a Boolean expression of meshes, of which `boundary` is the boundary.
NodePtr booleanNode(std::vector<MeshSolid> solids, BooleanTree tree, const TriangleMesh& boundary);

NodePtr fieldNode(std::shared_ptr<const Field> field, const Similarity& placement);

/// The distance of a function. Where a domain is given, the function is known in it only, and the solid ends at its
/// walls.
NodePtr functionNode(std::shared_ptr<const DistanceFunction> function, const Similarity& placement, const Box& domain);

/// A union or an intersection by values, sharp where the radius is 0.
NodePtr uniteNode(std::vector<NodePtr> operands, double radius);
NodePtr intersectNode(std::vector<NodePtr> operands, double radius);
/// The first operand without the others.
NodePtr subtractNode(std::vector<NodePtr> operands, double radius);

NodePtr offsetNode(NodePtr solid, double distance);
NodePtr shellNode(NodePtr solid, double thickness, ShellSide side);

}  // namespace hpsdf::combine
