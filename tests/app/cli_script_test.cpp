// Tests scripts and the commands that exist in scripts only.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "cli_fixture.h"
#include "hpsdf/field_file.h"
#include "hpsdf/render/image.h"
#include "support/require_gl.h"

namespace hpsdf::app {
namespace cli_script_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using Scripts = Cli;

TEST_F(Scripts, scriptsWorkOnTheCurrentField) {
  writeFile(at("s.hps"),
            "build analytic:sphere target-error=$tau grid=2\nslice size=64x64 cpu=true output=\"a b.png\"\n"
            "save -o s.hpsdf\nload s.hpsdf\nquery points=points.txt output=q.csv\n");
  writeFile(at("points.txt"), "0 0 0\n");
  const Outcome outcome = run({.words = {"run", "s.hps", "tau=1e-3"}, .folder = folder_.path()});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("a b.png", "points.txt", "q.csv", "s.hps", "s.hpsdf"));
  EXPECT_EQ(load(at("s.hpsdf")).metadata().settings.targetError.weighted(), 1e-3);
}

TEST_F(Scripts, linesOfTheCommandLineAreRun) {
  const Outcome outcome = run({{"run", "-e", "load \"$file\"; info --json", "-e", "info --json", "file=" + field()}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out.find("\"leaves\""), outcome.out.rfind("\"leaves\"", outcome.out.size() / 2));
  EXPECT_NE(outcome.out.find("\"leaves\""), outcome.out.rfind("\"leaves\""));
}

TEST_F(Scripts, scriptsRunScripts) {
  writeFile(at("inner.hps"), "slice size=64x64 cpu=true output=$name.png\n");
  writeFile(at("outer.hps"), "load \"$field\"\nrun inner.hps name=one\nrun inner.hps name=two\n");
  const Outcome outcome = run({.words = {"run", "outer.hps", "field=" + field()}, .folder = folder_.path()});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("inner.hps", "one.png", "outer.hps", "two.png"));
  writeFile(at("loop.hps"), "run loop.hps\n");
  expectRefused({.words = {"run", "loop.hps"}, .folder = folder_.path()}, "check whether one runs itself");
}

