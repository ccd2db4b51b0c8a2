#include "language/script.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "files/text_file.h"
#include "hpsdf/error.h"
#include "session/session.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace script_test {

using testing::ElementsAre;
using testing::HasSubstr;

/// Registers a few small test commands that record their arguments.
class Script : public testing::Test {
 protected:
  Script() {
    registry_.add({.name = "say",
                   .parameters = {{"words", text().positional().repeatable(), ""},
                                  {"count", wholeNumber().atLeast(1).byDefault("1"), ""},
                                  {"loud", flag(), ""},
                                  {"output", outputFile().as('o'), ""}},
                   .action = [this](Session&, const Arguments& arguments) {
                     std::string line = arguments.flag("loud") ? "LOUD" : "";
                     for (const std::string& word : arguments.texts("words")) line += "[" + word + "]";
                     if (arguments.given("count")) line += "x" + arguments.text("count");
                     if (arguments.given("output")) line += ">" + arguments.text("output");
                     said_.push_back(line);
                   }});
    registry_.add({.name = "fail", .action = [](Session&, const Arguments&) { throw Error("it failed"); }});
    registry_.add({.name = "set",
                   .parameters = {{"assignments", text().positional().repeatable().required(), ""}},
                   .action = [](Session&, const Arguments&) {},
                   .takesVariables = true,
                   .definesVariables = true});
    registry_.add({.name = "include",
                   .parameters = {{"script", text().positional().required(), ""}},
                   .action = [](Session&, const Arguments&) {},
                   .includesScript = true});
  }

  std::vector<std::string> run(const std::string& text, const Variables& variables = {}) {
    return runNamed("test.hps", text, variables);
  }

  std::vector<std::string> runNamed(const std::string& name, const std::string& text, const Variables& variables = {}) {
    said_.clear();
    std::istringstream in;
    std::ostringstream out;
    std::ostringstream err;
    Session session(registry_, {in, out, err});
    runScript(session, parseScript(registry_, name, text, variables));
    return said_;
  }

  std::string complaint(const std::string& text, const Variables& variables = {}) {
    return complaintNamed("test.hps", text, variables);
  }

  std::string complaintNamed(const std::string& name, const std::string& text, const Variables& variables = {}) {
    try {
      runNamed(name, text, variables);
    } catch (const Error& error) {
      return error.what();
    }
    return "no complaint";
  }

  Registry registry_;
  std::vector<std::string> said_;
};

TEST_F(Script, readsLinesWordsAndComments) {
  EXPECT_THAT(run("say a b\n\n  # nothing here\n\tsay c # and no more\r\nsay d#e"),
              ElementsAre("[a][b]", "[c]", "[d#e]"));
  EXPECT_THAT(run(""), ElementsAre());
  EXPECT_THAT(run(" \n;;\n# x"), ElementsAre());
}

TEST_F(Script, semicolonsSeparateCommands) {
  EXPECT_THAT(run("say a; say b;say c ;\nsay \"d;e\""), ElementsAre("[a]", "[b]", "[c]", "[d;e]"));
}

TEST_F(Script, parametersHaveThreeSpellings) {
  EXPECT_THAT(
      run("say a count=3 loud=true output=f\nsay a --count 3 --loud -o f\nsay --count=3 --loud=true --output=f a"),
      ElementsAre("LOUD[a]x3>f", "LOUD[a]x3>f", "LOUD[a]x3>f"));
}

TEST_F(Script, onlyANameBeforeTheEqualsSignIsAParameter) {
  EXPECT_THAT(run("say builtin:torus,major=0.7\nsay \"count=3\"\nsay \"count\"=3\nsay =3"),
              ElementsAre("[builtin:torus,major=0.7]", "[count=3]", "[count=3]", "[=3]"));
}

TEST_F(Script, quotesKeepBlanksAndEscapes) {
  EXPECT_THAT(run(R"(say "a b" c" d"e output="x y.png"
say "\"q\" \\ \n" back\slash)"),
              ElementsAre("[a b][c de]>x y.png", R"(["q" \ \n][back\slash])"));
}

TEST_F(Script, variablesAreReplacedAndStayOneWord) {
  const Variables variables = {{"mesh", "my mesh.obj"}, {"n", "3"}, {"trap", "count=2"}};
  EXPECT_THAT(run("say $mesh ${n}x$n \"<$mesh>\" $$n count=$n\nsay $trap", variables),
              ElementsAre("[my mesh.obj][3x3][<my mesh.obj>][$n]x3", "[count=2]"));
}

