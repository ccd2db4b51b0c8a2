#include "hpsdf/combine/expression.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>

#include "combine/expression_words.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace combine {
namespace {

constexpr double kLeastFactor = 1e-12;  ///< of a scale; its reciprocal is the greatest factor

[[noreturn]] void refuseOperation(const OperationDescription& row, const std::string& problem) {
  throw Error(ErrorKind::option, std::string(row.name), problem);
}

void requireCounts(const OperationDescription& row, const Expression::Node& node) {
  const bool fits = row.takesMany ? node.operands.size() >= 2 : node.operands.size() == 1;
  if (fits && node.numbers.size() == row.numbers) return;
  const std::string form = "it is written " + std::string(row.form);
  if (row.operation == Operation::scale && node.numbers.size() > 1)
    refuseOperation(row, form + ": different factors along the axes are refused, because they change distances");
  refuseOperation(row, form + ", with " + (row.takesMany ? "two operands or more" : "one operand") +
                           (row.numbers == 0   ? " and no number"
                            : row.numbers == 1 ? " and one number"
                                               : " and " + std::to_string(row.numbers) + " numbers"));
}

void requireNumbers(const OperationDescription& row, const Expression::Node& node) {
  const std::vector<double>& numbers = node.numbers;
  const auto isUsable = [](double number) { return std::isfinite(number) && std::abs(number) <= kLargestCoordinate; };
  if (!std::ranges::all_of(numbers, isUsable)) refuseOperation(row, "its numbers must be finite, up to 1e100");
  const auto requirePositive = [&](const char* what) {
    if (!(numbers[0] > 0)) refuseOperation(row, std::string("its ") + what + " must be above 0");
  };
  switch (row.operation) {
    case Operation::smoothUnite:
    case Operation::smoothIntersect:
    case Operation::smoothSubtract:
      return requirePositive("radius");
    case Operation::shell:
      return requirePositive("thickness");
    case Operation::scale:
      if (!(numbers[0] >= kLeastFactor && numbers[0] <= 1 / kLeastFactor))
        refuseOperation(row, "its factor must be from 1e-12 to 1e12; rotate turns a solid around");
      return;
    case Operation::rotate:
      if (!(Vector3(numbers[0], numbers[1], numbers[2]).stableNorm() > 0))
        refuseOperation(row, "its axis must not be 0, 0, 0");
      return;
    default:
      return;
  }
}

std::string numberText(double number) {
  std::array<char, 32> text;
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), number);
  return {text.data(), end};
}

/// Returns a leaf's name as an expression writes it. Between quotes, a quote of the same kind is doubled.
std::string nameText(const std::string& name) {
  if (readsAsName(name)) return name;
  const char quote = name.find('"') == std::string::npos || name.find('\'') != std::string::npos ? '"' : '\'';
  std::string text(1, quote);
  for (const char c : name) text.append(c == quote ? 2 : 1, c);
  return text + quote;
}

std::string ownName(const TriangleMesh& mesh) { return mesh.name; }
std::string ownName(const Field&) { return ""; }
std::string ownName(const DistanceFunction& distance) { return distance.source().name; }

/// Returns a leaf that holds a solid. It has the solid's own name or, if there is none, the name `otherwise`.
template <typename Solid>
Expression::Node leafOf(Solid solid, const char* otherwise) {
  Expression::Node node;
  node.name = ownName(solid);
  if (node.name.empty()) node.name = otherwise;
  node.operand = std::make_shared<const Solid>(std::move(solid));
  return node;
}

/// Returns a file's name without its folders, and a shape's name as it is.
std::string shortName(const std::string& name) {
  return isShapeName(name) ? name : std::filesystem::path(name).filename().string();
}

}  // namespace

}  // namespace combine

Expression::Expression(Node node) : node_(std::make_shared<const Node>(std::move(node))) {}

Expression::Expression(TriangleMesh mesh) : Expression(combine::leafOf(std::move(mesh), "mesh")) {}

Expression::Expression(Field field) : Expression(combine::leafOf(std::move(field), "field")) {}

