// Tests `hpsdf combine`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "cli_fixture.h"
#include "construction/operands.h"
#include "files/text_file.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/shapes.h"

namespace hpsdf::app {
namespace cli_combine_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)

class Combine : public Cli {
 protected:
  Outcome combine(const std::string& expression, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {"combine", expression, "-o", at("c.hpsdf"), "--target-error", "1e-3"};
    words.insert(words.end(), more.begin(), more.end());
    return run({.words = words});
  }
};

TEST_F(Combine, meshesGiveExactDistances) {
  saveMesh(shapes::mesh("box,width=2,height=2,depth=2"), at("a box.ply"));
  const Outcome outcome = combine("difference(\"" + at("a box.ply") + "\", move(builtin:sphere,radius=0.5, 0, 0, 1))");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("c.hpsdf: "), HasSubstr("measured: "), HasSubstr("distances: exact everywhere\n")));
  const Field made = load(at("c.hpsdf"));
  EXPECT_NEAR(made.value({0, 0, 1}), 0.5, 0.05);
  EXPECT_NEAR(made.value({0.9, 0.9, -0.9}), -0.1, 0.05);
  const Outcome info = run({{"info", at("c.hpsdf")}});
  EXPECT_THAT(
      info.out,
      AllOf(ContainsRegex("made from +difference\\(\"a box.ply\", move\\(builtin:sphere,radius=0.5, 0, 0, 1\\)\\)\n"),
            ContainsRegex("distances +exact everywhere\n"), Not(HasSubstr("fingerprint"))));
  EXPECT_EQ(Json::parse(run({{"info", at("c.hpsdf"), "--json"}}).out).at("exact"), "everywhere");
  EXPECT_TRUE(Json::parse(run({{"info", field(), "--json"}}).out).at("exact").is_null());
}

TEST(Operands, haveTheTransformsThatActOnThem) {
  const auto operandsOf = [](const std::string& text) {
    std::string result;
    for (const Expression& operand : booleanOperands(parseExpression(text))) result += textOf(operand) + "; ";
    return result;
  };
  EXPECT_EQ(operandsOf("a.obj"), "a.obj; ");
  EXPECT_EQ(operandsOf("move(shell(a.obj, 0.1), 1, 0, 0)"), "move(a.obj, 1, 0, 0); ");
  EXPECT_EQ(operandsOf("difference(offset(a.obj, 0.1), move(b.obj, 0, 0, 1))"),
            "offset(a.obj, 0.1); move(b.obj, 0, 0, 1); ");
  EXPECT_EQ(operandsOf("scale(union(a.obj, rotate(intersection(b.obj, c.obj), 0, 0, 1, 90)), 2)"),
            "scale(a.obj, 2); scale(rotate(b.obj, 0, 0, 1, 90), 2); scale(rotate(c.obj, 0, 0, 1, 90), 2); ");
  EXPECT_EQ(operandsOf("offset(smooth-union(a.obj, b.obj, 0.1), 0.2)"), "a.obj; b.obj; ");
}

TEST_F(Combine, slicesOutlineTheOperands) {
  saveMesh(shapes::mesh("box"), at("box.ply"));
  ASSERT_EQ(combine("union(" + at("box.ply") + ", move(builtin:sphere, 3, 0, 0))", {"--normalize"}).status, 0);
  const auto slice = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"slice", at("c.hpsdf"), "-o", at("c.png"), "--cpu", "--size", "200x160"};
    words.insert(words.end(), more.begin(), more.end());
    return run({.words = words});
  };
  // The box is found beside the field, although the program runs in another folder.
  const Outcome own = slice({"--operands", "own"});
  ASSERT_EQ(own.status, 0) << own.err;
  const std::string outlined = readTextFile(at("c.png"));
  ASSERT_EQ(slice({}).status, 0);
  EXPECT_NE(readTextFile(at("c.png")), outlined);
  ASSERT_EQ(slice({"--operands", "difference(" + at("box.ply") + ", move(builtin:sphere, 3, 0, 0))"}).status, 0);
  EXPECT_EQ(readTextFile(at("c.png")), outlined) << "the same operands";

  EXPECT_THAT(slice({"--operands", "union(" + at("no.ply") + ", builtin:box)"}).err, HasSubstr("no such file"));
  std::filesystem::remove(at("box.ply"));
  EXPECT_EQ(slice({"--operands", "own"}).status, 2);
  EXPECT_THAT(run({{"slice", field(), "-o", at("c.png"), "--operands", "own"}}).err,
              HasSubstr("not built by 'combine'"));
  EXPECT_THAT(run({{"slice", field(), "-o", at("c.csv"), "--operands", "own"}}).err, HasSubstr("no outlines"));
}

