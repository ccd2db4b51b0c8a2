// Tests `hpsdf turntable`, `frames` and `report`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli_fixture.h"
#include "files/html_page.h"
#include "hpsdf/field_file.h"
#include "hpsdf/render/image.h"

namespace hpsdf::app {
namespace cli_film_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using Films = Cli;

TEST_F(Films, turntableEqualsRenderFromAllDirections) {
  const std::vector<std::string> look = {"--size", "120x90", "--cpu", "--color", "degree"};
  const auto with = [&](std::vector<std::string> words) {
    words.insert(words.end(), look.begin(), look.end());
    return run({words});
  };
  const Outcome turned = with({"turntable", field(), "-o", at("turn"), "--frames", "4", "--camera=-20,15,1.2"});
  ASSERT_EQ(turned.status, 0) << turned.err;
  EXPECT_THAT(turned.out, HasSubstr("turn: 4 frames, 120x90"));
  EXPECT_THAT(namesIn(at("turn")),
              ElementsAre("frame-0000.png", "frame-0001.png", "frame-0002.png", "frame-0003.png", "frames.json"));
  for (int frame = 0; frame < 4; ++frame) {
    const std::string camera = std::to_string(-20 + 90 * frame) + ",15,1.2";
    ASSERT_EQ(with({"render", field(), "-o", at("one.png"), "--camera=" + camera}).status, 0);
    EXPECT_TRUE(readFile(at("turn/frame-000" + std::to_string(frame) + ".png")) == readFile(at("one.png"))) << camera;
  }

  // A shorter film in the same folder replaces all frames of a longer one.
  const Outcome again = with({"turntable", field(), "-o", at("turn"), "--frames", "2", "--view", "left", "--json"});
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_THAT(namesIn(at("turn")), ElementsAre("frame-0000.png", "frame-0001.png", "frames.json"));
  const Json json = Json::parse(again.out);
  EXPECT_EQ(json, Json::parse(readFile(at("turn/frames.json"))));
  EXPECT_EQ(json.at("frames")[1], (Json{{"file", "frame-0001.png"}, {"azimuth", 90}}));

  fs::create_directory(at("mine"));
  writeFile(at("mine/frame-0000.png"), "years of work");
  expectRefused({{"turntable", field(), "-o", at("mine"), "--frames", "2"}},
                "holds files that are not earlier results");
  EXPECT_EQ(readFile(at("mine/frame-0000.png")), "years of work");
  expectRefused({{"turntable", field(), "-o", at("x.gif"), "--frames", "2"}}, "a name that ends in .mp4");
  expectRefused({{"turntable", field(), "-o", at("mine/frame-0000.png/x")}}, "cannot make this folder");
  expectRefused({{"turntable", field(), "-o", at("x"), "--camera", "0,99,1"}}, "elevation");
  expectRefused({{"turntable", at("none.hpsdf"), "-o", at("new/x")}}, "no such file");
}

TEST_F(Films, framesShowTheRefinement) {
  const std::string tau = "1e-4";
  const auto frames = [&](const std::string& output, const std::string& look) {
    return run({{"frames", "builtin:torus", "--target-error", tau, "-o", at(output), "--frames", "5", "--of",
                 look + " size=160x120 cpu=true", "--json"}});
  };
  const Outcome drawn = frames("f", "slice color=degree");
  ASSERT_EQ(drawn.status, 0) << drawn.err;
  EXPECT_EQ(namesIn(at("f")).size(), 6u);
  const Json rows = Json::parse(drawn.out).at("frames");
  ASSERT_EQ(rows.size(), 5u);
  EXPECT_EQ(rows[0].at("steps"), 0);
  EXPECT_EQ(rows[1].at("steps"), 1);
  const Field finished = load(field());
  EXPECT_EQ(rows[4].at("steps"), finished.metadata().steps.value());
  EXPECT_EQ(rows[4].at("leaves"), statistics(finished).leaves);

  const auto fieldAfter = [&](std::size_t frame) {
    EXPECT_EQ(run({{"build", "builtin:torus", "--target-error", tau, "-o", at("s.hpsdf"), "--max-steps",
                    rows[frame].at("steps").dump()}})
                  .status,
              0);
    return load(at("s.hpsdf"));
  };
  for (std::size_t frame = 0; frame < 5; ++frame) {
    EXPECT_EQ(statistics(fieldAfter(frame)).leaves, rows[frame].at("leaves"));
    ASSERT_EQ(run({{"slice", at("s.hpsdf"), "-o", at("s.png"), "--size", "160x120", "--cpu"}}).status, 0);
    EXPECT_TRUE(readFile(at("f/frame-000" + std::to_string(frame) + ".png")) == readFile(at("s.png"))) << frame;
  }

  // All frames have the colour scale of the last frame.
  ASSERT_EQ(frames("d", "slice color=distance axis=x").status, 0);
  ASSERT_EQ(
      run({{"slice", field(), "-o", at("s.png"), "--size", "160x120", "--cpu", "--color", "distance", "--axis", "x"}})
          .status,
      0);
  EXPECT_TRUE(readFile(at("d/frame-0004.png")) == readFile(at("s.png")));
  ASSERT_EQ(frames("e", "render color=error").status, 0);
  ASSERT_EQ(run({{"render", field(), "-o", at("s.png"), "--size", "160x120", "--cpu", "--color", "error"}}).status, 0);
  EXPECT_TRUE(readFile(at("e/frame-0004.png")) == readFile(at("s.png")));

  // With fewer construction steps than frames, there is one frame for each step.
  const Outcome few = run({{"frames", "builtin:torus", "--max-steps", "2", "-o", at("few"), "--of", "slice cpu=true"}});
  EXPECT_THAT(few.out, HasSubstr("few: 3 frames"));

  expectRefused({{"frames", "builtin:torus", "-o", at("x"), "--of", "slice colour=depth"}},
                "of:1:7: slice: unknown option 'colour'");
  expectRefused({{"frames", "builtin:torus", "-o", at("x"), "--of", "slice output=a.png"}}, "unknown option 'output'");
  expectRefused({{"frames", "builtin:torus", "-o", at("x"), "--of", "info"}}, "of:1:1: unknown command 'info'");
  expectRefused({{"frames", "builtin:torus", "-o", at("x"), "--of", "slice; slice"}}, "expected one command");
  expectRefused({{"frames", "builtin:torus", "-o", at("x"), "--of", "slice axis=x plane=0,0,0,0,0,1"}}, "plane");
}

TEST_F(Films, filmsNeedFfmpegAndLeaveNoOtherFiles) {
  fs::create_directory(at("tmp"));
  fs::create_directory(at("bin"));
  const auto film = [&](const std::string& path) {
    return Call{.words = {"turntable", field(), "-o", at("film.mp4"), "--frames", "3", "--size", "61x40", "--cpu"},
                .environment = {{"PATH", path}, {"TMPDIR", at("tmp")}}};
  };
  const auto ffmpeg = [&](const std::string& lines) {
    writeFile(at("bin/ffmpeg"), "#!/bin/sh\n" + lines);
    fs::permissions(at("bin/ffmpeg"), fs::perms::owner_all);
  };
  expectRefused(film(at("none")), "needs the program ffmpeg, which is not in PATH; install it, or give a folder");
  ffmpeg("echo first >&2; echo 'no such codec' >&2; exit 3\n");
  expectRefused(film(at("bin")), "ffmpeg failed with status 3 (no such codec)");
  EXPECT_THAT(namesIn(at("tmp")), IsEmpty());

  ffmpeg("echo frame-*.png \"$@\" > film.mp4\n");
  const Outcome made = run(film(at("none") + ":" + at("bin")));
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_THAT(readFile(at("film.mp4")), StartsWith("frame-0000.png frame-0001.png frame-0002.png "));
  EXPECT_THAT(readFile(at("film.mp4")), HasSubstr("-framerate 12 "));
  EXPECT_THAT(namesIn(at("tmp")), IsEmpty());
  expectRefused({.words = {"turntable", field(), "-o", at("none/film.mp4")}, .environment = {{"PATH", at("bin")}}},
                "none/film.mp4");
}

TEST_F(Films, reportIsOnePageWithItsPictures) {
  const Outcome outcome =
      run({{"report", "builtin:torus", "-o", at("new/report"), "--target-error", "1e-3", "--cpu", "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_GT(json.at("frame_seconds").get<double>(), 0);
  const std::string page = readFile(at("new/report/index.html"));
  for (const char* picture : {"surface.png", "degree.png", "depth.png", "distance.png", "surface-degree.png"}) {
    EXPECT_THAT(page, HasSubstr("src=\"" + std::string(picture) + "\""));
    EXPECT_EQ(render::loadPng(at("new/report/") + picture).width, 1280);
  }
  EXPECT_THAT(page, HasSubstr("hpsdf build builtin:torus -o torus.hpsdf --target-error=1e-3"));
  EXPECT_THAT(page, AllOf(HasSubstr("% of the surface torn"), HasSubstr("on the wrong side"),
                          ContainsRegex("RMS [0-9.e-]+, greatest [0-9.e-]+; over the longest side: RMS ")));
  EXPECT_THAT(page, Not(HasSubstr("http")));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_NO_THROW(load(at("new/report/torus.hpsdf")));
  EXPECT_THAT(page, HasSubstr("<iframe src=\"explorer.html\""));
  EXPECT_EQ(json.at("explorer").get<std::string>(), at("new/report/explorer.html"));
  EXPECT_THAT(readFile(at("new/report/explorer.html")), HasSubstr("class=\"field\" data-name=\"torus\""));
}

TEST(ReportPage, escapesWhatItShows) {
  ReportPage page{.title = "<b>&\"", .subtitle = "s"};
  page.pictures.push_back({"x.png", "a<b", "c&d", "hpsdf build 'a<b'"});
  const std::string html = reportHtml(page);
  EXPECT_THAT(html, HasSubstr("<h1>&lt;b&gt;&amp;&quot;</h1>"));
  EXPECT_THAT(html, HasSubstr("hpsdf build 'a&lt;b'"));
  EXPECT_THAT(html, Not(HasSubstr("<b>&")));
}

}  // namespace cli_film_test
}  // namespace hpsdf::app
