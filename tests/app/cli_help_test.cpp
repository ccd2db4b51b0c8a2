// Tests help texts, the reference page and misspelled words in a call.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli_fixture.h"
#include "hpsdf/render/color_maps.h"
#include "hpsdf/render/picture_settings.h"
#include "pictures/colors_help.h"
#include "text/text.h"

namespace hpsdf::app {
namespace cli_help_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using HelpCommand = Cli;

TEST_F(HelpCommand, helpAndVersionArePrinted) {
  for (const Call& call : {Call{{"--help"}}, Call{{"-h"}}, Call{{"help"}}}) {
    const Outcome help = run(call);
    EXPECT_EQ(help.status, 0);
    EXPECT_THAT(help.err, IsEmpty());
    for (const char* verb : {"build", "info", "query", "slice", "render", "run", "shapes", "doctor", "report", "mesh"})
      EXPECT_THAT(help.out, HasSubstr("\n  " + std::string(verb)));
  }
  const Outcome verb = run({{"slice", "--help"}});
  EXPECT_EQ(verb.out, run({{"help", "slice"}}).out);
  EXPECT_THAT(verb.out, HasSubstr("--plane PX,PY,PZ,NX,NY,NZ"));
  EXPECT_THAT(run({{"build", "--help"}}).out, HasSubstr("τ·(L/2)^5"));
  EXPECT_THAT(run({{"--version"}}).out, testing::MatchesRegex("hpsdf [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST_F(HelpCommand, colorsAreListedWithTheirMaps) {
  const Outcome listed = run({{"help", "colors"}});
  EXPECT_EQ(listed.status, 0);
  EXPECT_THAT(listed.out, Not(HasSubstr("\x1b"))) << "the output is no terminal";
  for (const render::ColorMode& mode : render::colorModes()) EXPECT_THAT(listed.out, HasSubstr(mode.name));
  for (const render::ColorMap& map : render::colorMaps()) {
    EXPECT_THAT(listed.out, HasSubstr("\n  " + map.name + " "));
    EXPECT_THAT(listed.out, HasSubstr(colorText(render::colorsOf(map, 5)[3])));
  }
  for (const int level : {0, 3, kExactDegree}) EXPECT_THAT(listed.out, HasSubstr(colorText(render::levelColor(level))));
  const std::string bars = colorsHelp(true);
  const render::Color third = render::levelColor(3);
  EXPECT_THAT(bars, HasSubstr(fmt::format("\x1b[48;2;{};{};{}m    \x1b[0m", third[0], third[1], third[2])));
}

TEST_F(HelpCommand, referencePageIsWrittenCompletelyOrNotAtAll) {
  const Outcome shown = run({{"docs"}});
  EXPECT_EQ(shown.status, 0);
  EXPECT_THAT(shown.out, StartsWith("# Commands\n"));
  EXPECT_THAT(shown.out, HasSubstr("\n## docs\n"));
  const Outcome written = run({{"docs", "-o", at("commands.md")}});
  EXPECT_EQ(written.status, 0) << written.err;
  EXPECT_EQ(readFile(at("commands.md")), shown.out);
  EXPECT_EQ(Json::parse(run({{"docs", "--json"}}).out).at("page"), shown.out);
  expectRefused({{"docs", "-o", at("none/commands.md")}}, "none/commands.md");
}

TEST_F(HelpCommand, usageMistakesAreRefused) {
  expectRefused({{}}, "expected a command");
  expectRefused({{"bild"}}, "unknown command 'bild'; did you mean 'build'?");
  expectRefused({{"part.stl"}}, "part.stl: no such file, and no command either");
  expectRefused({{"part.hpsdf"}}, "part.hpsdf: no such file, and no command either");
  writeFile(at("notes.txt"), "no field, no mesh");
  expectRefused({{at("notes.txt")}},
                "notes.txt: this is neither a field nor a mesh, which are the files that hpsdf opens");
  expectRefused({{at("missing.txt")}}, "unknown command");
  expectRefused({{"--halp"}}, "unknown command '--halp'");
  expectRefused({{"help", "slcie"}}, "did you mean 'slice'?");
  expectRefused({{"save", "-o", at("x.hpsdf")}}, "'save' is a command of scripts");
  expectRefused({{"build", "builtin:torus"}}, "--output is missing");
  expectRefused({{"slice", field(), "-o", at("x.gif")}}, "expected .png, .svg or .pdf for a picture, .pfm or .csv");
  expectRefused({{"render", field(), "-o", at("x.csv")}}, "written as .png");
  expectRefused({{"slice", field(), "-o", at("x.pfm"), "--samples", "2"}}, "one sample a pixel");
  expectRefused({{"slice", field(), "-o", at("x.csv"), "--arrows", "20"}}, "no arrows");
  expectRefused({{"render", field(), "-o", at("x.png"), "--cpu", "--gl", "software"}}, "cpu excludes gl");
}

TEST_F(HelpCommand, everyCommandReportsAsJson) {
  for (const Call& call :
       {Call{{"shapes", "--json"}}, Call{{"help", "--json"}}, Call{{"mesh", "builtin:box", "--json"}},
        Call{{"doctor", "--gl", "software", "--json"}}, Call{{"query", field(), "--json"}, "0 0 0\n"},
        Call{{"run", "--json", "-e", "load \"" + field() + "\""}}}) {
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(Json::accept(outcome.out)) << call.words[0] << ":\n" << outcome.out;
  }
  const Json doctor = Json::parse(run({{"doctor", "--json"}}).out);
  for (const char* key : {"version", "compiler", "renderer", "simd", "threads", "assimp"})
    EXPECT_TRUE(doctor.contains(key));
}

TEST_F(HelpCommand, badOptionsAreRefused) {
  const auto build = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"build", "builtin:torus", "-o", at("f.hpsdf")};
    words.insert(words.end(), more.begin(), more.end());
    return Call{words};
  };
  expectRefused(build({"--target-error", "0"}), "--target-error: expected a number above 0");
  expectRefused(build({"--target-error", "-1"}), "--target-error: expected a number above 0");
  expectRefused(build({"--target-error", "nan"}), "--target-error: expected a number above 0");
  expectRefused(build({"--grid", "0"}), "--grid: expected");
  expectRefused(build({"--grid", "100000"}), "builtin:torus: base grid 100000");
  expectRefused(build({"--grid", "2000000000"}), "base grid");
  expectRefused(
      build({"--grid", "100", "--memory-limit", "1e8"}),
      "1e+06 cells and would need 330.00 MB, more than the 100.00 MB allowed: take a coarser grid, at most 67 an "
      "axis, or allow more memory");
  expectRefused(build({"--grid", "800", "--memory-limit", "1e15"}), "base grid 800");
  expectRefused(build({"--max-degree", "31"}), "--max-degree: expected a whole number from 1 to 30");
  expectRefused(build({"--domain", "1,1,1,0,0,0"}), "expected lower corner");
  expectRefused(build({"--nearness", "nan"}), "--nearness");
  expectRefused(build({"--margin", "inf"}), "--margin");
}

}  // namespace cli_help_test
}  // namespace hpsdf::app
