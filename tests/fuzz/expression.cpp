// Fuzz target: an expression of solids is written as text that is read as the same expression.
#include "hpsdf/combine/expression.h"

#include <string>

#include "target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hpsdf;
  fuzz::reads([&] {
    const Expression expression = parseExpression(fuzz::textOf(data, size));
    const Expression::Node& root = expression.node();
    fuzz::require(root.depth <= kMaxExpressionDepth, "the depth is limited");
    fuzz::require(root.operation == Operation::operand || !root.operands.empty(), "an operation has operands");
    const std::string text = textOf(expression);
    fuzz::require(textOf(parseExpression(text)) == text, "the text is read as the same expression");
  });
  return 0;
}
