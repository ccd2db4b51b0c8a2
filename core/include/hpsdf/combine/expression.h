#pragma once
// Expressions that combine solids: trees of Boolean operations, offsets, shells and transforms over meshes, fields and
// distance functions. In C++ they are made by functions, from text by `parseExpression`. `CombinedDistance` evaluates
// them.

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "hpsdf/combine/operation.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/field.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// The greatest depth of an expression: the number of nodes from its root to a leaf.
constexpr int kMaxExpressionDepth = 100;

/// The greatest number of leaves of an expression. Expressions in C++ that share their operands may reach it soon.
constexpr std::size_t kMaxExpressionLeaves = 1'000'000;

/// An expression, such as the union of a mesh and a field. It is an immutable value; copies share the operands. Meshes,
/// fields and distance functions convert to expressions, so that `combine::unite(mesh, field)` is one.
class Expression {
 public:
  /// A leaf is a name that `withOperands` replaces, or a solid.
  using Operand = std::variant<std::string, std::shared_ptr<const TriangleMesh>, std::shared_ptr<const Field>,
                               std::shared_ptr<const DistanceFunction>>;

  struct Node {
    Operation operation = Operation::operand;
    std::vector<Expression> operands = {};  ///< empty for a leaf
    /// The numbers behind the operands: radius of a smooth operation, distance of an offset, thickness of a shell, the
    /// three coordinates of a move, axis and angle in degrees of a rotation, the factor of a scale.
    std::vector<double> numbers = {};
    ShellSide side = ShellSide::centred;  ///< of a shell
    Operand operand = {};                 ///< of a leaf
    Box domain = {};                      ///< of a function that is known in a box only; otherwise empty
    std::string name = {};                ///< of a leaf, for messages and metadata
    std::size_t column = 0;               ///< of a leaf in the text that it was read from, from 1; 0 if there is none
    int depth = 1;
    std::size_t leaves = 1;  ///< number of leaves; one that is used several times counts each time
  };

  Expression(TriangleMesh mesh);          // NOLINT: implicit on purpose
  Expression(Field field);                // NOLINT: implicit on purpose
  Expression(DistanceFunction distance);  // NOLINT: implicit on purpose

  /// Returns a leaf with the distance of a solid that is known in a box only, such as one that a grid holds. As a field
  /// does, the solid ends at the walls of this domain, and none of its values counts as exact. An empty box stands for
  /// all of space.
  static Expression within(const Box& domain, DistanceFunction distance);

  /// Returns a leaf with a name that `withOperands` replaces by a solid. Throws `Error` for an empty name.
  static Expression named(std::string name, std::size_t column = 0);

  /// Returns an operation on other expressions. Throws `Error` (of the kind `option`, with the operation's name as its
  /// subject) for too few or too many operands or numbers, for a number that is not finite or out of range, and for an
  /// expression deeper than `kMaxExpressionDepth` or with more leaves than `kMaxExpressionLeaves`.
  static Expression operation(Operation operation, std::vector<Expression> operands, std::vector<double> numbers = {},
                              ShellSide side = ShellSide::centred);

  const Node& node() const { return *node_; }

  /// Returns the same leaf with another name, which stands in this column of a text; 0 if there is none.
  Expression renamed(std::string name, std::size_t column = 0) const;

 private:
  explicit Expression(Node node);

  std::shared_ptr<const Node> node_;
};

/// Reads an expression from text, such as "difference(offset(a.hpsdf, 0.02), move(b.obj, 0, 0, 1))". A leaf is the name
/// of a file or a shape. It is written between quotes (" or ') if it holds blanks, commas, parentheses or quotes, or
/// looks like a number; between quotes, a quote of the same kind is written twice. Commas before a shape's parameters,
/// as in builtin:torus,minor=0.2, need no quotes. Throws `Error` (of the kind `option`, with the subject "expression")
/// that names the column, in characters from 1, and what is expected there. It opens no files.
Expression parseExpression(std::string_view text);

/// Returns the text of an expression, which `parseExpression` reads again. Leaves are written by their names.
std::string textOf(const Expression& expression);

/// Returns the expression with each named leaf replaced by what `load` returns for its name. `load` is called once for
/// each name. An `Error` that `load` throws is thrown again as one about "expression" that names the column of the
/// leaf.
Expression withOperands(const Expression& expression, const std::function<Expression(const std::string& name)>& load);

/// Returns a 64-bit hash of the operations and of the solids' contents, by which a field tells whether files are those
/// that it was made from. The names of meshes and fields do not count; functions without a fingerprint count by their
/// names. A single mesh has the mesh's fingerprint, and a single function that of its source.
std::uint64_t fingerprint(const Expression& expression);

/// Functions that make expressions in C++. All of them throw `Error` as `Expression::operation` does.
namespace combine {

template <std::convertible_to<Expression>... More>
Expression unite(Expression first, More&&... more) {
  return Expression::operation(Operation::unite, {std::move(first), Expression(std::forward<More>(more))...});
}

template <std::convertible_to<Expression>... More>
Expression intersect(Expression first, More&&... more) {
  return Expression::operation(Operation::intersect, {std::move(first), Expression(std::forward<More>(more))...});
}

template <std::convertible_to<Expression>... More>
Expression subtract(Expression from, More&&... more) {
  return Expression::operation(Operation::subtract, {std::move(from), Expression(std::forward<More>(more))...});
}

/// These three are the operations above with rounded creases. Where two distances a and b differ by less than the
/// radius r, the union is min(a, b) − (r − |a − b|)² / (4 r), which is at most r/4 below the sharp one and continuous
/// with its gradient. Several operands are combined from the first to the last.
inline Expression smoothUnite(double radius, std::vector<Expression> operands) {
  return Expression::operation(Operation::smoothUnite, std::move(operands), {radius});
}
inline Expression smoothIntersect(double radius, std::vector<Expression> operands) {
  return Expression::operation(Operation::smoothIntersect, std::move(operands), {radius});
}
inline Expression smoothSubtract(double radius, std::vector<Expression> operands) {
  return Expression::operation(Operation::smoothSubtract, std::move(operands), {radius});
}

/// The solid grown by `distance`, or shrunk where it is below 0.
inline Expression offset(Expression solid, double distance) {
  return Expression::operation(Operation::offset, {std::move(solid)}, {distance});
}

/// The wall of a thickness above 0 along the solid's surface.
inline Expression shell(Expression solid, double thickness, ShellSide side = ShellSide::centred) {
  return Expression::operation(Operation::shell, {std::move(solid)}, {thickness}, side);
}

inline Expression moved(Expression solid, const Vector3& by) {
  return Expression::operation(Operation::move, {std::move(solid)}, {by.x(), by.y(), by.z()});
}

/// The solid turned about an axis through the origin, counter-clockwise as seen from the axis' tip.
inline Expression rotated(Expression solid, const Vector3& axis, double angleDegrees) {
  return Expression::operation(Operation::rotate, {std::move(solid)}, {axis.x(), axis.y(), axis.z(), angleDegrees});
}

/// The solid scaled about the origin by a factor above 0. There is no scale with different factors along the axes,
/// because distances do not survive one.
inline Expression scaled(Expression solid, double factor) {
  return Expression::operation(Operation::scale, {std::move(solid)}, {factor});
}

}  // namespace combine

}  // namespace hpsdf