TEST_F(Script, setDefinesVariablesForTheLinesBelow) {
  EXPECT_THAT(run("say $n\nset n=2 other=\"a b\"\nsay $n $other\nset n=$n$n\nsay $n", {{"n", "1"}}),
              ElementsAre("[1]", "[2][a b]", "[22]"));
  EXPECT_THAT(complaint("set n=1 2nd=3"), HasSubstr("expected name=value, found '2nd=3'"));
}

TEST_F(Script, hugeExpansionsOfVariablesAreRefused) {
  const auto doubled = [](int times) {
    std::string text = "set a=0123456789\n";
    for (int n = 0; n < times; ++n) text += "set a=$a$a\n";
    return text;
  };
  EXPECT_EQ(complaint(doubled(19)), "no complaint");
  EXPECT_THAT(complaint(doubled(60)), HasSubstr("variables expand to more than 16777216 characters"));
}

TEST_F(Script, mistakesNameFileLineAndColumn) {
  EXPECT_EQ(complaint("say a\n  sya b"), "test.hps:2:3: unknown command 'sya'; did you mean 'say'?");
  EXPECT_EQ(complaint("say a\nsay b  coutn=2"), "test.hps:2:8: say: unknown option 'coutn'; did you mean 'count'?");
  EXPECT_EQ(complaint("say a; say b --coutn 2"), "test.hps:1:14: say: unknown option '--coutn'; did you mean 'count'?");
  EXPECT_EQ(complaint("say a count=0"), "test.hps:1:7: count: expected a whole number of at least 1, found '0'");
  EXPECT_EQ(complaint("say a count="), "test.hps:1:7: count: needs a value");
  EXPECT_THAT(complaint("\n\nsay \"open\nsay b"), HasSubstr("test.hps:3:5: this quote is not closed"));
  EXPECT_THAT(complaint("say ä $x"), HasSubstr("test.hps:1:7: unknown variable $x"));
  EXPECT_EQ(complaint("say $mseh", {{"mesh", "m"}}), "test.hps:1:5: unknown variable $mseh; did you mean '$mesh'?");
  EXPECT_THAT(complaint("say a$"), HasSubstr("test.hps:1:6: expected a variable's name"));
  EXPECT_THAT(complaint("say ${a", {{"a", "b"}}), HasSubstr("test.hps:1:5: expected }"));
}

TEST_F(Script, isCheckedCompletelyBeforeAnythingRuns) {
  EXPECT_THAT(complaint("say a\nsay count=0"), HasSubstr("test.hps:2:5"));
  EXPECT_THAT(said_, ElementsAre());
}

TEST_F(Script, stopsAtTheFirstCommandThatFails) {
  EXPECT_EQ(complaint("say a\n fail\nsay b"), "test.hps:2:2: it failed");
  EXPECT_THAT(said_, ElementsAre("[a]"));
}

/// The fixture for scripts that lie in another folder than the current one.
class Include : public Script {
 protected:
  std::string at(const std::string& name) const { return (folder_ / name).string(); }

  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }

  support::TemporaryDirectory folder_;
};

TEST_F(Include, insertsTheLinesOfAnotherScript) {
  write("b.hps", "say b $n\nset n=2 m=3");  // the last line has no newline at its end
  EXPECT_THAT(runNamed(at("a.hps"), "say a\nset n=1\ninclude b.hps; say c $n $m\ninclude b.hps"),
              ElementsAre("[a]", "[b][1]", "[c][2][3]", "[b][2]"));
  write("empty.hps", "# nothing\n");
  EXPECT_THAT(runNamed(at("a.hps"), "include empty.hps"), ElementsAre());
}

TEST_F(Include, searchesBesideTheIncludingScript) {
  write("parts/b.hps", "include c.hps");
  write("parts/c.hps", "say c");
  EXPECT_THAT(runNamed(at("a.hps"), "include parts/b.hps"), ElementsAre("[c]"));
  EXPECT_THAT(run("include " + at("parts/b.hps")), ElementsAre("[c]"));
}

TEST_F(Include, mistakesNameTheIncludedAndTheIncludingFile) {
  write("b.hps", "say b\n  sya b");
  write("c.hps", "\ninclude b.hps");
  write("fails.hps", "say b\nfail");
  EXPECT_EQ(complaintNamed(at("a.hps"), "say a\n include b.hps"),
            at("b.hps") + ":2:3: unknown command 'sya'; did you mean 'say'? (included from " + at("a.hps") + ":2:2)");
  EXPECT_THAT(said_, ElementsAre()) << "all is checked before anything runs";
  EXPECT_THAT(complaintNamed(at("a.hps"), "include c.hps"),
              HasSubstr("(included from " + at("c.hps") + ":2:1, " + at("a.hps") + ":1:1)"));
  EXPECT_EQ(complaintNamed(at("a.hps"), "say a\ninclude fails.hps"),
            at("fails.hps") + ":2:1: it failed (included from " + at("a.hps") + ":2:1)");
  EXPECT_THAT(said_, ElementsAre("[a]", "[b]"));
  EXPECT_EQ(complaintNamed(at("a.hps"), "say a\n\n  include none.hps"),
            at("a.hps") + ":3:3: " + at("none.hps") + ": no such file; check the name");
  EXPECT_THAT(said_, ElementsAre());
  EXPECT_EQ(complaintNamed(at("a.hps"), "include fails.hps\nsya"),
            at("a.hps") + ":2:1: unknown command 'sya'; did you mean 'say'?");
}

