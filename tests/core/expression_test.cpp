// Expressions of solids: their text, its errors by column, and the limits of operations.

#include "hpsdf/combine/expression.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/shapes.h"
#include "support/random_expression.h"

namespace hpsdf {
namespace expression_test {

using testing::HasSubstr;

/// Returns the message with which a text is refused, or "".
std::string refusalOf(const std::string& text) {
  try {
    parseExpression(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Expression, textIsReadAndWrittenAgain) {
  for (const std::string text : {
           "a.obj",
           "union(a.obj, b.hpsdf)",
           "difference(offset(a.hpsdf, 0.02), move(b.obj, 0, 0, 1))",
           "intersection(a, b, c, d)",
           "shell(builtin:torus,major=0.7,minor=0.2, 0.05, inward)",
           "shell(analytic:sphere, 0.05)",
           "rotate(scale(\"a b.obj\", 2), 0, 0, 1, -90)",
           "smooth-union(a, \"1.5\", 1e-05)",
           "smooth-difference(a-b.obj, \"it's,(x).obj\", 0.1)",
       })
    EXPECT_EQ(textOf(parseExpression(text)), text);
  EXPECT_EQ(textOf(parseExpression("  union ( a ,\n\t'b'  , \"c\" )  ")), "union(a, b, c)");
  EXPECT_EQ(textOf(parseExpression("shell(a, +0.5, centred)")), "shell(a, 0.5)");
}

TEST(Expression, errorsNameTheColumn) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "expression: column 1: expected a file, a shape or an operation, found the end"},
      {"   ", "column 4: expected a file"},
      {"union(a, b", "column 11: expected ',' or ')', found the end"},
      {"union(a b)", "column 9: expected ',' or ')', found 'b'"},
      {"union(a, )", "column 10: expected a file, a shape or an operation, found ')'"},
      {"union(a, b) c", "column 13: expected the end of the expression, found 'c'"},
      {"union(a)", "column 1: union: it is written union(A, B, …), with two operands or more"},
      {"a.obj)", "column 6: expected the end"},
      {"offset(offset(a, 1), b)", "column 1: offset: it is written offset(A, D), with one operand and one number"},
      {"offset(a, 1, b)", "column 14: expected a number: offset is written offset(A, D)"},
      {"offset(1, a)", "column 8: expected a solid before the number"},
      {"union(a, offst(b, 1))", "column 10: there is no operation 'offst'; did you mean 'offset'?"},
      {"blend(a, b)", "there are union, intersection"},
      {"union(a, shell(b, 0))", "column 10: shell: its thickness must be above 0"},
      {"shell(a, 1, upward)", "column 13: expected inward, outward or centred, found 'upward'"},
      {"scale(a, 1, 2, 1)", "different factors along the axes are refused"},
      {"scale(a, -1)", "factor must be from 1e-12 to 1e12"},
      {"rotate(a, 0, 0, 0, 90)", "axis must not be 0, 0, 0"},
      {"smooth-union(a, b)", "with two operands or more and one number"},
      {"offset(a, 1e999)", "column 11: 1e999 is out of the range of numbers"},
      {"offset(a, 1.2.3)", "column 11: '1.2.3' is not a number"},
      {"offset(a, 1e200)", "column 1: offset: its numbers must be finite, up to 1e100"},
      {"7", "column 1: a number is no solid"},
      {"union(a, 'b", "column 10: the quote is not closed"},
      {"union('', b)", "column 7: a name is missing between the quotes"},
      {"union(ä, é, ü ö)", "column 15: expected ',' or ')', found 'ö'"},
      {"union(a, \x01(b))", "there is no operation '?'"},
  };
  for (const auto& [text, message] : cases) {
    const std::string refusal = refusalOf(text);
    EXPECT_THAT(refusal, HasSubstr(message)) << text;
    EXPECT_TRUE(refusal.starts_with("expression: column ")) << refusal;
    EXPECT_EQ(refusal.find('\n'), std::string::npos);
  }
}

TEST(Expression, deepOnesAreRefused) {
  std::string open, close;
  for (int i = 0; i < 200'000; ++i) {
    open += "offset(";
    close += ",1)";
  }
  EXPECT_THAT(refusalOf(open + "a" + close), HasSubstr("longer than a million"));
  EXPECT_THAT(refusalOf(open.substr(0, 700'000)), HasSubstr("deeper than 100 operations"));
  Expression deep = Expression::named("a");
  for (int i = 1; i < kMaxExpressionDepth; ++i) deep = combine::offset(deep, 1);
  EXPECT_THROW(combine::offset(deep, 1), Error);
  EXPECT_EQ(textOf(parseExpression(textOf(deep))), textOf(deep));
}

TEST(Expression, operandsAreLoadedOnceAndNamedWithoutFolders) {
  std::vector<std::string> names;
  const auto load = [&](const std::string& name) -> Expression {
    names.push_back(name);
    if (name == "missing.obj") throw Error(ErrorKind::file, name, "no such file");
    return shapes::mesh("box");
  };
  const Expression loaded =
      withOperands(parseExpression("union(in/a.obj, move(in/a.obj, 1, 0, 0), builtin:box)"), load);
  EXPECT_THAT(names, testing::ElementsAre("in/a.obj", "builtin:box"));
  EXPECT_EQ(textOf(loaded), "union(a.obj, move(a.obj, 1, 0, 0), builtin:box)");
  try {
    withOperands(parseExpression("union(a.obj, missing.obj)"), load);
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "expression: column 14: missing.obj: no such file");
    EXPECT_EQ(error.kind(), ErrorKind::file);
  }
}

TEST(Expression, anyNameIsReadAgain) {
  for (const char* name : {"a", "5", "a b", "it's", "19\" rack", "5' 3\" tall.obj", "\"", "'", "''", "\"'\"", "a,b",
                           "(", "-", "union", "inward", "builtin:torus,minor=0.2", "builtin:torus, x", "ä \" ' ö"}) {
    const Expression leaf = Expression::named(name);
    for (const Expression& expression : {leaf, combine::shell(combine::unite(leaf, leaf), 0.5, ShellSide::inward)}) {
      const Expression again = parseExpression(textOf(expression));
      EXPECT_EQ(textOf(again), textOf(expression));
      const Expression* first = &again;
      while (!first->node().operands.empty()) first = &first->node().operands[0];
      EXPECT_EQ(first->node().name, name);
    }
  }
  EXPECT_EQ(parseExpression("'it''s'").node().name, "it's");
  EXPECT_THAT(refusalOf("'it''s"), HasSubstr("the quote is not closed"));
  EXPECT_THROW(Expression::named(""), Error);
}

TEST(Expression, manyOperandsAreRefused) {
  Expression twice = Expression::named("a");
  for (int i = 0; i < 19; ++i) twice = combine::unite(twice, twice);
  EXPECT_EQ(twice.node().leaves, 1u << 19);
  EXPECT_THROW(combine::unite(twice, twice), Error);
}

TEST(Expression, randomOnesAreReadAgain) {
  const std::vector<Expression> leaves = {Expression::named("a.obj"), Expression::named("b c.hpsdf")};
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const std::string text = textOf(randomExpression(seed, leaves));
    EXPECT_EQ(textOf(parseExpression(text)), text);
  }
  EXPECT_EQ(textOf(randomExpression(7, leaves)), textOf(randomExpression(7, leaves)));
}

}  // namespace expression_test
}  // namespace hpsdf