TEST_F(Scripts, scriptsIncludeScripts) {
  fs::create_directory(at("parts"));
  writeFile(at("parts/settings.hps"), "set size=64x64 name=one\n");
  writeFile(at("a.hps"),
            "include parts/settings.hps\nload \"$field\"\nslice size=$size cpu=true output=\"$to/$name.png\"\n");
  const std::vector<std::string> words = {"run", at("a.hps"), "field=" + field(), "to=" + folder_.path().string()};
  const Outcome outcome = run({.words = words, .folder = "/"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(render::loadPng(at("one.png")).width, 64);
  writeFile(at("parts/settings.hps"), "set size=64x64 name=two\ninclude ../a.hps");
  expectRefused({.words = words, .folder = "/"}, "settings.hps:2:1: ");
  expectRefused({.words = words, .folder = "/"}, "includes itself");
  writeFile(at("b.hps"), "include none.hps");
  expectRefused({{"run", at("b.hps")}}, "b.hps:1:1: " + at("none.hps") + ": no such file");
}

TEST_F(Scripts, expectationsHoldOrEndTheScript) {
  const Json info = Json::parse(run({{"info", field(), "--json"}}).out);
  const std::string leaves = std::to_string(info.at("leaves").get<int>());
  writeFile(at("s.hps"), "load \"" + field() + "\"\nexpect stats.leaves == " + leaves +
                             "\nexpect jumps.max > 0; expect jumps.max < 1\n"
                             "slice axis=z cpu=true size=320x240 output=" +
                             at("s.png") +
                             "\nexpect pick(100,100).degree >= 1\nexpect at(0,0,0.1).error == 0 within 0.1\n");
  const Outcome good = run({{"run", at("s.hps")}});
  EXPECT_EQ(good.status, 0) << good.err;

  writeFile(at("bad.hps"), "load \"" + field() + "\"\nslice cpu=true size=64x48 output=" + at("kept.png") +
                               "\n  expect stats.leaves < 3\nslice cpu=true output=" + at("never.png"));
  const Outcome failed = run({{"run", at("bad.hps")}});
  EXPECT_EQ(failed.status, 1);
  EXPECT_THAT(failed.err, HasSubstr("bad.hps:3:3: expected stats.leaves < 3, found " + leaves));
  EXPECT_TRUE(fs::exists(at("kept.png")));
  EXPECT_FALSE(fs::exists(at("never.png")));

  const auto complaint = [&](const std::string& line) {
    const Outcome outcome = run({{"run", "-e", "load \"" + field() + "\"; " + line}});
    EXPECT_EQ(outcome.status, 2) << line;
    return outcome.err;
  };
  EXPECT_THAT(complaint("expect stats.leafs < 3"), HasSubstr("did you mean 'leaves'?"));
  EXPECT_THAT(complaint("expect stats.mesh < 3"), HasSubstr("no number"));
  EXPECT_THAT(complaint("expect pick(3,4).degree == 3"), HasSubstr("no picture yet"));
  EXPECT_THAT(complaint("slice cpu=true size=64x48 output=" + at("p.png") + "; pick 64,3"),
              HasSubstr("outside of the picture"));
  // A mistake in the last line is found before the first line runs.
  EXPECT_THAT(complaint("slice output=" + at("unseen.png") + "; expect stat.leaves < 3"), HasSubstr("'stats'"));
  EXPECT_FALSE(fs::exists(at("unseen.png")));
}

/// `pick` must report the value of the field at the point that the pixel shows.
TEST_F(Scripts, picksAgreeWithQueries) {
  HPSDF_REQUIRE_GL();
  const Field torus = load(field());
  for (const char* look :
       {"slice axis=z offset=0.05 color=degree", "slice plane=0,0,0,1,2,3 color=distance samples=2",
        "render camera=40,30,1", "render camera=40,30,1 projection=orthographic", "slice axis=x cpu=true"}) {
    const std::string backend = std::string(look).find("cpu") == std::string::npos ? " gl=software" : "";
    std::string script = "load \"" + field() + "\"\n" + look + backend + " size=320x240 output=" + at("p.png") + "\n";
    for (int n = 0; n < 200; ++n)
      script += "pick " + std::to_string(n * 37 % 260) + "," + std::to_string(n * 53 % 200) + "\n";
    writeFile(at("picks.hps"), script);
    const Outcome outcome = run({{"run", "--json", at("picks.hps")}});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    std::istringstream documents(outcome.out);
    int hits = 0, odd = 0;
    Json pick;
    for (int document = 0; document < 202; ++document) {
      pick.clear();
      documents >> pick;
      if (!pick.is_object() || !pick.contains("cell")) continue;
      ++hits;
      const Vector3 x(pick["position"][0], pick["position"][1], pick["position"][2]);
      EXPECT_NEAR(pick["value"].get<double>(), torus.value(x), 1e-5);
      const Cell cell = torus.cellAt(x);
      odd += pick["cell"] != cell.id || pick["degree"] != cell.degree || pick["depth"] != cell.depth;
    }
    EXPECT_GT(hits, 60) << look;
    // Hit points of rays are rounded and may lie in the neighbouring cell; points of a slice are exact.
    EXPECT_LE(odd, std::string(look).starts_with("render") ? hits / 50 : 0) << look;
  }
}

/// A message would end at a zero byte if it were printed as it is.
TEST_F(Scripts, zeroBytesDoNotCutMessages) {
  using namespace std::string_view_literals;
  writeFile(at("verb.hps"), "in\0fo x\n"sv);
  expectRefused({{"run", at("verb.hps")}}, "unknown command 'in fo'; did you mean 'info'?");
  writeFile(at("name.hps"), "load \"a\0b.hpsdf\"\n"sv);
  expectRefused({{"run", at("name.hps")}}, "a b.hpsdf: no such file; check the");
  writeFile(at("points"), "1 2\0 3\n"sv);
  const Outcome outcome = run({{"query", field(), at("points")}});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.err, EndsWith("points:1: expected three finite numbers x,y,z, found '1 2  3'\n"));
}

TEST_F(Scripts, scriptMistakesAreRefused) {
  writeFile(at("s.hps"), "load \"" + field() + "\"\nslice colour=degree output=x.png\n");
  expectRefused({.words = {"run", "s.hps"}, .folder = folder_.path()},
                "s.hps:2:7: slice: unknown option 'colour'; did you mean 'color'?");
  expectRefused({{"run", "-e", "info"}}, "-e:1:1: there is no field yet");
  expectRefused({{"run", "-e", "load " + at("none.hpsdf")}}, "none.hpsdf");
  expectRefused({{"run", at("none.hps")}}, "none.hps: no such file");
  expectRefused({{"run", folder_.path().string()}}, "is a folder");
  expectRefused({{"run", at("s.hps"), "tau"}}, "expected name=value, found 'tau'");
  expectRefused({{"run"}}, "give a script's file");
}

}  // namespace cli_script_test
}  // namespace hpsdf::app
