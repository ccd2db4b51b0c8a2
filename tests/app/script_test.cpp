#include "script.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "hpsdf/error.h"
#include "session.h"

namespace hpsdf::app {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// A registry of two small commands that write down how they were called.
class ScriptTest : public testing::Test {
 protected:
  ScriptTest() {
    registry_.add(
        {.name = "say",
         .parameters = {{.name = "words", .positional = true, .repeatable = true},
                        {.name = "count", .type = ParameterType::wholeNumber, .defaultText = "1", .minimum = 1},
                        {.name = "loud", .type = ParameterType::flag, .defaultText = "false"},
                        {.name = "output", .type = ParameterType::outputPath, .alias = 'o'}},
         .action = [this](Session&, const Arguments& arguments) {
           std::string line = arguments.flag("loud") ? "LOUD" : "";
           for (const std::string& word : arguments.texts("words")) line += "[" + word + "]";
           if (arguments.given("count")) line += "x" + arguments.text("count");
           if (arguments.given("output")) line += ">" + arguments.text("output");
           said_.push_back(line);
         }});
    registry_.add({.name = "fail", .action = [](Session&, const Arguments&) { throw Error("it failed"); }});
    registry_.add(
        {.name = "set",
         .parameters = {{.name = "assignments", .positional = true, .repeatable = true, .need = Need::always}},
         .action = [](Session&, const Arguments&) {},
         .takesVariables = true,
         .definesVariables = true});
  }

  std::vector<std::string> run(const std::string& text, const Variables& variables = {}) {
    said_.clear();
    std::istringstream in;
    std::ostringstream out;
    std::ostringstream err;
    Session session(registry_, {in, out, err});
    runScript(session, parseScript(registry_, "test.hps", text, variables));
    return said_;
  }

  std::string complaint(const std::string& text, const Variables& variables = {}) {
    try {
      run(text, variables);
    } catch (const Error& error) {
      return error.what();
    }
    return "no complaint";
  }

  Registry registry_;
  std::vector<std::string> said_;
};

TEST_F(ScriptTest, readsLinesWordsAndComments) {
  EXPECT_THAT(run("say a b\n\n  # nothing here\n\tsay c # and no more\r\nsay d#e"),
              ElementsAre("[a][b]", "[c]", "[d#e]"));
  EXPECT_THAT(run(""), ElementsAre());
  EXPECT_THAT(run(" \n;;\n# x"), ElementsAre());
}

TEST_F(ScriptTest, semicolonsSeparate) {
  EXPECT_THAT(run("say a; say b;say c ;\nsay \"d;e\""), ElementsAre("[a]", "[b]", "[c]", "[d;e]"));
}

TEST_F(ScriptTest, parametersHaveThreeSpellings) {
  EXPECT_THAT(
      run("say a count=3 loud=true output=f\nsay a --count 3 --loud -o f\nsay --count=3 --loud=true --output=f a"),
      ElementsAre("LOUD[a]x3>f", "LOUD[a]x3>f", "LOUD[a]x3>f"));
}

TEST_F(ScriptTest, onlyAPlainNameBeforeTheEqualsIsAParameter) {
  EXPECT_THAT(run("say builtin:torus,major=0.7\nsay \"count=3\"\nsay \"count\"=3\nsay =3"),
              ElementsAre("[builtin:torus,major=0.7]", "[count=3]", "[count=3]", "[=3]"));
}

TEST_F(ScriptTest, quotesKeepBlanksAndEscapes) {
  EXPECT_THAT(run(R"(say "a b" c" d"e output="x y.png"
say "\"q\" \\ \n" back\slash)"),
              ElementsAre("[a b][c de]>x y.png", R"(["q" \ \n][back\slash])"));
}

TEST_F(ScriptTest, variablesAreReplacedAndStayOneWord) {
  const Variables variables = {{"mesh", "my mesh.obj"}, {"n", "3"}, {"trap", "count=2"}};
  EXPECT_THAT(run("say $mesh ${n}x$n \"<$mesh>\" $$n count=$n\nsay $trap", variables),
              ElementsAre("[my mesh.obj][3x3][<my mesh.obj>][$n]x3", "[count=2]"));
}

TEST_F(ScriptTest, setGivesVariablesToTheLinesBelow) {
  EXPECT_THAT(run("say $n\nset n=2 other=\"a b\"\nsay $n $other\nset n=$n$n\nsay $n", {{"n", "1"}}),
              ElementsAre("[1]", "[2][a b]", "[22]"));
  EXPECT_THAT(complaint("set n=1 2nd=3"), HasSubstr("expected name=value, found '2nd=3'"));
}

TEST_F(ScriptTest, mistakesNameFileLineAndColumn) {
  EXPECT_EQ(complaint("say a\n  sya b"), "test.hps:2:3: unknown command 'sya'; did you mean 'say'?");
  EXPECT_EQ(complaint("say a\nsay b  coutn=2"), "test.hps:2:8: say: unknown option 'coutn'; did you mean 'count'?");
  EXPECT_EQ(complaint("say a; say b --coutn 2"), "test.hps:1:14: say: unknown option '--coutn'; did you mean 'count'?");
  EXPECT_EQ(complaint("say a count=0"), "test.hps:1:7: count: expected a whole number of at least 1, found '0'");
  EXPECT_EQ(complaint("say a count="), "test.hps:1:7: count: needs a value");
  EXPECT_THAT(complaint("\n\nsay \"open\nsay b"), HasSubstr("test.hps:3:5: this quote is not closed"));
  EXPECT_THAT(complaint("say ä $x"), HasSubstr("test.hps:1:7: unknown variable $x"));
  EXPECT_EQ(complaint("say $mseh", {{"mesh", "m"}}), "test.hps:1:5: unknown variable $mseh; did you mean $mesh?");
  EXPECT_THAT(complaint("say a$"), HasSubstr("test.hps:1:6: expected a variable's name"));
  EXPECT_THAT(complaint("say ${a", {{"a", "b"}}), HasSubstr("test.hps:1:5: expected }"));
}

TEST_F(ScriptTest, isCheckedWholeBeforeAnythingRuns) {
  EXPECT_THAT(complaint("say a\nsay count=0"), HasSubstr("test.hps:2:5"));
  EXPECT_THAT(said_, ElementsAre());
}

TEST_F(ScriptTest, stopsAtTheFirstCommandThatFails) {
  EXPECT_EQ(complaint("say a\n fail\nsay b"), "test.hps:2:2: it failed");
  EXPECT_THAT(said_, ElementsAre("[a]"));
}

TEST(Variables, haveAFixedForm) {
  EXPECT_THAT(parseVariables({"a=1", "b_2=x=y", "c="}),
              ElementsAre(std::pair("a", "1"), std::pair("b_2", "x=y"), std::pair("c", "")));
  EXPECT_THROW(parseVariables({"a"}), Error);
  EXPECT_THROW(parseVariables({"=1"}), Error);
  EXPECT_THROW(parseVariables({"a-b=1"}), Error);
}

}  // namespace
}  // namespace hpsdf::app