TEST_F(Combine, fieldsGiveBounds) {
  const Outcome outcome =
      combine("smooth-union(" + field() + ", rotate(" + field() + ", 1, 0, 0, 90), 0.05)", {"--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json.at("exact"), "nowhere");
  EXPECT_EQ(json.at("output"), at("c.hpsdf"));
  EXPECT_EQ(json.at("mesh").at("name"), "smooth-union(torus.hpsdf, rotate(torus.hpsdf, 1, 0, 0, 90), 0.05)");
  EXPECT_LT(load(at("c.hpsdf")).value({0, 0, 0.7}), -0.2);
  const Outcome text = combine("shell(" + field() + ", 0.1, outward)");
  EXPECT_THAT(text.out, HasSubstr("distances: a lower bound; the surface may be farther away than the values say\n"));
}

TEST_F(Combine, takesTheOptionsOfBuild) {
  const Outcome outcome = combine("scale(builtin:box, 10)", {"--normalize", "--margin", "0.25", "--threads", "1"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Field made = load(at("c.hpsdf"));
  EXPECT_NEAR(made.domain().max().x(), 1.25, 1e-12);
  EXPECT_NEAR(made.metadata().source.normalization.scale, 0.1, 1e-12);
  const std::string once = readFile(at("c.hpsdf"));
  ASSERT_EQ(combine("scale(builtin:box, 10)", {"--normalize", "--margin", "0.25", "--threads", "3"}).status, 0);
  EXPECT_EQ(readFile(at("c.hpsdf")), once);
  const Outcome tolerance = run({{"combine", "offset(builtin:box, 0.1)", "-o", at("t.hpsdf"), "--tolerance", "1%"}});
  EXPECT_EQ(tolerance.status, 0) << tolerance.err;
  EXPECT_THAT(tolerance.out, HasSubstr("tolerance: "));
}

TEST_F(Combine, fieldsAreVerifiedByTheirExpression) {
  const std::string expression = "union(builtin:box, move(builtin:torus, 0.3, 0, 0))";
  for (const bool normalizes : {false, true}) {
    ASSERT_EQ(
        combine(expression, normalizes ? std::vector<std::string>{"--normalize"} : std::vector<std::string>{}).status,
        0);
    const Outcome outcome = run({{"verify", at("c.hpsdf"), "union( builtin:box,move(builtin:torus,0.3,0,0))",
                                  "--max-error", "0.3", "--points", "2000", "--script", at("worst.hpsdfs")}});
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("against union("));
  }
  fs::remove(at("worst.hpsdfs"));
  expectRefused({{"verify", at("c.hpsdf")}}, "as an expression with the paths of its files: '" + expression + "'",
                {"c.hpsdf"});
  expectRefused({{"verify", at("c.hpsdf"), "union(builtin:box, builtin:torus)"}}, "not from union(", {"c.hpsdf"});
  expectRefused({{"verify", at("c.hpsdf"), "offset(builtin:box, 1)"}}, "only Boolean expressions of closed meshes",
                {"c.hpsdf"});
  for (const char* const other : {"offset(builtin:box, 0.1)", "shell(builtin:box, 0.1)", "offset(builtin:box, -0.1)",
                                  "smooth-union(builtin:box, builtin:torus, 0.1)"}) {
    ASSERT_EQ(combine(other, {"--max-steps", "3"}).status, 0);
    expectRefused({{"verify", at("c.hpsdf"), other}}, "only Boolean expressions of closed meshes", {"c.hpsdf"});
    expectRefused({{"verify", at("c.hpsdf")}}, "only Boolean expressions of closed meshes", {"c.hpsdf"});
  }
}

/// Two folders have files of the same names with different contents.
TEST_F(Combine, filesOfTheSameNameWithOtherContentsAreRefused) {
  fs::create_directory(at("other"));
  saveMesh(shapes::mesh("box"), at("a.obj"));
  saveMesh(shapes::mesh("box,height=0.3"), at("other/a.obj"));
  const auto united = [&](const std::string& file) { return "union(" + at(file) + ", builtin:torus)"; };
  for (const bool normalizes : {false, true}) {
    std::vector<std::string> options = {"--max-steps", "3"};
    if (normalizes) options.emplace_back("--normalize");
    ASSERT_EQ(combine(united("other/a.obj"), options).status, 0);
    expectRefused({{"verify", at("c.hpsdf"), united("a.obj")}}, "the contents of these files were others");
    expectRefused({{"slice", at("c.hpsdf"), "-o", at("x.png"), "--cpu", "--operands", "own"}},
                  "the files of these names are others than those from which the field was made");
    EXPECT_EQ(run({{"verify", at("c.hpsdf"), united("other/a.obj"), "--points", "100"}}).status, 0);
    ASSERT_EQ(combine(united("a.obj"), options).status, 0);
    EXPECT_EQ(run({{"slice", at("c.hpsdf"), "-o", at("x.png"), "--cpu", "--operands", "own"}}).status, 0);
    fs::remove(at("x.png"));

    // A single file is found under its name, without an expression.
    ASSERT_EQ(combine(at("other/a.obj"), options).status, 0);
    expectRefused({{"verify", at("c.hpsdf")}}, "the contents of these files were others");
    EXPECT_EQ(run({{"verify", at("c.hpsdf"), at("other/a.obj"), "--points", "100"}}).status, 0);
    ASSERT_EQ(combine(at("a.obj"), options).status, 0);
    EXPECT_EQ(run({{"verify", at("c.hpsdf"), "--points", "100"}}).status, 0);
  }
}

TEST_F(Combine, takesGridsAsOperands) {
  ASSERT_EQ(run({{"export", field(), "-o", at("grid.vti"), "--resolution", "40"}}).status, 0);
  const Outcome outcome = combine("move(" + at("grid.vti") + ", 5, 0, 0)");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("distances: "));
  EXPECT_EQ(load(at("c.hpsdf")).metadata().source.exactness, Exactness::nowhere);
  const Field torus = load(field());
  const Vector3 inside(torus.metadata().source.box.max().x() - 0.1, 0, 0);
  EXPECT_NEAR(load(at("c.hpsdf")).value(inside + Vector3(5, 0, 0)), torus.value(inside), 0.05);
  expectRefused({{"combine", at("grid.vti"), "-o", at("x.hpsdf"), "--bounds"}}, "nothing is proven of a grid");
  ASSERT_EQ(run({{"export", field(), "-o", at("grid.npy"), "--resolution", "20"}}).status, 0);
  expectRefused({{"combine", "offset(" + at("grid.npy") + ", 1)", "-o", at("x.hpsdf")}},
                "column 8: " + at("grid.npy") + ": an array of NumPy does not tell where its points lie");
}

TEST_F(Combine, mistakesAreOneLineWithTheColumn) {
  const auto expectColumn = [&](const std::string& expression, const std::string& message) {
    expectRefused({{"combine", expression, "-o", at("x.hpsdf")}}, "expression: column " + message, {});
  };
  expectColumn("union(builtin:box, ofset(builtin:box, 1))",
               "20: there is no operation 'ofset'; did you mean 'offset'?");
  expectColumn("union(builtin:box", "18: expected ',' or ')', found the end");
  expectColumn(" ", "2: expected a file, a shape or an operation, found the end");
  expectColumn("scale(builtin:box, 1, 2, 1)", "1: scale: it is written scale(A, S): different factors");
  expectColumn("union(builtin:box, none.obj)", "20: none.obj: no such file");
  expectColumn("union(builtin:box, none.vti)", "20: none.vti: no such file");
  expectColumn("union(builtin:box, move(builtin:box, 1e17, 0, 0))", "25: builtin:box: moves and scales put it at");
  expectColumn("union(builtin:box, \"no\nne.obj\")", "20: no\\nne.obj: no such file");
  expectColumn("union(builtin:box, builtin:sphere,radius=0)", "20: ");
  writeFile(at("broken.ply"), "ply\nformat");
  expectRefused({{"combine", "offset(" + at("broken.ply") + ", 1)", "-o", at("x.hpsdf")}},
                "column 8: " + at("broken.ply"));
}

TEST_F(Combine, hostileCallsLeaveNothingBehind) {
  const auto expectNothing = [&](std::vector<std::string> words, const std::string& message) {
    words.insert(words.begin(), "combine");
    words.insert(words.end(), {"-o", at("x.hpsdf")});
    expectRefused({words}, message, {});
  };
  expectNothing({"difference(builtin:box, builtin:box)"}, "nothing is left of the meshes");
  expectNothing({"intersection(builtin:box, move(builtin:box, 9, 0, 0))"}, "nothing is left of the meshes");
  expectNothing({"offset(" + field() + ", 0.1)", "--tolerance", "1%", "--certified"},
                "column 8: " + field() + ": nothing is proven of a field");
  expectNothing({field(), "--bounds"}, "errors of its own: leave out bounds");
  saveMesh({.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
            .triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}},
            .name = ""},
           at("open.ply"));
  expectRefused({{"combine", at("open.ply"), "-o", at("x.hpsdf"), "--bounds"}}, "the mesh has holes");
  fs::remove(at("open.ply"));
  expectNothing({"builtin:box", "--tolerance", "-1"}, "tolerance");
  std::string deep(120, 'x');
  for (int i = 0; i < 120; ++i) deep = "offset(" + deep + ",1)";
  expectNothing({deep}, "deeper than 100 operations");
  expectRefused({{"combine", "-o", at("x.hpsdf")}}, "expression", {});
  expectRefused({{"combine", "builtin:box"}}, "output", {});
}

TEST_F(Combine, scriptsUseTheResult) {
  const Outcome outcome = run({{"run", "-e",
                                "combine \"union(builtin:box, move(builtin:box, 1, 0.5, 0.25))\" target-error=1e-3; "
                                "expect at(0.5,0.2,0).value < -0.4; query points=0,0,0; slice color=error size=64x64 "
                                "cpu=true output=" +
                                    at("error.png")}});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("distances: exact everywhere"));
  EXPECT_TRUE(fs::exists(at("error.png")));
}

TEST_F(Combine, helpTeachesTheLanguage) {
  const Outcome help = run({{"combine", "--help"}});
  EXPECT_EQ(help.status, 0);
  for (const char* form : {"union(A, B, …)", "shell(A, T, SIDE)", "rotate(A, X, Y, Z, DEGREES)", "--tolerance"})
    EXPECT_THAT(help.out, HasSubstr(form));
}

}  // namespace cli_combine_test
}  // namespace hpsdf::app