TEST_F(Include, scriptsThatIncludeThemselvesAreRefused) {
  write("self.hps", "say a\n include self.hps");
  write("one.hps", "include two.hps");
  write("two.hps", "include ../" + folder_.path().filename().string() + "/one.hps");
  EXPECT_THAT(complaintNamed(at("a.hps"), "include self.hps"),
              HasSubstr("self.hps:2:2: " + at("self.hps") + ": includes itself"));
  EXPECT_THAT(complaintNamed(at("one.hps"), "include two.hps"), HasSubstr("two.hps:1:1: "));
}

TEST_F(Include, sixteenLevelsOfIncludesAreAllowed) {
  for (int depth = 1; depth < 18; ++depth)
    write("d" + std::to_string(depth) + ".hps", "include d" + std::to_string(depth + 1) + ".hps");
  write("d18.hps", "say deep");
  EXPECT_THAT(complaintNamed(at("a.hps"), "include d1.hps"), HasSubstr("more than 16 scripts include each other"));
  EXPECT_EQ(complaintNamed(at("a.hps"), "include d4.hps"), "no complaint");
  EXPECT_THAT(said_, ElementsAre("[deep]"));
}

TEST_F(Include, hugeNumbersOfCommandsAreRefused) {
  for (int depth = 1; depth < 6; ++depth) {
    std::string ten;
    for (int n = 0; n < 10; ++n) ten += "include d" + std::to_string(depth + 1) + ".hps\n";
    write("d" + std::to_string(depth) + ".hps", ten);
  }
  write("d6.hps", "");
  EXPECT_THAT(complaintNamed(at("a.hps"), "include d1.hps"), HasSubstr("more than 100000 commands"));
  EXPECT_EQ(complaintNamed(at("a.hps"), "include d2.hps"), "no complaint");
}

/// Files that cannot be read to their end are refused, because a truncated script would look complete.
TEST_F(Include, filesAreReadCompletely) {
  write("long", "");
  std::filesystem::resize_file(at("long"), kMostTextBytes + 1);
  const auto complaintOf = [](const std::string& file) {
    try {
      readTextFile(file);
      return std::string("no complaint");
    } catch (const Error& error) {
      return std::string(error.what());
    }
  };
  EXPECT_EQ(complaintOf(at("long")), at("long") + ": is longer than 67108864 bytes; check that it is the right one");
  std::filesystem::resize_file(at("long"), kMostTextBytes);
  EXPECT_EQ(complaintOf(at("long")), "no complaint");
  EXPECT_EQ(complaintOf("/dev/zero"), "/dev/zero: is a device; give a file");
  // Reading /proc/self/mem fails, because no memory is mapped at address 0.
  EXPECT_EQ(complaintOf("/proc/self/mem"), "/proc/self/mem: cannot be read to its end; check where it lies");
}

TEST_F(Include, devicesAreNotRead) {
  EXPECT_THAT(complaintNamed(at("a.hps"), "include /dev/zero"), HasSubstr("/dev/zero: is not a regular file"));
}

TEST_F(Include, includedCallsBelongToTheLineOfTheInclude) {
  write("b.hps", "say 1\nsay 2\n");
  const auto calls = parseScript(registry_, at("a.hps"), "say a\n\ninclude b.hps\nsay c", {});
  std::vector<int> lines;
  for (const Call& call : calls) lines.push_back(call.line);
  EXPECT_THAT(lines, ElementsAre(1, 3, 3, 3, 4));
}

TEST(Variables, haveAFixedForm) {
  EXPECT_THAT(parseVariables({"a=1", "b_2=x=y", "c="}),
              ElementsAre(std::pair("a", "1"), std::pair("b_2", "x=y"), std::pair("c", "")));
  EXPECT_THROW(parseVariables({"a"}), Error);
  EXPECT_THROW(parseVariables({"=1"}), Error);
  EXPECT_THROW(parseVariables({"a-b=1"}), Error);
}

}  // namespace script_test
}  // namespace hpsdf::app