Expression::Expression(DistanceFunction distance) : Expression(combine::leafOf(std::move(distance), "function")) {}

Expression Expression::within(const Box& domain, DistanceFunction distance) {
  Node node = combine::leafOf(std::move(distance), "function");
  node.domain = domain;
  return Expression(std::move(node));
}

Expression Expression::named(std::string name, std::size_t column) {
  if (name.empty()) throw Error(ErrorKind::option, "", "the name of an operand is missing");
  Node node;
  node.operand = name;
  node.name = std::move(name);
  node.column = column;
  return Expression(std::move(node));
}

Expression Expression::operation(Operation operation, std::vector<Expression> operands, std::vector<double> numbers,
                                 ShellSide side) {
  const OperationDescription& row = descriptionOf(operation);
  Node node{.operation = operation, .operands = std::move(operands), .numbers = std::move(numbers), .side = side};
  combine::requireCounts(row, node);
  combine::requireNumbers(row, node);
  node.leaves = 0;
  for (const Expression& operand : node.operands) {
    node.depth = std::max(node.depth, operand.node().depth + 1);
    node.leaves = std::min(node.leaves + operand.node().leaves, kMaxExpressionLeaves + 1);
  }
  if (node.leaves > kMaxExpressionLeaves)
    throw Error(ErrorKind::limit, std::string(row.name), "the expression has more than a million operands");
  if (node.depth > kMaxExpressionDepth)
    throw Error(ErrorKind::limit, std::string(row.name),
                "the expression is deeper than " + std::to_string(kMaxExpressionDepth) +
                    " operations; build a part of it as a field of its own first");
  return Expression(std::move(node));
}

Expression Expression::renamed(std::string name, std::size_t column) const {
  Node node = *node_;
  node.name = std::move(name);
  node.column = column;
  return Expression(std::move(node));
}

std::string textOf(const Expression& expression) {
  const Expression::Node& node = expression.node();
  if (node.operation == Operation::operand) return combine::nameText(node.name);
  std::string text = std::string(descriptionOf(node.operation).name) + "(";
  const auto add = [&](const std::string& argument) { text += (text.back() == '(' ? "" : ", ") + argument; };
  for (const Expression& operand : node.operands) add(textOf(operand));
  for (const double number : node.numbers) add(combine::numberText(number));
  if (node.operation == Operation::shell && node.side != ShellSide::centred)
    add(std::string(combine::kSideNames[static_cast<std::size_t>(node.side)]));
  return text + ")";
}

namespace combine {
namespace {

using Loader = std::function<Expression(const std::string& name)>;

/// Replaces the named leaves of expressions, each name once.
class Resolver {
 public:
  explicit Resolver(const Loader& load) : load_(load) {}

  Expression resolve(const Expression& expression) {
    const Expression::Node& node = expression.node();
    if (node.operation == Operation::operand)
      return std::holds_alternative<std::string>(node.operand) ? loaded(node) : expression;
    std::vector<Expression> operands;
    for (const Expression& operand : node.operands) operands.push_back(resolve(operand));
    return Expression::operation(node.operation, std::move(operands), node.numbers, node.side);
  }

 private:
  Expression loaded(const Expression::Node& leaf) {
    const auto& name = std::get<std::string>(leaf.operand);
    try {
      auto known = known_.find(name);
      if (known == known_.end()) known = known_.emplace(name, load_(name)).first;
      const Expression& found = known->second;
      const bool isLeaf = found.node().operation == Operation::operand;
      return isLeaf ? found.renamed(shortName(name), leaf.column) : found;
    } catch (const Error& error) {
      if (leaf.column == 0) throw;
      throw expressionError(error.kind(), leaf.column, error.what());
    }
  }

  const Loader& load_;
  std::map<std::string, Expression> known_;
};

}  // namespace
}  // namespace combine

Expression withOperands(const Expression& expression, const std::function<Expression(const std::string& name)>& load) {
  return combine::Resolver(load).resolve(expression);
}

}  // namespace hpsdf
