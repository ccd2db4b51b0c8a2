// The program as its user meets it: most tests start the real one.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "console/progress_line.h"
#include "files/html_page.h"
#include "hpsdf/detail/cubic_grid.h"
#include "hpsdf/error.h"
#include "hpsdf/field_file.h"
#include "hpsdf/jumps.h"
#include "hpsdf/render/image.h"
#include "language/point_query.h"
#include "started_program.h"
#include "support/one_leaf_field.h"
#include "support/require_gl.h"
#include "support/short_files.h"
#include "support/temporary_directory.h"
#include "text/json.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;  // keys sorted: equality of what is read, whatever its order
using started::Call;
using started::lineCount;
using started::namesIn;
using started::Process;
using started::readFile;
using started::run;
using started::writeFile;
using testing::AllOf;
using testing::ContainsRegex;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;
using Clock = std::chrono::steady_clock;

constexpr std::string_view kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

/// assimp's reader of JSON calls itself at each bracket, until its stack is used up.
const std::string kBringsAssimpDown(200'000, '[');

/// Cutting this face, all on one line to and fro, takes the square of its corners: tens of seconds.
std::string slowPolygon() {
  constexpr int kCorners = 100'000;
  std::ostringstream file;
  for (int i = 0; i < kCorners; ++i) file << "v " << (i % 2 == 0 ? kCorners - i : i) << " 0 0\n";
  file << "f";
  for (int i = 1; i <= kCorners; ++i) file << " " << i;
  return file.str() + "\n";
}

/// A folder of its own for each test, and in it a small field, built once by the program itself.
class Cli : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new support::TemporaryDirectory;
    const Outcome built = run({.words = {"build", "builtin:torus", "-o", field(), "--target-error", "1e-4"}});
    ASSERT_EQ(built.status, 0) << built.err;
  }
  static void TearDownTestSuite() {
    delete shared_;
    shared_ = nullptr;
  }
  static std::string field() { return (*shared_ / "torus.hpsdf").string(); }

  std::string at(const std::string& name) const { return (folder_ / name).string(); }

  /// Bad input: status 2, one line that holds `message`, nothing on standard output, and no file besides `before`.
  void expectRefused(const Call& call, const std::string& message, const std::set<std::string>& before) const {
    std::string line;
    for (const std::string& word : call.words) line += " " + word;
    SCOPED_TRACE("hpsdf" + line);
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_EQ(lineCount(outcome.err), 1u) << outcome.err;
    EXPECT_THAT(outcome.err, StartsWith("hpsdf: error: "));
    EXPECT_THAT(outcome.err, HasSubstr(message));
    EXPECT_THAT(outcome.out, IsEmpty());
    EXPECT_EQ(namesIn(folder_.path()), before);
  }
  void expectRefused(const Call& call, const std::string& message) const {
    expectRefused(call, message, namesIn(folder_.path()));
  }

  support::TemporaryDirectory folder_;

 private:
  static inline support::TemporaryDirectory* shared_ = nullptr;
};

// Help and plain behaviour

TEST_F(Cli, helpAndVersion) {
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

TEST_F(Cli, theReferenceIsWrittenWholeOrNotAtAll) {
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

TEST_F(Cli, usageMistakesAreRefused) {
  expectRefused({{}}, "expected a command");
  expectRefused({{"bild"}}, "unknown command 'bild'; did you mean 'build'?");
  expectRefused({{"--halp"}}, "unknown command '--halp'");
  expectRefused({{"help", "slcie"}}, "did you mean 'slice'?");
  expectRefused({{"save", "-o", at("x.hpsdf")}}, "'save' is a command of scripts");
  expectRefused({{"build", "builtin:torus"}}, "--output is missing");
  expectRefused({{"slice", field(), "-o", at("x.gif")}}, "expected .png for a picture, .pfm or .csv");
  expectRefused({{"render", field(), "-o", at("x.csv")}}, "written as .png");
  expectRefused({{"slice", field(), "-o", at("x.pfm"), "--samples", "2"}}, "one sample a pixel");
  expectRefused({{"slice", field(), "-o", at("x.csv"), "--arrows", "20"}}, "no arrows");
  expectRefused({{"render", field(), "-o", at("x.png"), "--cpu", "--gl", "software"}}, "cpu excludes gl");
}

TEST_F(Cli, buildWritesAFieldThatLoads) {
  const Outcome built = run({{"build", "builtin:sphere", "-o", at("s.hpsdf"), "--target-error", "1e-3", "--json"}});
  ASSERT_EQ(built.status, 0) << built.err;
  const Json json = Json::parse(built.out);
  EXPECT_GT(json.at("build_seconds").get<double>(), 0);
  const Field loaded = load(at("s.hpsdf"));
  const FieldStatistics counts = statistics(loaded);
  EXPECT_EQ(json.at("leaves"), counts.leaves);
  EXPECT_EQ(json.at("coefficients"), counts.coefficients);
  EXPECT_EQ(json.at("mesh_report").at("closed"), true);
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("s.hpsdf"));
}

TEST_F(Cli, normalizedCubeIsExact) {
  writeFile(at("t.obj"), kTetrahedron);
  const auto domainOf = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"build", at("t.obj"), "-o", at("t.hpsdf"), "--target-error", "1e-2", "--json"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome built = run({words});
    EXPECT_EQ(built.status, 0) << built.err;
    return Json::parse(built.out).at("domain");
  };
  const double edge = 1 + 0.1;
  EXPECT_EQ(domainOf({"--normalize"}), Json({{-edge, -edge, -edge}, {edge, edge, edge}}));
  EXPECT_EQ(domainOf({"--paper"}), Json({{-edge, -edge, -edge}, {edge, edge, edge}}));
  EXPECT_EQ(domainOf({"--normalize", "--margin", "0.5"}), Json({{-1.5, -1.5, -1.5}, {1.5, 1.5, 1.5}}));
  EXPECT_EQ(domainOf({"--domain", "-1,-2,-3,4,5,6"}), Json({{-1, -2, -3}, {4, 5, 6}}));
  const Json plain = domainOf({});
  EXPECT_NEAR(plain[0][0].get<double>(), -0.05, 1e-12);
  EXPECT_NEAR(plain[1][2].get<double>(), 1.05, 1e-12);
}

TEST_F(Cli, analyticShapesAreNormalizedToo) {
  const Outcome built = run({{"build", "analytic:sphere,radius=0.25", "-o", at("s.hpsdf"), "--normalize",
                              "--target-error", "1e-5", "--grid", "3"}});
  ASSERT_EQ(built.status, 0) << built.err;
  const Field sphere = load(at("s.hpsdf"));
  EXPECT_NEAR(sphere.value(Vector3(1, 0, 0)), 0, 0.02);
  EXPECT_NEAR(sphere.value(Vector3(0, 0.5, 0)), -0.5, 0.02);
}

TEST_F(Cli, openMeshesAreWarnedAbout) {
  writeFile(at("open.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const auto built = [&](const std::string& sign) {
    const Outcome outcome = run({{"build", at("open.obj"), "-o", at("f.hpsdf"), "--target-error", "1", "--domain",
                                  "-1,-1,-1,2,2,2", "--sign", sign}});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(built("pseudonormal"),
              HasSubstr("warning: " + at("open.obj") + ": the surface is not closed (3 boundary"));
  EXPECT_THAT(built("auto"), HasSubstr("sign by winding number: 3 edges have a side without a neighbour"));
  EXPECT_THAT(built("auto"), testing::Not(HasSubstr("warning")));
  const Json mesh = Json::parse(run({{"mesh", at("open.obj"), "--json"}}).out);
  EXPECT_EQ(mesh.at("closed"), false);
  EXPECT_EQ(mesh.at("boundary_edges"), 3);
}

TEST_F(Cli, memoryIsLimitedWhereNothingSaysHowFineToBe) {
  std::string soup;  // triangles here and there, which surround nothing
  std::uint32_t random = 1;
  const auto number = [&] { return double((random = random * 1664525 + 1013904223) >> 8) / 0x1p24; };
  for (int v = 0; v < 300; ++v) {
    const double x = number(), y = number(), z = number();
    soup += fmt::format("v {} {} {}\n", x, y, z);
  }
  for (int t = 0; t < 100; ++t) soup += fmt::format("f {} {} {}\n", 3 * t + 1, 3 * t + 2, 3 * t + 3);
  writeFile(at("soup.obj"), soup);
  const auto built = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"build", at("soup.obj"), "-o", at("soup.hpsdf"), "--sign", "pseudonormal"});
    return run({more});
  };
  const Outcome limited = built({"--memory-limit", "1e6"});
  EXPECT_EQ(limited.status, 2);
  EXPECT_THAT(limited.err, HasSubstr("of memory are needed, more than the 1.00 MB allowed"));
  EXPECT_FALSE(std::filesystem::exists(at("soup.hpsdf")));
  EXPECT_EQ(built({"--memory-limit", "1e8", "--target-error", "1"}).status, 0);
  const Outcome small = run({{"build", "analytic:sphere", "-o", at("s.hpsdf"), "--grid", "1", "--target-error", "1e-14",
                              "--memory-limit", "1e5"}});
  EXPECT_EQ(small.status, 2);
  EXPECT_THAT(small.err, ContainsRegex("about [0-9]+ cells and [0-9.]+ kB of memory are needed")) << "not 0.00 million";
}

TEST_F(Cli, memoryOfTheDistanceCountsWhereALimitIsGiven) {
  const auto built = [&](const std::string& surface, std::vector<std::string> more) {
    more.insert(more.begin(), {"build", surface, "-o", at("f.hpsdf"), "--max-steps", "0"});
    return run({more});
  };
  const Outcome limited = built("builtin:torus", {"--memory-limit", "1e7"});
  EXPECT_EQ(limited.status, 2);
  EXPECT_THAT(limited.err, HasSubstr("the distance that the field is made from holds"));
  EXPECT_THAT(limited.err, HasSubstr("of memory, more than the 10.00 MB allowed"));
  EXPECT_EQ(built("builtin:torus", {"--memory-limit", "1e8"}).status, 0);
  EXPECT_EQ(built("builtin:torus,segments=700,sides=700", {}).status, 0) << "untold, the limit is for what grows";
}

/// What the reader's floats keep of a mesh is told where that is little.
TEST_F(Cli, coordinatesFarFromTheOriginAreWarnedOf) {
  const auto tetrahedron = [&](double x) {
    return fmt::format("v {0} 0 0\nv {1} 0 0\nv {0} 2 0\nv {0} 0 2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n", x, x + 2);
  };
  writeFile(at("near.obj"), tetrahedron(1));
  writeFile(at("far.obj"), tetrahedron(1e6));
  const std::string warning = at("far.obj") +
                              ": coordinates reach 1e6, where the reader keeps them 0.0625 apart (0.0312 of the mesh's "
                              "longest side): move the mesh nearer to the origin before it is exported\n";
  const Outcome mesh = run({{"mesh", at("far.obj")}});
  EXPECT_EQ(mesh.err, "hpsdf: warning: " + warning);
  EXPECT_THAT(mesh.out, HasSubstr("kept 0.0625 apart by the reader"));
  EXPECT_THAT(mesh.out, HasSubstr("(1000000, 0, 0) to (1000002, 2, 2)"));
  const Outcome built = run({{"build", at("far.obj"), "-o", at("far.hpsdf"), "--target-error", "1e-3"}});
  EXPECT_EQ(built.status, 0);
  EXPECT_THAT(built.err, HasSubstr(warning));
  EXPECT_THAT(run({{"info", at("far.hpsdf")}}).out, HasSubstr("(999999.9, -0.1, -0.1) to (1000002.1, 2.1, 2.1)"));
  EXPECT_EQ(Json::parse(run({{"mesh", at("far.obj"), "--json"}}).out).at("coordinate_spacing"), 0.0625);
  EXPECT_THAT(run({{"mesh", at("near.obj")}}).err, IsEmpty());
  EXPECT_EQ(Json::parse(run({{"mesh", "builtin:box", "--json"}}).out).at("coordinate_spacing"), 0);
}

/// Two tetrahedra, one of which reaches into the other.
TEST_F(Cli, nothingThatIsGivenGoesUnheeded) {
  for (const char* option : {"--hull", "--sign=winding"})
    expectRefused({{"build", "analytic:sphere", "-o", at("x.hpsdf"), option}},
                  "an analytic shape has a sign of its own");
  expectRefused({{"turntable", field(), "-o", at("turn"), "--frames", "2", "--defects", at("none.obj")}},
                "none.obj: no such file");
  writeFile(at("flap.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n");
  const auto places = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"mesh", at("flap.obj")};
    words.insert(words.end(), more.begin(), more.end());
    const std::string out = run({words}).out;
    return std::ranges::count(out.substr(out.find("boundary edges  ")), ';');
  };
  EXPECT_GT(places({"--places", "5"}), places({}));
  EXPECT_GT(places({}), places({"--places", "1"}));
  const Outcome foreign = run({{"render", field(), "--defects", at("flap.obj"), "-o", at("x.png"), "--cpu"}});
  EXPECT_EQ(foreign.status, 0);
  EXPECT_THAT(foreign.err, HasSubstr("flap.obj is not what the field was made from"));
}

TEST_F(Cli, namesThatAreMeantForTheTerminalDoNotReachIt) {
  const std::string name = at("red\x1b[31m.obj");
  writeFile(name, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n");
  for (const Call& call : {Call{{"build", name, "-o", at("x.hpsdf"), "--sign", "pseudonormal", "--max-steps", "3"}},
                           Call{{"render", field(), "--defects", name, "-o", at("x.png"), "--cpu"}},
                           Call{{"slice", field(), "--color", "error", "--mesh", name, "-o", at("y.png"), "--cpu"}}}) {
    const Outcome outcome = run(call);
    EXPECT_THAT(outcome.err, AllOf(HasSubstr("warning"), HasSubstr("red"), Not(HasSubstr("\x1b"))));
  }
}

TEST_F(Cli, meshTellsWhereItMeetsItselfAndHowItsInsideIsTold) {
  std::string text;
  for (const double x : {0.0, 0.2}) text += fmt::format("v {0} 0 0\nv {1} 0 0\nv {0} 1 0\nv {0} 0 1\n", x, x + 1);
  text += "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\nf 5 7 6\nf 5 6 8\nf 6 7 8\nf 5 8 7\n";
  writeFile(at("two.obj"), text);
  const Outcome told = run({{"mesh", at("two.obj"), "--check-sign", "500"}});
  EXPECT_EQ(told.status, 0) << told.err;
  EXPECT_THAT(told.out, HasSubstr("pairs of faces, as at ("));
  EXPECT_THAT(told.out, HasSubstr("winding: the mesh meets itself"));
  EXPECT_THAT(told.out, HasSubstr("wrong signs            0\n"));
  const Json json = Json::parse(run({{"mesh", at("two.obj"), "--json", "--places", "1", "--check-sign", "500"}}).out);
  const Json& crossings = json.at("defects").at("crossings");
  EXPECT_GT(crossings.at("count"), 1);
  EXPECT_EQ(crossings.at("places").size(), 1u);
  EXPECT_EQ(crossings.at("places")[0].at("at").size(), 3u);
  EXPECT_EQ(crossings.at("within_parts"), 0);
  EXPECT_TRUE(json.at("verdict").at("parts_overlap"));
  EXPECT_FALSE(json.at("verdict").at("self_folding"));
  EXPECT_EQ(json.at("sign").at("by"), "winding");
  EXPECT_EQ(json.at("sign").at("at").size(), 3u);
  EXPECT_EQ(json.at("sign_check").at("wrong"), 0);
  const std::string place = told.out.substr(told.out.rfind(", as at ("), std::string(", as at (0.5, 0.5, 0.5").size());
  EXPECT_THAT(run({{"build", at("two.obj"), "-o", at("t.hpsdf"), "--normalize", "--target-error", "1"}}).err,
              HasSubstr("the mesh meets itself, so that normals may mislead" + place))
      << "in the file's units";
  EXPECT_THAT(run({{"mesh", "builtin:gear"}}).out,
              AllOf(HasSubstr("closed, orientable, does not meet itself"),
                    HasSubstr("pseudonormal: the mesh has no holes"), Not(HasSubstr("as at"))));
  EXPECT_THAT(run({{"mesh", "builtin:gear", "--seed", "2"}}).err, HasSubstr("seed belongs to check-sign"));
}

/// A tetrahedron with a face turned and one twice.
const char* const kBadTetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 4 2\nf 2 3 4\nf 1 4 3\nf 4 3 2\n";

TEST_F(Cli, meshIsMended) {
  writeFile(at("bad.obj"), kBadTetrahedron);
  const Json before = Json::parse(run({{"mesh", at("bad.obj"), "--json"}}).out);
  EXPECT_EQ(before.at("defects").at("inconsistent_edges").at("count"), 3);
  EXPECT_EQ(before.at("defects").at("inconsistent_edges").at("places")[0].at("edge").size(), 2u);
  EXPECT_EQ(before.at("duplicate_faces"), 1);
  EXPECT_THAT(run({{"mesh", at("bad.obj")}}).out, HasSubstr(" 1 face dropped, as at "));
  const Outcome mended = run({{"mesh", at("bad.obj"), "--repair", at("mended.ply")}});
  EXPECT_EQ(mended.status, 0) << mended.err;
  EXPECT_THAT(mended.out, AllOf(HasSubstr("dropped 1 face; turned 1 face"), HasSubstr("mended.ply: closed")));
  const Json after = Json::parse(run({{"mesh", at("mended.ply"), "--json"}}).out);
  EXPECT_TRUE(after.at("verdict").at("closed"));
  EXPECT_EQ(after.at("faces"), 4);
  EXPECT_EQ(after.at("sign").at("by"), "pseudonormal");
  EXPECT_THAT(run({{"mesh", at("mended.ply"), "--repair", at("again.obj")}}).out, HasSubstr("nothing to do"));
  expectRefused({{"mesh", at("bad.obj"), "--repair", at("mended.stl")}}, ".obj or .ply");
  expectRefused({{"mesh", at("bad.obj"), "--repair", at("none/mended.obj")}}, "none");
}

TEST_F(Cli, meshIsDrawn) {
  writeFile(at("bad.obj"), kBadTetrahedron);
  const Outcome drawn = run({{"mesh", at("bad.obj"), "--picture", at("bad.png"), "--cpu", "--size", "320x200"}});
  EXPECT_EQ(drawn.status, 0) << drawn.err;
  EXPECT_GT(fs::file_size(at("bad.png")), 1000u);
  expectRefused({{"mesh", at("bad.obj"), "--picture", at("bad.jpg")}}, "written as .png");
  expectRefused({{"mesh", at("bad.obj"), "--view", "front"}}, "view belongs to picture");
  expectRefused({{"mesh", at("none.obj"), "--picture", at("bad.png"), "--size", "9000x9000"}}, "64 million");
}

TEST_F(Cli, meshIsToldAndMendedWhateverItsPictureDoes) {
  writeFile(at("bad.obj"), kBadTetrahedron);
  for (const bool json : {false, true}) {
    Call call{{"mesh", at("bad.obj"), "--picture", at("bad.png"), "--cpu", "--repair", at("mended.obj"), "--target",
               "1e300,0,0"}};
    if (json) call.words.push_back("--json");
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, AllOf(StartsWith("hpsdf: error: "), HasSubstr("too far from the mesh")));
    EXPECT_THAT(outcome.out, AllOf(HasSubstr("inconsistent"), HasSubstr("mended.obj"), Not(HasSubstr("picture"))));
    EXPECT_TRUE(fs::remove(at("mended.obj")));
    EXPECT_FALSE(fs::exists(at("bad.png")));
  }
}

TEST_F(Cli, buildLeavesOutBuriedWalls) {
  const std::string box = "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 2 2 0\nv 0 0 2\nv 2 0 2\nv 0 2 2\nv 2 2 2\n";
  std::string text = box;
  for (const char* v :
       {"1 0.5 0.5", "3 0.5 0.5", "1 1.5 0.5", "3 1.5 0.5", "1 0.5 1.5", "3 0.5 1.5", "1 1.5 1.5", "3 1.5 1.5"})
    text += fmt::format("v {}\n", v);
  for (const int first : {1, 9})
    for (const auto& f : {std::array{0, 2, 3, 1}, std::array{4, 5, 7, 6}, std::array{0, 1, 5, 4},
                          std::array{2, 6, 7, 3}, std::array{0, 4, 6, 2}, std::array{1, 3, 7, 5}})
      text += fmt::format("f {} {} {} {}\n", first + f[0], first + f[1], first + f[2], first + f[3]);
  writeFile(at("boxes.obj"), text);
  const auto valueIn = [&](const char* name, std::vector<std::string> more) {
    more.insert(more.begin(), {"build", at("boxes.obj"), "-o", at(name), "--target-error", "1e-4"});
    EXPECT_EQ(run({more}).status, 0);
    writeFile(at("point.csv"), "1 1 1\n");
    return Json::parse(run({{"query", at(name), at("point.csv"), "--json"}}).out)[0].at("distance").get<double>();
  };
  EXPECT_NEAR(valueIn("plain.hpsdf", {}), 0, 0.05) << "on the smaller one's wall";
  EXPECT_NEAR(valueIn("hull.hpsdf", {"--hull"}), -1, 0.05);
  EXPECT_EQ(Json::parse(run({{"info", at("hull.hpsdf"), "--json"}}).out).at("mesh").at("sign"), "hull");
  const Outcome verified = run({{"verify", at("hull.hpsdf"), at("boxes.obj"), "--json", "--points", "2000"}});
  EXPECT_EQ(verified.status, 0) << verified.err;
  EXPECT_LT(Json::parse(verified.out).at("uniform").at("error").at("rms"), 0.02);
  expectRefused({{"build", at("boxes.obj"), "-o", at("x.hpsdf"), "--hull", "--sign", "pseudonormal"}}, "hull");
}

TEST_F(Cli, infoTellsWhatTheFieldHolds) {
  const Outcome info = run({{"info", field(), "--json"}});
  ASSERT_EQ(info.status, 0) << info.err;
  EXPECT_THAT(info.err, IsEmpty());
  const Json json = Json::parse(info.out);
  const Field torus = load(field());
  const FieldStatistics counts = statistics(torus);
  EXPECT_EQ(json.at("leaves"), counts.leaves);
  EXPECT_EQ(json.at("coefficients"), counts.coefficients);
  EXPECT_EQ(json.at("bytes"), counts.bytes);
  EXPECT_EQ(json.at("total_error"), torus.metadata().totalError);
  EXPECT_EQ(json.at("target_error"), 1e-4);
  EXPECT_EQ(json.at("rms_estimate"), torus.metadata().rmsEstimate(torus.domain()));
  EXPECT_EQ(json.at("exact_evaluations"), torus.metadata().exactEvaluations);
  EXPECT_EQ(json.at("steps"), torus.metadata().steps.value());
  EXPECT_EQ(json.at("mesh").at("faces"), torus.metadata().source.faces);
  EXPECT_EQ(std::stoull(json.at("mesh").at("fingerprint").get<std::string>(), nullptr, 16),
            torus.metadata().source.fingerprint);
  EXPECT_EQ(json.at("file_bytes"), fs::file_size(field()));
  EXPECT_EQ(json.at("domain")[1][0], torus.domain().max().x());
  for (const char* histogram : {"degree_volume", "depth_volume"}) {
    double sum = 0;
    for (const auto& [level, share] : json.at(histogram).items()) sum += share.get<double>();
    EXPECT_NEAR(sum, 1, 1e-12) << histogram;
  }
  const Outcome text = run({{"info", field()}});
  EXPECT_THAT(text.out, HasSubstr("leaves"));
  EXPECT_THAT(text.out, HasSubstr("▇"));
}

TEST_F(Cli, damagedFieldsAreRefused) {
  const std::string whole = readFile(field());
  std::mt19937_64 random(5);
  for (int n = 0; n < 40; ++n) {
    std::string bytes = whole;
    const std::size_t at = random() % (n % 4 < 2 ? 400 : whole.size());
    if (n % 2 == 0)
      bytes.resize(at);
    else
      bytes[at] = char(bytes[at] ^ (1 << random() % 8));
    writeFile(this->at("damaged.hpsdf"), bytes);
    expectRefused({{"info", this->at("damaged.hpsdf")}}, "damaged.hpsdf: ");
  }
}

/// A stranger's field whose figures are no numbers and whose name would clear the screen.
TEST_F(Cli, infoTellsOfAnyFieldThatLoads) {
  FieldData data = oneLeafField(1, 2).data();
  data.metadata.source.name = "evil\n\x1b[2J\xff.obj";
  data.metadata.targetError = NAN;
  data.metadata.totalError = -INFINITY;
  save(Field(data), at("evil.hpsdf"));
  const Outcome text = run({{"info", at("evil.hpsdf")}});
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("evil  [2J\xff.obj\n"));
  EXPECT_THAT(text.out, HasSubstr("-inf, nan"));
  EXPECT_THAT(text.out, Not(HasSubstr("\x1b")));
  const Outcome json = run({{"info", at("evil.hpsdf"), "--json"}});
  EXPECT_EQ(json.status, 0) << json.err;
  EXPECT_TRUE(Json::parse(json.out).at("target_error").is_null());
}

TEST_F(Cli, smoothIsWhatBuildDoesWithWeakContinuity) {
  const std::vector<std::string> build = {"build", "builtin:torus",  "--target-error",
                                          "1e-4",  "--coefficients", "double"};
  const auto with = [](std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  ASSERT_EQ(run({with(build, {"-o", at("plain.hpsdf")})}).status, 0);
  ASSERT_EQ(run({with(build, {"-o", at("weak.hpsdf"), "--continuity", "weak", "--continuity-weight", "0.7"})}).status,
            0);
  const Outcome smoothed =
      run({{"smooth", at("plain.hpsdf"), "-o", at("smooth.hpsdf"), "--continuity-weight", "0.7", "--json"}});
  ASSERT_EQ(smoothed.status, 0) << smoothed.err;
  EXPECT_EQ(readFile(at("smooth.hpsdf")), readFile(at("weak.hpsdf")));
  const Json json = Json::parse(smoothed.out);
  EXPECT_EQ(json.at("continuity_weight"), 0.7);
  EXPECT_GT(json.at("change"), 0);
  EXPECT_GT(json.at("iterations"), 1);
  EXPECT_LT(findJumps(load(at("smooth.hpsdf"))).value.rms, 0.5 * findJumps(load(at("plain.hpsdf"))).value.rms);
  EXPECT_THAT(run({{"info", at("smooth.hpsdf")}}).out, HasSubstr("weak, weight 0.7"));
  EXPECT_TRUE(Json::parse(run({{"info", at("plain.hpsdf"), "--json"}}).out).at("continuity_weight").is_null());
  expectRefused({{"smooth", at("smooth.hpsdf"), "-o", at("twice.hpsdf")}},
                "smooth.hpsdf: is weakly continuous already");
  expectRefused({{"smooth", at("plain.hpsdf"), "-o", at("plain.hpsdf")}}, "plain.hpsdf");
}

TEST_F(Cli, blendIsWhatBuildDoesWithExactContinuity) {
  const std::vector<std::string> build = {"build", "builtin:torus", "--target-error", "1e-3"};
  const auto with = [](std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  ASSERT_EQ(run({with(build, {"-o", at("plain.hpsdf")})}).status, 0);
  ASSERT_EQ(run({with(build, {"-o", at("exact.hpsdf"), "--continuity", "exact", "--blend-width", "0.1"})}).status, 0);
  const Outcome blended = run({{"blend", at("plain.hpsdf"), "-o", at("blended.hpsdf"), "--width", "0.1", "--json"}});
  ASSERT_EQ(blended.status, 0) << blended.err;
  EXPECT_EQ(readFile(at("blended.hpsdf")), readFile(at("exact.hpsdf")));
  EXPECT_EQ(Json::parse(blended.out).at("output"), at("blended.hpsdf"));
  EXPECT_EQ(load(at("blended.hpsdf")).data().blend, 0.1);
  const auto jump = [&](const char* name) {
    return Json::parse(run({{"jumps", at(name), "--json"}}).out).at("value").at("max").get<double>();
  };
  EXPECT_GT(jump("plain.hpsdf"), 1e-3);
  EXPECT_LT(jump("blended.hpsdf"), 1e-14);
  EXPECT_THAT(run({{"info", at("blended.hpsdf")}}).out, HasSubstr("exact: blended within 0.1 of an edge from faces"));
  // both ways, one after the other or at once
  ASSERT_EQ(run({{"smooth", at("plain.hpsdf"), "-o", at("smooth.hpsdf")}}).status, 0);
  const Outcome text = run({{"blend", at("smooth.hpsdf"), "-o", at("both.hpsdf")}});
  ASSERT_EQ(text.status, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(StartsWith(at("both.hpsdf") + ": "), HasSubstr("blended within 0.04 of an edge")));
  const FieldMetadata both = load(at("both.hpsdf")).metadata();
  EXPECT_EQ(both.continuityWeight, 2.5);
  ASSERT_EQ(run({with(build, {"-o", at("once.hpsdf"), "--continuity", "both"})}).status, 0);
  EXPECT_EQ(load(at("once.hpsdf")).metadata().continuityWeight, 2.5);
  EXPECT_LT(jump("once.hpsdf"), 1e-14);
  expectRefused({{"blend", at("plain.hpsdf"), "-o", at("plain.hpsdf")}}, "plain.hpsdf: is read by the same command");
  expectRefused({{"blend", at("none.hpsdf"), "-o", at("x.hpsdf")}}, "none.hpsdf: no such file");
  expectRefused({{"blend", at("plain.hpsdf"), "-o", at("none/x.hpsdf")}}, "none/x.hpsdf");
}

TEST_F(Cli, boundsAreKeptToldAndHold) {
  const std::vector<std::string> build = {"build", "builtin:torus", "--target-error", "1e-3", "-o"};
  std::vector<std::string> bounded = build, plain = build;
  bounded.insert(bounded.end(), {at("bounds.hpsdf"), "--bounds"});
  plain.push_back(at("plain.hpsdf"));
  ASSERT_EQ(run({bounded}).status, 0);
  ASSERT_EQ(run({plain}).status, 0);
  EXPECT_GT(fs::file_size(at("bounds.hpsdf")), fs::file_size(at("plain.hpsdf")));
  EXPECT_THAT(run({{"info", at("bounds.hpsdf")}}).out, HasSubstr("bounds of the error"));
  EXPECT_THAT(run({{"info", at("plain.hpsdf")}}).out, Not(HasSubstr("bounds of the error")));
  const Outcome verified =
      run({{"verify", at("bounds.hpsdf"), "--points", "20000", "--max-violations", "0", "--worst", "0"}});
  EXPECT_EQ(verified.status, 0) << verified.err;
  EXPECT_THAT(verified.out, HasSubstr("no point is beyond its bound"));
  expectRefused({{"verify", at("plain.hpsdf"), "--max-violations", "0", "--script", at("worst.hps")}},
                "max-violations: " + at("plain.hpsdf") + " keeps no bounds");
  // another form of the field has other errors
  ASSERT_EQ(run({{"blend", at("bounds.hpsdf"), "-o", at("blended.hpsdf")}}).status, 0);
  EXPECT_TRUE(load(at("blended.hpsdf")).data().bounds.empty());
  // an open mesh is warned of
  writeFile(at("open.off"), "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n");
  const Outcome open =
      run({{"build", at("open.off"), "--bounds", "-o", at("open.hpsdf"), "--target-error", "1e-1", "--grid", "2"}});
  EXPECT_EQ(open.status, 0);
  EXPECT_THAT(open.err, HasSubstr("warning: bounds hold for closed surfaces alone"));
}

TEST_F(Cli, optionsThatSayNothingAreRefused) {
  const auto refused = [&](const std::vector<std::string>& options, const std::string& message) {
    std::vector<std::string> words = {"build", "builtin:torus", "-o", at("f.hpsdf")};
    words.insert(words.end(), options.begin(), options.end());
    expectRefused({words}, message);
  };
  refused({"--continuity-weight", "1"}, "continuity-weight belongs to continuity weak");
  refused({"--continuity", "exact", "--continuity-weight", "1"}, "continuity-weight belongs to continuity weak");
  refused({"--blend-width", "0.1"}, "blend-width belongs to continuity exact");
  refused({"--continuity", "weak", "--blend-width", "0.1"}, "blend-width belongs to continuity exact");
  refused({"--near-distance", "0.1"}, "near-distance belongs to near-error");
  refused({"--max-bytes", "1e3"}, "the base grid alone takes more than 1000 bytes");
  // of studies too, where they would change nothing or end at another place
  for (const char* option : {"--blend-width=0.1", "--max-bytes=1e6", "--max-error=0.1", "--bounds"})
    expectRefused({{"study", "continuity", "builtin:torus", "-o", at("study"), option}}, "not for 'study continuity'");
  for (const char* option : {"--near-error=0.1", "--max-bytes=1e6", "--max-error=0.1", "--bounds"})
    expectRefused({{"study", "convergence", "builtin:torus", "-o", at("study"), option}},
                  "not for 'study convergence'");
}

TEST_F(Cli, boundsOfAFieldThatIsThereAreThoseOfBuild) {
  const auto build = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"build", "builtin:torus", "--target-error", "1e-4", "-o", at(name)};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run({words});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
  };
  build("plain.hpsdf", {});
  build("bounded.hpsdf", {"--bounds"});
  const Outcome found = run({{"bounds", at("plain.hpsdf"), "builtin:torus", "-o", at("found.hpsdf"), "--json"}});
  ASSERT_EQ(found.status, 0) << found.err;
  EXPECT_EQ(readFile(at("found.hpsdf")), readFile(at("bounded.hpsdf")));
  const Json json = Json::parse(found.out);
  EXPECT_GT(json.at("bounds").at("median"), 0);
  EXPECT_EQ(json.at("output"), at("found.hpsdf"));
  build("exact.hpsdf", {"--continuity", "exact", "--bounds"});
  ASSERT_EQ(run({{"blend", at("plain.hpsdf"), "-o", at("blended.hpsdf")}}).status, 0);
  ASSERT_EQ(run({{"bounds", at("blended.hpsdf"), "-o", at("certain.hpsdf")}}).status, 0) << "a shape's name is known";
  EXPECT_EQ(readFile(at("certain.hpsdf")), readFile(at("exact.hpsdf")));
  // anew, where there are some
  const Outcome again = run({{"bounds", at("found.hpsdf"), "-o", at("again.hpsdf"), "--threads", "1"}});
  EXPECT_THAT(again.out, AllOf(HasSubstr("again.hpsdf: nowhere wrong by more than"), HasSubstr("in the median cell")));
  const auto errorsOf = [&](const std::string& name) {
    std::vector<float> errors;
    const Field field = load(at(name));
    for (const CellBound& bound : field.data().bounds) errors.push_back(bound.error);
    return errors;
  };
  EXPECT_EQ(errorsOf("again.hpsdf"), errorsOf("bounded.hpsdf"));
}

TEST_F(Cli, boundsNeedTheFieldsOwnMesh) {
  writeFile(at("t.obj"), kTetrahedron);
  writeFile(at("open.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const auto build = [&](const std::string& mesh, const std::string& name) {
    const Outcome outcome = run(
        {{"build", at(mesh), "-o", at(name), "--target-error", "1e-1", "--grid", "2", "--domain", "-1,-1,-1,2,2,2"}});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
  };
  build("t.obj", "t.hpsdf");
  build("open.obj", "open.hpsdf");
  expectRefused({{"bounds", at("t.hpsdf"), "-o", at("b.hpsdf")}}, "give MESH, t.obj");
  expectRefused({{"bounds", at("t.hpsdf"), "builtin:gear", "-o", at("b.hpsdf")}},
                "was made from t.obj, not from builtin:gear; give that mesh");
  expectRefused({{"bounds", at("t.hpsdf"), at("none.obj"), "-o", at("b.hpsdf")}}, "none.obj");
  expectRefused({{"bounds", at("t.hpsdf"), at("t.obj"), "-o", at("t.obj")}}, "t.obj: is read by the same command");
  expectRefused({{"bounds", at("t.hpsdf"), at("t.obj")}}, "--output is missing");
  EXPECT_THAT(run({{"bounds", at("t.hpsdf"), at("t.obj"), "-o", at("b.hpsdf")}}).err, IsEmpty());
  const Outcome open = run({{"bounds", at("open.hpsdf"), at("open.obj"), "-o", at("b.hpsdf")}});
  EXPECT_EQ(open.status, 0) << open.err;
  EXPECT_THAT(open.err, HasSubstr("bounds hold for closed surfaces alone"));
}

TEST_F(Cli, continuityIsStudied) {
  const Outcome outcome = run({{"study", "continuity", "builtin:torus", "analytic:sphere", "--target-error", "1e-5",
                                "--points", "20000", "--weights", "10,2.5,0.4", "-o", at("study"), "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json rows = Json::parse(outcome.out);
  ASSERT_EQ(rows.size(), 16u) << "two meshes, with and without enrichment, three weights and none";
  const auto figure = [&](std::size_t row, const char* name) { return rows[row].at(name).get<double>(); };
  for (std::size_t first = 0; first < 16; first += 4)
    for (std::size_t row = first + 1; row < first + 4; ++row) {  // each weight smaller than the one before
      EXPECT_LT(figure(row, "jump_rms"), figure(row - 1, "jump_rms")) << row;
      EXPECT_GT(figure(row, "rms"), figure(row - 1, "rms")) << row;
      EXPECT_EQ(figure(row, "bytes"), figure(first, "bytes")) << row;
    }
  EXPECT_TRUE(rows[0].at("weight").is_null());
  EXPECT_EQ(figure(0, "jump_rms_ratio"), 1);
  EXPECT_FALSE(rows[2].at("enriched"));
  EXPECT_EQ(figure(2, "weight"), 2.5);
  EXPECT_LT(figure(2, "jump_rms_ratio"), 0.5);
  EXPECT_LT(figure(2, "rms_ratio"), 1.5);
  EXPECT_TRUE(rows[7].at("enriched"));
  EXPECT_EQ(figure(7, "weight"), 0.4);
  EXPECT_LT(figure(7, "jump_rms_ratio"), 0.12);
  EXPECT_LT(figure(7, "rms_ratio"), 1.02);
  EXPECT_LT(figure(7, "bytes_ratio"), 1.9);
  const std::string table = readFile(at("study/continuity.csv"));
  EXPECT_EQ(lineCount(table), 17u);
  EXPECT_THAT(table, StartsWith("mesh,enriched,weight,jump_rms,"));
  EXPECT_THAT(table, HasSubstr("\"analytic:sphere\",1,0.4,"));
  EXPECT_EQ(Json::parse(readFile(at("study/continuity.json"))), rows);
  const Outcome text =
      run({{"study", "continuity", "analytic:sphere", "--points", "1000", "--weights", "1", "-o", at("text")}});
  EXPECT_THAT(text.out, AllOf(HasSubstr("enriched"), HasSubstr("RMS jump")));
  expectRefused({{"study", "continuity", "analytic:sphere", "--enrich", "-o", at("none")}}, "enrich");
}

TEST_F(Cli, jumpsAreReportedAndListed) {
  const Outcome outcome = run({{"jumps", field(), "--json", "--worst", "3", "-o", at("jumps.csv")}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  const Jumps jumps = findJumps(load(field()));
  EXPECT_EQ(json.at("interfaces"), jumps.interfaces.size());
  EXPECT_EQ(json.at("hanging"), jumps.hanging);
  EXPECT_EQ(json.at("value").at("rms"), jumps.value.rms);
  EXPECT_EQ(json.at("gradient").at("max"), jumps.gradient.max);
  ASSERT_EQ(json.at("worst").size(), 3u);
  EXPECT_EQ(json.at("worst")[0].at("value").at("max"), jumps.value.max);
  std::size_t counted = 0;
  for (const Json& bin : json.at("value_histogram")) counted += bin.at("interfaces").get<std::size_t>();
  EXPECT_EQ(counted, jumps.interfaces.size());
  const std::string table = readFile(at("jumps.csv"));
  EXPECT_EQ(lineCount(table), jumps.interfaces.size() + 1);
  EXPECT_THAT(table, StartsWith("cell0,cell1,"));

  const Outcome byGradient = run({{"jumps", field(), "--json", "--worst", "1", "--by", "gradient"}});
  EXPECT_EQ(Json::parse(byGradient.out).at("worst")[0].at("gradient").at("max"), jumps.gradient.max);
  const Outcome text = run({{"jumps", field()}});
  EXPECT_THAT(text.out, AllOf(HasSubstr("value jump"), HasSubstr("▇"), HasSubstr("degrees, depths")));
  EXPECT_THAT(run({{"jumps", field(), "--worst", "0"}}).out, Not(HasSubstr("degrees, depths")));
  expectRefused({{"jumps", field(), "--by", "valeu"}}, "value");
  expectRefused({{"jumps", field(), "-o", field()}}, field(), {"jumps.csv"});
}

TEST_F(Cli, cubicGridsAreExportedAndMeasured) {
  const Outcome outcome = run({{"export", field(), "-o", at("grid.cdf"), "--resolution", "20", "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  const Field torus = load(field());
  const GridResolution cells = cubicGridResolution(torus.domain(), 20);
  EXPECT_EQ(json.at("resolution"), Json(cells));
  EXPECT_EQ(json.at("file_bytes"), readFile(at("grid.cdf")).size());
  EXPECT_EQ(json.at("file_bytes").get<double>(), cubicGridBytes(cells));
  const CubicGrid grid = sampleCubicGrid(torus, cells);
  const CubicGridError error = measureCubicGrid(grid, torus, 100000);
  EXPECT_EQ(json.at("difference").at("points"), 100000);
  EXPECT_EQ(json.at("difference").at("rms"), error.everywhere.rms);
  EXPECT_EQ(json.at("difference").at("max"), error.everywhere.max);
  EXPECT_EQ(json.at("difference_near").at("points"), error.nearSurface.points);
  EXPECT_EQ(json.at("difference_near").at("rms"), error.nearSurface.rms);
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("grid.cdf"));

  const Outcome text = run({{"export", field(), "-o", at("grid.cdf"), "--max-bytes", "1e6"}});
  EXPECT_THAT(text.out, AllOf(HasSubstr("cubic cells"), HasSubstr("beside the field       RMS"),
                              HasSubstr("random points within")));
  EXPECT_LE(readFile(at("grid.cdf")).size(), 1000000u);
  EXPECT_GT(readFile(at("grid.cdf")).size(), 700000u);
  ASSERT_EQ(run({{"export", field(), "-o", at("box.cdf"), "--resolution", "3,4,5"}}).status, 0);
  EXPECT_EQ(double(readFile(at("box.cdf")).size()), cubicGridBytes({3, 4, 5}));

  const std::set<std::string> before = {"box.cdf", "grid.cdf"};
  expectRefused({{"export", field(), "-o", at("x.obj")}}, "expected .cdf", before);
  expectRefused({{"export", field(), "-o", at("x.cdf"), "--resolution", "3,4"}}, "resolution", before);
  expectRefused({{"export", field(), "-o", at("x.cdf"), "--resolution", "9", "--max-bytes", "1e6"}}, "excludes",
                before);
  expectRefused({{"export", field(), "-o", at("x.cdf"), "--resolution", "225"}},
                "takes 2148 MB as a file, of which Bullet's loader reads 2147 at most", before);
  expectRefused({{"export", field(), "-o", at("x.cdf"), "--resolution", "1e7,1e7,1e7"}}, "give fewer cells", before);
  expectRefused({{"export", field(), "-o", at("x.cdf"), "--max-bytes", "559"}}, "560 at least", before);
  expectRefused({{"export", at("none.hpsdf"), "-o", at("x.cdf")}}, "none.hpsdf", before);
  expectRefused({{"export", field(), "-o", at("none/x.cdf")}}, "none/x.cdf", before);
}

/// The rows of a CSV file, its header first.
std::vector<std::vector<std::string>> tableOf(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    rows.emplace_back();
    std::istringstream words(line + ",");
    for (std::string word; std::getline(words, word, ',');) rows.back().push_back(word);
  }
  return rows;
}

TEST_F(Cli, aProbeListsBothSidesOfEachBorder) {
  const Outcome outcome = run({{"probe", field(), "--from", "-2,0.1,0.05", "--to", "0.9,0.1,0.05", "-o", at("line.csv"),
                                "--samples", "50", "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto rows = tableOf(readFile(at("line.csv")));
  const std::vector<std::string> header = {"t",     "s",     "x",     "y",  "z",  "cell", "degree",     "depth",
                                           "value", "exact", "error", "gx", "gy", "gz",   "slope_along"};
  EXPECT_EQ(rows[0], header);
  const Field torus = load(field());
  std::size_t outside = 0, borders = 0, inner = 0;
  double greatestJump = 0, greatestError = 0;
  for (std::size_t n = 1; n < rows.size(); ++n) {
    ASSERT_EQ(rows[n].size(), header.size());
    const auto number = [&](std::size_t column, std::size_t row) { return std::stod(rows[row][column]); };
    const Vector3 x(number(2, n), number(3, n), number(4, n));
    EXPECT_NEAR(number(1, n), 2.9 * number(0, n), 1e-12);
    EXPECT_EQ(number(10, n), number(8, n) - number(9, n)) << "a built-in shape is known";
    greatestError = std::max(greatestError, std::abs(number(10, n)));
    const bool border = n > 1 && rows[n][0] == rows[n - 1][0];
    if (border) {
      ++borders;
      EXPECT_NE(rows[n][5], rows[n - 1][5]);
      if (!rows[n - 1][5].empty()) greatestJump = std::max(greatestJump, std::abs(number(8, n) - number(8, n - 1)));
    } else if (n + 1 < rows.size() && rows[n][0] != rows[n + 1][0]) {
      ++inner;
      const ValueAndGradient expected = torus.valueAndGradient(x);
      EXPECT_EQ(number(8, n), expected.value);
      EXPECT_EQ(number(11, n), expected.gradient.x());
      EXPECT_NEAR(number(14, n), expected.gradient.x(), 1e-14) << "along x";
    }
    outside += rows[n][5].empty();
  }
  EXPECT_GT(borders, 4u);
  EXPECT_GT(outside, 4u) << "the domain begins at x = -1.1";
  EXPECT_GT(inner, 40u);
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json.at("samples"), rows.size() - 1);
  EXPECT_EQ(json.at("cells"), borders);
  EXPECT_EQ(std::abs(json.at("greatest_jump").at("value").get<double>()), greatestJump);
  EXPECT_EQ(json.at("greatest_error"), greatestError);
}

TEST_F(Cli, aProbeIsDrawn) {
  const std::vector<std::string> line = {"probe", field(), "--from", "-0.9,0,0", "--to", "0.9,0.1,0.2"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), line.begin(), line.end());
    return run({more});
  };
  const Outcome drawn = with({"-o", at("line.png"), "--size", "320x240"});
  ASSERT_EQ(drawn.status, 0) << drawn.err;
  EXPECT_THAT(drawn.out, AllOf(HasSubstr("line.png: "), HasSubstr("greatest jump"), HasSubstr("greatest error")));
  const render::Image image = render::loadPng(at("line.png"));
  EXPECT_EQ(image.width, 320);
  EXPECT_EQ(image.height, 240);
  const Outcome script = run({{"run", "-e",
                               "load \"" + field() + "\"; probe from=-0.9,0,0 to=0.9,0.1,0.2 size=320x240 output=\"" +
                                   at("script.png") + "\""}});
  ASSERT_EQ(script.status, 0) << script.err;
  EXPECT_EQ(render::loadPng(at("script.png")).pixels, image.pixels);

  expectRefused({{"probe", field(), "--from", "0,0,0", "-o", at("x.png")}}, "--to is missing");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "0,0", "-o", at("x.png")}}, "to");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "0,0,nan", "-o", at("x.png")}}, "nan");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "0,0,0", "-o", at("x.png")}}, "give two points");
  expectRefused({{"probe", field(), "--from", "5,0,0", "--to", "5,1,0", "-o", at("x.png")}}, "does not meet");
  expectRefused({{"probe", field(), "--from", "-1e308,0,0", "--to", "1e308,1,0", "-o", at("x.csv")}}, "too far");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "1,0,0", "-o", at("x.pfm")}}, "expected .png");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "1,0,0", "-o", at("x.csv"), "--size", "64x64"}},
                "leave it out");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "1,0,0", "-o", at("none/x.csv")}}, "none/x.csv");
}

TEST_F(Cli, aProbeNeedsNoExactDistance) {
  writeFile(at("t.obj"), kTetrahedron);
  ASSERT_EQ(run({{"build", at("t.obj"), "-o", at("t.hpsdf"), "--target-error", "1e-2"}}).status, 0);
  const auto rowsWith = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"probe", at("t.hpsdf"), "--from", "0,0,0", "--to", "1,1,1", "-o", at("line.csv")};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run({words});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.out.find("greatest error") == std::string::npos, more.empty());
    return tableOf(readFile(at("line.csv")));
  };
  const auto without = rowsWith({}), with = rowsWith({"--mesh", at("t.obj")});
  ASSERT_EQ(without.size(), with.size());
  for (std::size_t n = 1; n < with.size(); ++n) {
    EXPECT_EQ(without[n][9] + without[n][10], "");
    EXPECT_FALSE(with[n][9].empty() || with[n][10].empty());
    EXPECT_EQ(without[n][8], with[n][8]);
  }
  const std::string probe = "; probe from=0,0,0 to=1,1,1 output=\"" + at("script.csv") + "\"";
  ASSERT_EQ(run({{"run", "-e", "build \"" + at("t.obj") + "\" target-error=1e-2" + probe}}).status, 0);
  EXPECT_EQ(tableOf(readFile(at("script.csv"))), with) << "the mesh is still at hand";
}

TEST_F(Cli, everyCommandSpeaksJson) {
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

// Points

TEST_F(Cli, queryAnswersPoints) {
  const Outcome outcome =
      run({{"query", field()}, "x,y,z\n0.1,0.2,0.3\n\n# a comment\n-0.5 1e-1 0 # here too\n9,9,9\r\n"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.err, IsEmpty());
  std::istringstream lines(outcome.out);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "x,y,z,distance,gx,gy,gz");
  const Field torus = load(field());
  for (const Vector3& x : {Vector3(0.1, 0.2, 0.3), Vector3(-0.5, 0.1, 0), Vector3(9, 9, 9)}) {
    ASSERT_TRUE(std::getline(lines, line));
    std::ranges::replace(line, ',', ' ');
    std::istringstream numbers(line);
    std::array<double, 7> row{};
    for (double& number : row) numbers >> number;
    const auto [value, gradient] = torus.valueAndGradient(x);
    EXPECT_THAT(row, ElementsAre(x.x(), x.y(), x.z(), value, gradient.x(), gradient.y(), gradient.z()));
  }
  EXPECT_FALSE(std::getline(lines, line));
}

TEST_F(Cli, queryReadsAndWritesFiles) {
  writeFile(at("points.txt"), "0 0 0\n1 1 1");
  const Outcome toFile = run({{"query", field(), at("points.txt"), "-o", at("out.csv")}});
  EXPECT_EQ(toFile.status, 0) << toFile.err;
  EXPECT_EQ(readFile(at("out.csv")), run({{"query", field()}, "0 0 0\n1 1 1\n"}).out);
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("out.csv", "points.txt"));
  EXPECT_EQ(run({{"query", field(), "--json"}, ""}).out, "[]\n");
}

TEST_F(Cli, badPointsAreRefusedByLine) {
  for (const char* bad : {"1 2", "1 2 3 4", "a b c", "1,,2", "1 2 3x", "nan 0 0", "1 inf 2", ",1,2,3"}) {
    writeFile(at("points.txt"), "0 0 0\n" + std::string(bad) + "\n");
    expectRefused({{"query", field(), at("points.txt"), "-o", at("out.csv")}}, "points.txt:2: expected three finite");
  }
  writeFile(at("points.txt"), "1 2 \x1b[2J\n");
  expectRefused({{"query", field(), at("points.txt")}}, "found '1 2  [2J'");
  const Outcome first = run({{"query", field()}, "nan,nan,nan\n"});
  EXPECT_EQ(first.status, 2);
  EXPECT_THAT(first.err, HasSubstr("stdin:1: expected three finite numbers"));
  expectRefused({{"query", field(), at("none.txt")}}, "none.txt: no such file");
  expectRefused({{"query", field(), folder_.path().string()}}, "is a folder");
}

TEST(PointQuery, answersManyBatchesInOrder) {
  const Field field(FieldData{.domain = Box(Vector3::Zero(), Vector3::Ones()),
                              .nodes = {node::leaf(0, 0)},
                              .coefficients = std::vector<double>{0.25},
                              .metadata = {}});
  std::string text;
  constexpr std::size_t kPoints = 40000;
  for (std::size_t i = 0; i < kPoints; ++i) text += "0.5 0.5 " + std::to_string(double(i % 100) / 100) + "\n";
  std::istringstream in(text);
  std::string out;
  std::size_t writes = 0;
  EXPECT_EQ(queryPoints(field, in, "points", PointFormat::json,
                        [&](std::string_view part) {
                          out += part;
                          ++writes;
                        }),
            kPoints);
  EXPECT_GT(writes, 2u);
  const Json json = Json::parse(out);
  ASSERT_EQ(json.size(), kPoints);
  for (std::size_t i = 0; i < kPoints; i += 997) {
    EXPECT_EQ(json[i].at("z"), double(i % 100) / 100);
    EXPECT_EQ(json[i].at("distance"), 0.25);
  }
}

// Pictures

TEST_F(Cli, drawsOnTheCpu) {
  const Outcome slice = run({{"slice", field(), "-o", at("s.png"), "--size", "200x120", "--cpu", "--json"}});
  ASSERT_EQ(slice.status, 0) << slice.err;
  EXPECT_THAT(Json::parse(slice.out).at("renderer").get<std::string>(), HasSubstr("CPU"));
  const render::Image image = render::loadPng(at("s.png"));
  EXPECT_EQ(image.width, 200);
  EXPECT_EQ(image.height, 120);
  const Outcome surface = run({{"render", field(), "-o", at("r.png"), "--size", "160x90", "--cpu"}});
  ASSERT_EQ(surface.status, 0) << surface.err;
  EXPECT_EQ(render::loadPng(at("r.png")).width, 160);
}

TEST_F(Cli, rawSlicesHoldTheFieldsValues) {
  ASSERT_EQ(run({{"slice", field(), "-o", at("s.csv"), "--size", "40x20", "--cpu"}}).status, 0);
  const Field torus = load(field());
  std::istringstream rows(readFile(at("s.csv")));
  std::string row;
  std::getline(rows, row);
  EXPECT_EQ(row, "x,y,z,value,degree,depth");
  std::size_t count = 0;
  std::vector<float> values;
  std::vector<Vector3> points;
  std::set<long> across, down;  // steps from pixel to pixel
  while (std::getline(rows, row)) {
    Vector3 x;
    double value = 0;
    int degree = 0, depth = 0;
    ASSERT_EQ(std::sscanf(row.c_str(), "%lf,%lf,%lf,%lf,%d,%d", &x[0], &x[1], &x[2], &value, &degree, &depth), 6)
        << row;
    EXPECT_EQ(x.z(), 0);
    EXPECT_NEAR(value, torus.value(x), 1e-6);
    EXPECT_EQ(degree, torus.cellAt(x).degree);
    EXPECT_EQ(depth, torus.cellAt(x).depth);
    if (!points.empty() && points.back().y() == x.y()) across.insert(std::lround((x.x() - points.back().x()) * 1e9));
    if (!points.empty() && points.back().y() != x.y()) down.insert(std::lround((points.back().y() - x.y()) * 1e9));
    points.push_back(x);
    values.push_back(static_cast<float>(value));
    ++count;
  }
  EXPECT_GT(count, 100u);
  ASSERT_EQ(across.size(), 1u);
  EXPECT_EQ(across, down) << "pixels are square";

  ASSERT_EQ(run({{"slice", field(), "-o", at("s.pfm"), "--size", "40x20", "--cpu"}}).status, 0);
  const std::string pfm = readFile(at("s.pfm"));
  const std::string header = "Pf\n40 20\n-1.0\n";
  ASSERT_THAT(pfm, StartsWith(header));
  ASSERT_EQ(pfm.size(), header.size() + 40 * 20 * sizeof(float));
  std::vector<float> inside;  // in the order of the CSV: rows top to bottom
  for (int y = 20; y-- > 0;)
    for (int x = 0; x < 40; ++x) {
      float value = 0;
      std::memcpy(&value, pfm.data() + header.size() + sizeof(float) * (std::size_t(y) * 40 + std::size_t(x)),
                  sizeof value);
      if (!std::isnan(value)) inside.push_back(value);
    }
  EXPECT_EQ(inside, values);
}

TEST_F(Cli, quantitiesColourSlicesAndSurfaces) {
  for (const char* color : {"value-jump", "gradient-jump", "slope", "error", "cell-error"}) {
    EXPECT_EQ(run({{"slice", field(), "-o", at("s.png"), "--color", color, "--cpu", "--size", "200x150"}}).status, 0);
    EXPECT_EQ(run({{"render", field(), "-o", at("r.png"), "--color", color, "--cpu", "--size", "200x150"}}).status, 0);
    EXPECT_GT(render::loadPng(at("s.png")).width, 0);
  }
  // raw values are what the field says
  ASSERT_EQ(run({{"slice", field(), "-o", at("e.pfm"), "--color", "error", "--cpu", "--size", "16x16"}}).status, 0);
  const std::string pfm = readFile(at("e.pfm"));
  std::array<float, 256> values{};
  ASSERT_GE(pfm.size(), sizeof values);
  std::memcpy(values.data(), pfm.data() + pfm.size() - sizeof values, sizeof values);
  float greatest = 0;
  for (const float value : values) greatest = std::max(greatest, value);
  EXPECT_GT(greatest, 1e-6F);
  EXPECT_LT(greatest, 0.1F);

  expectRefused({{"slice", field(), "-o", at("x.png"), "--range", "1,2"}}, "range", namesIn(folder_.path()));
  expectRefused({{"slice", field(), "-o", at("x.png"), "--color", "slope", "--range", "2,1", "--cpu"}}, "range",
                namesIn(folder_.path()));
  expectRefused({{"render", field(), "-o", at("x.png"), "--color", "distance"}}, "normal", namesIn(folder_.path()));
  expectRefused({{"slice", field(), "-o", at("x.png"), "--mesh", "builtin:box"}}, "mesh", namesIn(folder_.path()));
  const Outcome other =
      run({{"slice", field(), "-o", at("x.png"), "--color", "error", "--mesh", "builtin:box", "--cpu"}});
  EXPECT_EQ(other.status, 0);
  EXPECT_THAT(other.err, HasSubstr("not what the field was made from"));
}

TEST_F(Cli, twoFieldsAreCompared) {
  for (const auto& [name, radius] : {std::pair("small", "0.5"), std::pair("large", "0.6")})
    ASSERT_EQ(run({{"build", std::string("analytic:sphere,radius=") + radius, "-o", at(name), "--domain",
                    "-1,-1,-1,1,1,1", "--target-error", "1e-6"}})
                  .status,
              0);
  const auto differences = [&](const std::string& other) {
    EXPECT_EQ(run({{"slice", at("small"), "-o", at("d.pfm"), "--color", "difference", "--other", at(other), "--cpu",
                    "--size", "16x16"}})
                  .status,
              0);
    std::vector<float> values(256);
    const std::string pfm = readFile(at("d.pfm"));
    std::memcpy(values.data(), pfm.data() + pfm.size() - sizeof(float) * 256, sizeof(float) * 256);
    return values;
  };
  EXPECT_THAT(differences("small"), testing::Each(0.0F));
  // but near the centre, which no polynomial follows
  std::vector<float> sorted = differences("large");
  std::ranges::sort(sorted);
  EXPECT_NEAR(sorted[128], 0.1, 1e-3);
  EXPECT_EQ(run({{"render", at("small"), "-o", at("r.png"), "--color", "difference", "--other", at("large"), "--cpu",
                  "--size", "100x80"}})
                .status,
            0);
  expectRefused({{"slice", at("small"), "-o", at("x.png"), "--color", "difference"}}, "needs other");
  expectRefused({{"slice", at("small"), "-o", at("x.png"), "--other", at("large")}}, "is for color difference");
  expectRefused({{"slice", at("small"), "-o", at("x.png"), "--color", "difference", "--other", at("none")}},
                "none: no such file");
}

TEST_F(Cli, viewsAreNamedOrAimed) {
  const auto surface = [&](const std::vector<std::string>& words) {
    std::vector<std::string> all = {"render", field(), "-o", at("v.png"), "--cpu", "--size", "120x90"};
    all.insert(all.end(), words.begin(), words.end());
    const Outcome outcome = run({all});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return readFile(at("v.png"));
  };
  EXPECT_EQ(surface({"--view", "left"}), surface({"--camera=-90,0,1.1"}));
  EXPECT_EQ(surface({"--view", "top", "--up", "z"}), surface({"--camera", "0,90,1.1", "--up", "z"}));
  EXPECT_NE(surface({"--view", "left"}), surface({"--view", "top"}));
  EXPECT_NE(surface({"--target", "0.5,0,0"}), surface({}));
  EXPECT_NE(surface({"--projection", "orthographic"}), surface({}));
  EXPECT_EQ(surface({"--projection", "perspective"}), surface({}));
  EXPECT_NE(surface({"--cracks"}), surface({}));
  EXPECT_NE(surface({"--clip", "z"}), surface({}));
  EXPECT_NE(surface({"--clip", "z", "--clip-offset", "0.1"}), surface({"--clip", "z"}));
  EXPECT_EQ(surface({"--clip", "z", "--clip-offset", "50"}), surface({"--clip", "z", "--clip-offset", "40"}));
  expectRefused({{"render", field(), "-o", at("x.png"), "--clip-offset", "0.1"}}, "clip", {"v.png"});
  EXPECT_NE(surface({"--plane", "x"}), surface({}));
  EXPECT_EQ(surface({"--plane", "x"}), surface({"--plane", "x", "--plane-offset", "0"}));
  EXPECT_NE(surface({"--plane", "x"}), surface({"--plane", "x", "--plane-offset", "0.1"}));
  EXPECT_NE(surface({"--plane", "0,0,0,1,2,3"}), surface({"--plane", "x"}));
  EXPECT_NE(surface({"--surface=false", "--plane", "x"}), surface({"--plane", "x"}));
  EXPECT_NE(surface({"--cells", "lines"}), surface({}));
  EXPECT_NE(surface({"--cells", "boxes"}), surface({"--cells", "lines"}));
  EXPECT_NE(surface({"--cells", "boxes", "--degrees", "4"}), surface({"--cells", "boxes"}));
  EXPECT_NE(surface({"--cells", "boxes", "--depths", "20"}), surface({"--cells", "boxes"}));
  EXPECT_EQ(surface({"--cells", "boxes", "--degrees", "2,4-6"}), surface({"--cells", "boxes", "--degrees", "6,2,4-5"}));
  EXPECT_NE(surface({"--arrows", "20"}), surface({}));
  for (const char* list : {"x", "4,", "4-2", "31", "-1", "1.5"})
    expectRefused({{"render", field(), "-o", at("x.png"), "--cells", "boxes", std::string("--degrees=") + list}},
                  "degrees: expected whole numbers and ranges from 0 to 30", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--cells", "boxes", "--depths", "21"}}, "0 to 20", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--degrees", "4"}}, "degrees: needs cells", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--plane-offset", "0.1"}}, "needs plane", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--plane", "0,0,0,1,0,0", "--plane-offset", "0.1"}},
                "plane-offset", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--plane", "w"}}, "x, y, z or 6 numbers", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--plane", "z", "--plane-offset", "9"}}, "outside", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--view", "left", "--camera", "0,0,1"}}, "camera", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--view", "lefd"}}, "left", {"v.png"});
}

TEST_F(Cli, errorsNeedTheMeshUnlessItWasBuiltJustNow) {
  writeFile(at("mesh.obj"), kTetrahedron);
  const std::string build = "build " + at("mesh.obj") + " output=" + at("m.hpsdf") + " target-error=1e-4";
  const std::string slice = "slice output=" + at("s.png") + " color=error size=100x80 cpu=true";
  const Outcome together = run({{"run", "-e", build, "-e", slice}});
  EXPECT_EQ(together.status, 0) << together.err;
  const Outcome alone = run({{"slice", at("m.hpsdf"), "-o", at("a.png"), "--color", "error", "--cpu"}});
  EXPECT_EQ(alone.status, 2);
  EXPECT_THAT(alone.err, HasSubstr("mesh=mesh.obj"));
  EXPECT_EQ(run({{"slice", at("m.hpsdf"), "-o", at("a.png"), "--color", "error", "--cpu", "--size", "100x80", "--mesh",
                  at("mesh.obj")}})
                .status,
            0);
  EXPECT_EQ(readFile(at("a.png")), readFile(at("s.png")));
}

// Films

TEST_F(Cli, aTurntableIsRenderFromAllAround) {
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

  // a shorter one in its place leaves no frame of the longer
  const Outcome again = with({"turntable", field(), "-o", at("turn"), "--frames", "2", "--view", "left", "--json"});
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_THAT(namesIn(at("turn")), ElementsAre("frame-0000.png", "frame-0001.png", "frames.json"));
  const Json json = Json::parse(again.out);
  EXPECT_EQ(json, Json::parse(readFile(at("turn/frames.json"))));
  EXPECT_EQ(json.at("frames")[1], (Json{{"file", "frame-0001.png"}, {"azimuth", 90}}));

  fs::create_directory(at("mine"));
  writeFile(at("mine/frame-0000.png"), "years of work");
  expectRefused({{"turntable", field(), "-o", at("mine"), "--frames", "2"}}, "holds other things");
  EXPECT_EQ(readFile(at("mine/frame-0000.png")), "years of work");
  expectRefused({{"turntable", field(), "-o", at("x.gif"), "--frames", "2"}}, "a name that ends in .mp4");
  expectRefused({{"turntable", field(), "-o", at("mine/frame-0000.png/x")}}, "cannot make this folder");
  expectRefused({{"turntable", field(), "-o", at("x"), "--camera", "0,99,1"}}, "elevation");
  expectRefused({{"turntable", at("none.hpsdf"), "-o", at("new/x")}}, "no such file");
}

TEST_F(Cli, framesShowTheRefinement) {
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
  const auto levels = statistics(finished).degreeLeaves;
  const std::string range = "2," + std::to_string(levels.rbegin()->first);
  for (std::size_t frame = 0; frame < 5; ++frame) {
    EXPECT_EQ(statistics(fieldAfter(frame)).leaves, rows[frame].at("leaves"));
    ASSERT_EQ(
        run({{"slice", at("s.hpsdf"), "-o", at("s.png"), "--size", "160x120", "--cpu", "--levels", range}}).status, 0);
    EXPECT_TRUE(readFile(at("f/frame-000" + std::to_string(frame) + ".png")) == readFile(at("s.png"))) << frame;
  }

  // the last frame's own scale, and it holds for the first
  ASSERT_EQ(frames("d", "slice color=distance axis=x").status, 0);
  ASSERT_EQ(
      run({{"slice", field(), "-o", at("s.png"), "--size", "160x120", "--cpu", "--color", "distance", "--axis", "x"}})
          .status,
      0);
  EXPECT_TRUE(readFile(at("d/frame-0004.png")) == readFile(at("s.png")));
  ASSERT_EQ(frames("e", "render color=error").status, 0);
  ASSERT_EQ(run({{"render", field(), "-o", at("s.png"), "--size", "160x120", "--cpu", "--color", "error"}}).status, 0);
  EXPECT_TRUE(readFile(at("e/frame-0004.png")) == readFile(at("s.png")));

  // one for each step where there are fewer
  const Outcome few = run({{"frames", "builtin:torus", "--max-steps", "2", "-o", at("few"), "--of", "slice cpu=true"}});
  EXPECT_THAT(few.out, HasSubstr("few: 3 frames"));

  expectRefused({{"frames", "builtin:torus", "-o", at("x"), "--of", "slice colour=depth"}},
                "of:1:7: slice: unknown option 'colour'");
  expectRefused({{"frames", "builtin:torus", "-o", at("x"), "--of", "slice output=a.png"}}, "unknown option 'output'");
  expectRefused({{"frames", "builtin:torus", "-o", at("x"), "--of", "info"}}, "of:1:1: unknown command 'info'");
  expectRefused({{"frames", "builtin:torus", "-o", at("x"), "--of", "slice; slice"}}, "expected one command");
  expectRefused({{"frames", "builtin:torus", "-o", at("x"), "--of", "slice axis=x plane=0,0,0,0,0,1"}}, "plane");
  expectRefused({{"slice", field(), "-o", at("x.png"), "--levels", "3,2"}}, "levels");
  expectRefused({{"slice", field(), "-o", at("x.png"), "--color", "slope", "--levels", "2,3"}}, "levels");
}

TEST_F(Cli, filmsNeedFfmpegAndLeaveNothingElse) {
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
  expectRefused(film(at("none")), "takes the program ffmpeg, which PATH does not have; install it, or give a folder");
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

TEST_F(Cli, viewsThatShowLittleAreNoted) {
  const auto render = [&](const std::string& offset) {
    const Outcome outcome =
        run({{"render", field(), "-o", at("r.png"), "--size", "160x90", "--cpu", "--offset", offset}});
    EXPECT_EQ(outcome.status, 0);
    return outcome.err;
  };
  EXPECT_THAT(render("0"), IsEmpty());
  EXPECT_THAT(render("5"), HasSubstr("no surface in view"));
  EXPECT_THAT(render("0.9"), HasSubstr("domain"));
}

TEST_F(Cli, drawsWithOpenGl) {
  HPSDF_REQUIRE_GL();
  const Outcome slice = run({{"slice", field(), "-o", at("s.png"), "--size", "200x120", "--gl", "software"}});
  EXPECT_EQ(slice.status, 0) << slice.err;
  const Outcome surface = run({{"render", field(), "-o", at("r.png"), "--size", "200x120", "--gl", "software"}});
  EXPECT_EQ(surface.status, 0) << surface.err;
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("r.png", "s.png"));
}

TEST_F(Cli, withoutEglPicturesAreRefusedAndTheCpuStillDraws) {
  const std::map<std::string, std::string> noEgl = {{"__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent"}};
  expectRefused({.words = {"slice", field(), "-o", at("s.png")}, .environment = noEgl}, "render with --cpu");
  expectRefused({.words = {"render", field(), "-o", at("r.png")}, .environment = noEgl}, "render with --cpu");
  expectRefused({.words = {"report", field(), "-o", at("report")}, .environment = noEgl}, "render with --cpu");
  const Outcome doctor = run({.words = {"doctor", "--json"}, .environment = noEgl});
  EXPECT_EQ(doctor.status, 0) << doctor.err;
  EXPECT_TRUE(Json::parse(doctor.out).at("renderer").is_null());
  EXPECT_EQ(
      run({.words = {"slice", field(), "-o", at("s.png"), "--cpu", "--size", "64x64"}, .environment = noEgl}).status,
      0);
}

// Scripts

TEST_F(Cli, scriptsWorkOnTheCurrentField) {
  writeFile(at("s.hps"),
            "build analytic:sphere target-error=$tau grid=2\nslice size=64x64 cpu=true output=\"a b.png\"\n"
            "save -o s.hpsdf\nload s.hpsdf\nquery points=points.txt output=q.csv\n");
  writeFile(at("points.txt"), "0 0 0\n");
  const Outcome outcome = run({.words = {"run", "s.hps", "tau=1e-3"}, .folder = folder_.path()});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("a b.png", "points.txt", "q.csv", "s.hps", "s.hpsdf"));
  EXPECT_EQ(load(at("s.hpsdf")).metadata().targetError, 1e-3);
}

TEST_F(Cli, scriptLinesOnTheCommandLine) {
  const Outcome outcome = run({{"run", "-e", "load \"$file\"; info --json", "-e", "info --json", "file=" + field()}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out.find("\"leaves\""), outcome.out.rfind("\"leaves\"", outcome.out.size() / 2));
  EXPECT_NE(outcome.out.find("\"leaves\""), outcome.out.rfind("\"leaves\""));
}

TEST_F(Cli, scriptsRunScripts) {
  writeFile(at("inner.hps"), "slice size=64x64 cpu=true output=$name.png\n");
  writeFile(at("outer.hps"), "load \"$field\"\nrun inner.hps name=one\nrun inner.hps name=two\n");
  const Outcome outcome = run({.words = {"run", "outer.hps", "field=" + field()}, .folder = folder_.path()});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("inner.hps", "one.png", "outer.hps", "two.png"));
  writeFile(at("loop.hps"), "run loop.hps\n");
  expectRefused({.words = {"run", "loop.hps"}, .folder = folder_.path()}, "does one run itself?");
}

TEST_F(Cli, scriptsIncludeScripts) {
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

TEST_F(Cli, expectationsHoldOrEndTheScript) {
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
  // a mistake in the last line shows before the first has run
  EXPECT_THAT(complaint("slice output=" + at("unseen.png") + "; expect stat.leaves < 3"), HasSubstr("'stats'"));
  EXPECT_FALSE(fs::exists(at("unseen.png")));
}

/// What a pixel of a picture shows is what the field says there.
TEST_F(Cli, picksAgreeWithQueries) {
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
    // the hit of a ray is rounded and may lie on the other side of a face; points of a slice are exact
    EXPECT_LE(odd, std::string(look).starts_with("render") ? hits / 50 : 0) << look;
  }
}

TEST_F(Cli, scriptMistakesAreRefused) {
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

// Report

TEST_F(Cli, reportIsOnePageWithItsPictures) {
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
  EXPECT_THAT(page, Not(HasSubstr("http")));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_NO_THROW(load(at("new/report/torus.hpsdf")));
}

TEST(ReportPage, escapesWhatItShows) {
  ReportPage page{.title = "<b>&\"", .subtitle = "s"};
  page.pictures.push_back({"x.png", "a<b", "c&d", "hpsdf build 'a<b'"});
  const std::string html = reportHtml(page);
  EXPECT_THAT(html, HasSubstr("<h1>&lt;b&gt;&amp;&quot;</h1>"));
  EXPECT_THAT(html, HasSubstr("hpsdf build 'a&lt;b'"));
  EXPECT_THAT(html, Not(HasSubstr("<b>&")));
}

TEST(Summaries, numbersAreReadable) {
  EXPECT_EQ(shortNumber(1e-6), "1e-6");
  EXPECT_EQ(shortNumber(-3.0591e-4), "-3.06e-4");
  EXPECT_EQ(shortNumber(9.999e-7), "1e-6");
  EXPECT_EQ(shortNumber(2.5e12), "2.5e12");
  EXPECT_EQ(shortNumber(0.125), "0.125");
  EXPECT_EQ(shortNumber(0), "0");
  EXPECT_EQ(shortNumber(-INFINITY), "-inf");
  EXPECT_EQ(shortNumber(NAN), "nan");
  EXPECT_EQ(grouped(1234567), "1,234,567");
  EXPECT_EQ(grouped(999), "999");
}

// Bad input: one line that names the file, exit status 2, no output file

TEST_F(Cli, badMeshesAreRefused) {
  writeFile(at("empty.obj"), "");
  writeFile(at("text.obj"), "this is no mesh\n");
  writeFile(at("text.xyz"), "this is no mesh\n");
  writeFile(at("nan.obj"), "v 0 0 nan\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n");
  writeFile(at("flat.obj"), "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  writeFile(at("range.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  fs::create_directory(at("folder.obj"));
  const auto before = namesIn(folder_.path());
  for (const char* name :
       {"missing.obj", "empty.obj", "text.obj", "text.xyz", "nan.obj", "flat.obj", "range.obj", "folder.obj"}) {
    expectRefused({{"build", at(name), "-o", at("f.hpsdf")}}, name, before);
    expectRefused({{"mesh", at(name)}}, name, before);
    expectRefused({{"report", at(name), "-o", at("report/deep")}}, name, before);
  }
  expectRefused({{"build", "builtin:tours", "-o", at("f.hpsdf")}}, "torus", before);
  expectRefused({{"build", "builtin:torus,majr=1", "-o", at("f.hpsdf")}}, "major", before);
  expectRefused({{"build", "analytic:gear", "-o", at("f.hpsdf")}}, "gear", before);
  expectRefused({{"mesh", "analytic:sphere"}}, "analytic", before);
}

TEST_F(Cli, whatBringsTheImporterDownIsRefused) {
  writeFile(at("down.gltf"), kBringsAssimpDown);
  writeFile(at("slow.obj"), slowPolygon());
  writeFile(at("t.obj"), kTetrahedron);
  const auto before = namesIn(folder_.path());
  for (const Call& call : {Call{{"mesh", at("down.gltf")}}, Call{{"build", at("down.gltf"), "-o", at("f.hpsdf")}},
                           Call{{"verify", field(), at("down.gltf")}}})
    expectRefused(call, "down.gltf: the process that read it came down (", before);
  const auto mesh = [&](const char* name, const std::string& variable, const std::string& value) {
    return Call{.words = {"mesh", at(name)}, .environment = {{variable, value}}};
  };
  const Outcome slow = run(mesh("slow.obj", "HPSDF_IMPORT_SECONDS", "0.5"));
  EXPECT_EQ(slow.status, 2);
  EXPECT_THAT(slow.err, HasSubstr("slow.obj: reading it takes more than 0.5 s"));
  expectRefused(mesh("t.obj", "HPSDF_IMPORT_SECONDS", "soon"), "HPSDF_IMPORT_SECONDS: expected a number above 0",
                before);
  expectRefused(mesh("t.obj", "HPSDF_IMPORT_BYTES", "-1"), "HPSDF_IMPORT_BYTES: expected a number above 0", before);
  EXPECT_EQ(run(mesh("t.obj", "HPSDF_IMPORT_BYTES", "1e9")).status, 0);
}

TEST_F(Cli, theImporterIsNoCommand) {
  EXPECT_EQ(Json::parse(run({{"doctor", "--json"}}).out).at("mesh_reader"), "own process");
  EXPECT_EQ(Json::parse(runHere({"doctor", "--json"}).out).at("mesh_reader"), "this process");
  EXPECT_THAT(run({{"docs"}}).out, Not(HasSubstr("__read-mesh")));
  expectRefused({{"__read-mesh", at("t.obj")}}, "unknown command '__read-mesh'");
}

TEST_F(Cli, badOptionsAreRefused) {
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
      "1e+06 cells and would need 330.00 MB, more than the 100.00 MB allowed: take at most 67 an axis, or allow more "
      "memory");
  expectRefused(build({"--grid", "800", "--memory-limit", "1e15"}), "base grid 800");
  expectRefused(build({"--max-degree", "31"}), "--max-degree: expected a whole number from 1 to 30");
  expectRefused(build({"--domain", "1,1,1,0,0,0"}), "expected lower corner");
  expectRefused(build({"--nearness", "nan"}), "--nearness");
  expectRefused(build({"--margin", "inf"}), "--margin");
}

TEST_F(Cli, badFieldFilesAreRefused) {
  const std::string good = readFile(field());
  const auto variant = [&](const std::string& name, const std::string& bytes) { writeFile(at(name), bytes); };
  variant("truncated.hpsdf", good.substr(0, good.size() / 2));
  variant("short.hpsdf", good.substr(0, 5));
  variant("empty.hpsdf", "");
  variant("foreign.hpsdf", std::string(kTetrahedron));
  variant("longer.hpsdf", good + "x");
  for (const std::size_t byte : {good.size() / 3, good.size() - 100, std::size_t{100}}) {
    std::string altered = good;
    altered[byte] = static_cast<char>(altered[byte] ^ 0x10);
    variant("altered" + std::to_string(byte) + ".hpsdf", altered);
  }
  std::string version = good;
  version[8] = static_cast<char>(version[8] + 1);  // docs/file-format.md: the version follows 8 bytes of magic
  variant("newer.hpsdf", version);
  fs::create_directory(at("folder.hpsdf"));
  const auto before = namesIn(folder_.path());
  for (std::string name : before) {
    expectRefused({{"info", at(name)}}, name, before);
    expectRefused({{"slice", at(name), "-o", at("s.png"), "--cpu"}}, name, before);
    expectRefused({{"query", at(name), "-o", at("q.csv")}, "0 0 0\n"}, name, before);
  }
  expectRefused({{"info", at("newer.hpsdf")}}, "version 5", before);
  expectRefused({{"info", at("missing.hpsdf")}}, "missing.hpsdf", before);
}

TEST_F(Cli, unwritableOutputsAreRefusedBeforeTheWork) {
  writeFile(at("file"), "x");
  for (const std::string& output :
       {at("none/f.hpsdf"), at("file/f.hpsdf"), folder_.path().string(), std::string("/dev/null")}) {
    const auto start = Clock::now();
    // a target that takes minutes: were the file opened after the construction, this test would run into its limit
    expectRefused({{"build", "builtin:gear", "-o", output, "--target-error", "1e-12"}}, output);
    EXPECT_LT(Clock::now() - start, std::chrono::seconds(10));
  }
  expectRefused({{"slice", field(), "-o", at("none/s.png"), "--cpu"}}, "none/s.png");
  expectRefused({{"slice", field(), "-o", at("none/s.csv"), "--cpu"}}, "none/s.csv");
  expectRefused({{"render", field(), "-o", at("none/s.png"), "--cpu"}}, "none/s.png");
  expectRefused({{"query", field(), "-o", at("none/q.csv")}}, "none/q.csv");
  expectRefused({{"jumps", field(), "-o", at("none/j.csv")}}, "none/j.csv");
  expectRefused({{"report", field(), "-o", at("file")}}, "file");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(Cli, aReaderThatWentAwayIsAnError) {
  const Outcome outcome = run({.words = {"info", field()}, .stdoutClosed = true});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.err, HasSubstr("cannot write to standard output"));
  EXPECT_EQ(lineCount(outcome.err), 1u) << outcome.err;
}

/// As on a full disk: what was there before is left as it was, and nothing half-written beside it.
TEST_F(Cli, outputsThatDoNotFitLeaveTheOlderOnes) {
  const std::vector<std::vector<std::string>> calls = {
      {"build", "builtin:torus", "--target-error", "1e-4", "-o"},
      {"build", "builtin:torus", "--target-error", "1e-4", "--checkpoint", "-o"},
      {"smooth", field(), "-o"},
      {"blend", field(), "-o"},
      {"bounds", field(), "-o"},
      {"export", field(), "--resolution", "9", "-o"},
      {"jumps", field(), "-o"},
      {"slice", field(), "--cpu", "--size", "64x64", "-o"},
      {"render", field(), "--cpu", "--size", "64x64", "-o"},
      {"docs", "-o"}};
  for (std::vector<std::string> words : calls) {
    const std::string output = at(words[0] == "export"                          ? "old.cdf"
                                  : words[0] == "slice" || words[0] == "render" ? "old.png"
                                  : words[0] == "jumps"                         ? "old.csv"
                                                                                : "old.hpsdf");
    words.push_back(output);
    SCOPED_TRACE(words[0]);
    writeFile(output, "old");
    const Outcome outcome = [&] {
      const support::ShortFiles limit(512);
      return run({words});
    }();
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, HasSubstr("hpsdf: error: " + output + ": writing failed"));
    EXPECT_THAT(outcome.out, IsEmpty());
    EXPECT_EQ(readFile(output), "old");
    EXPECT_THAT(namesIn(folder_.path()), ElementsAre(fs::path(output).filename().string()));
    fs::remove(output);
  }
}

TEST_F(Cli, standardOutputOnAFullDiskIsAnError) {
  for (const auto& words :
       {std::vector<std::string>{"info", field()}, {"info", field(), "--json"}, {"query", field()}}) {
    const Outcome outcome = run({.words = words, .input = "0 0 0\n", .output = "/dev/full"});
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, HasSubstr("cannot write to standard output"));
    EXPECT_EQ(lineCount(outcome.err), 1u) << outcome.err;
  }
}

TEST_F(Cli, foldersThatTakeNothingAreRefusedBeforeTheWork) {
  for (const std::string& output :
       {std::string("/proc/f.hpsdf"), std::string("/dev/full"), at(std::string(300, 'x'))}) {
    expectRefused({{"build", "builtin:gear", "-o", output, "--target-error", "1e-12"}}, output);
    expectRefused({{"build", "builtin:gear", "-o", output, "--target-error", "1e-12", "--checkpoint"}}, output);
  }
  expectRefused({{"report", field(), "-o", at(std::string(300, 'x'))}}, "File name too long; check");
}

/// Another program puts it there and takes it away: its content, or one line that says what happened.
TEST_F(Cli, aFileThatComesAndGoesIsReadOrRefused) {
  std::atomic<bool> over = false;
  std::thread other([&] {
    for (bool there = false; !over; there = !there) {
      if (there)
        fs::remove(at("f.hpsdf"));
      else
        fs::create_hard_link(field(), at("f.hpsdf"));
    }
  });
  int refused = 0, read = 0;
  const auto start = Clock::now();
  for (int n = 0; n < 300 || ((refused == 0 || read == 0) && Clock::now() - start < std::chrono::seconds(20)); ++n) {
    const Outcome outcome = runHere({"info", at("f.hpsdf")});
    ++(outcome.status == 0 ? read : refused);
    if (outcome.status == 0) continue;
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, AllOf(HasSubstr("f.hpsdf"), Not(HasSubstr("fault of the program"))));
  }
  over = true;
  other.join();
  EXPECT_GT(refused, 0);
  EXPECT_GT(read, 0);
}

// Checkpoints

/// What tells a file that was written anew: nothing where there is none.
std::optional<ino_t> identityOf(const fs::path& file) {
  struct stat status {};
  return stat(file.c_str(), &status) == 0 ? std::optional(status.st_ino) : std::nullopt;
}

class Checkpoints : public Cli {
 protected:
  /// A second's work, and the state kept as often as its share of the time allows.
  Call build(std::vector<std::string> more = {}) const {
    std::vector<std::string> words = {"build",          "builtin:gear", "-o",          at("f.hpsdf"),
                                      "--target-error", "1e-6",         "--checkpoint"};
    if (std::ranges::find(more, "--checkpoint-seconds") == more.end())
      more.insert(more.end(), {"--checkpoint-seconds", "0"});
    words.insert(words.end(), more.begin(), more.end());
    return {words};
  }
  std::string state() const { return at("f.hpsdf.checkpoint"); }

  /// Until a state is kept that was not there before.
  std::function<bool()> newState() const {
    return [file = state(), before = identityOf(state())] {
      const auto now = identityOf(file);
      return now && now != before;
    };
  }
  /// While a state is being written.
  std::function<bool()> halfState() const {
    return [folder = folder_.path()] {
      return std::ranges::any_of(namesIn(folder),
                                 [](const std::string& name) { return name.starts_with("f.hpsdf.checkpoint.part-"); });
    };
  }
};

TEST_F(Checkpoints, whatIsKilledGoesOnToTheSameBytes) {
  support::TemporaryDirectory elsewhere;
  const std::string whole = (elsewhere / "whole.hpsdf").string();
  ASSERT_EQ(run({{"build", "builtin:gear", "-o", whole, "--target-error", "1e-6"}}).status, 0);
  int kills = 0;
  for (int n = 0; n < 6; ++n) {
    Process process(build({"--threads", std::to_string(n % 3)}));
    if (process.sendWhen(n % 2 == 0 ? newState() : halfState(), SIGKILL)) ++kills;
    process.finish();
    if (!fs::exists(at("f.hpsdf"))) continue;
    EXPECT_TRUE(readFile(at("f.hpsdf")) == readFile(whole)) << "it was faster than we";
    fs::remove(at("f.hpsdf"));
  }
  EXPECT_GE(kills, 2);
  if (!fs::exists(state())) {
    Process process(build());
    ASSERT_TRUE(process.sendWhen(newState(), SIGKILL));
    process.finish();
  }
  const Outcome outcome = run(build());
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("note: going on from " + state() + ", after "));
  EXPECT_TRUE(readFile(at("f.hpsdf")) == readFile(whole));
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("f.hpsdf"));
}

TEST_F(Checkpoints, othersAreRefused) {
  Process process(build());
  ASSERT_TRUE(process.sendWhen(newState(), SIGINT));
  const Outcome outcome = process.finish();
  EXPECT_EQ(outcome.status, 130);
  EXPECT_THAT(outcome.err, HasSubstr("cancelled; " + state() + " keeps what was done"));
  ASSERT_THAT(namesIn(folder_.path()), ElementsAre("f.hpsdf.checkpoint"));
  const std::string kept = readFile(state());
  const auto refused = [&](const Call& call, const std::string& message) {
    expectRefused(call, "error: " + state() + ": " + message);
    EXPECT_TRUE(readFile(state()) == kept);
  };
  refused(build({"--nearness", "3"}), "is a checkpoint of a build with other options; delete it");
  refused(build({"--bounds"}), "is a checkpoint of a build with other options");
  Call other = build();
  other.words[1] = "builtin:torus";
  refused(other, "is a checkpoint of another surface; delete it");
  writeFile(state(), kept.substr(0, kept.size() - 1));
  expectRefused(build(), state() + ": the checkpoint is damaged: it ends too early; delete it");
  fs::remove(state());
  fs::create_directory(state());
  expectRefused(build(), state() + ": is a folder");
}

TEST_F(Checkpoints, standBesideAnOutput) {
  expectRefused({{"run", "-e", "build builtin:torus checkpoint=true"}}, "give output");
  expectRefused({{"build", "builtin:torus", "-o", at("f.hpsdf"), "--checkpoint-seconds", "1"}},
                "belongs to checkpoint");
}

/// A state, in double, does not fit where the field does.
TEST_F(Checkpoints, thatCannotBeKeptAreWarnedAbout) {
  Call call{
      {"build", "builtin:torus", "-o", at("f.hpsdf"), "--grid", "10", "--max-steps", "0", "--coefficients", "float"}};
  ASSERT_EQ(run(call).status, 0);
  const std::string whole = readFile(at("f.hpsdf"));
  call.words.insert(call.words.end(), {"--checkpoint", "--checkpoint-seconds", "0"});
  const Outcome outcome = [&] {
    const support::ShortFiles limit(whole.size());
    return run(call);
  }();
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("warning: " + state() + ": writing failed"));
  EXPECT_TRUE(readFile(at("f.hpsdf")) == whole);
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("f.hpsdf"));
}

// Ctrl-C

TEST_F(Cli, interruptStopsTheConstruction) {
  for (const auto& words :
       {std::vector<std::string>{"build", "builtin:gear", "-o", at("f.hpsdf"), "--target-error", "1e-12"},
        std::vector<std::string>{"report", "builtin:gear", "-o", at("report"), "--target-error", "1e-12"},
        std::vector<std::string>{"frames", "builtin:gear", "-o", at("frames"), "--target-error", "1e-12"},
        std::vector<std::string>{"turntable", field(), "-o", at("turn"), "--frames", "9999", "--size", "160x120",
                                 "--cpu"},
        std::vector<std::string>{"export", field(), "-o", at("grid.cdf"), "--resolution", "3", "--points", "1e8"}}) {
    Process process({words});
    process.waitForErrorLine();
    const auto start = Clock::now();
    process.send(SIGINT);
    const Outcome outcome = process.finish();
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    EXPECT_EQ(outcome.status, 130) << outcome.err;
    EXPECT_THAT(outcome.err, EndsWith("hpsdf: cancelled; nothing is half-written\n"));
    EXPECT_THAT(outcome.out, IsEmpty());
    EXPECT_LT(seconds, 5) << "the promise is one second; this machine may be busy";
    EXPECT_THAT(namesIn(folder_.path()), IsEmpty());
  }
}

/// However the program ends while a mesh file is read, the process that reads it ends as well.
TEST_F(Cli, theImporterEndsWithTheProgram) {
  writeFile(at("slow.obj"), slowPolygon());
  const auto readers = [&] {
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator("/proc")) {
      std::ifstream words(entry.path() / "cmdline");
      const std::string text{std::istreambuf_iterator<char>(words), {}};
      count += text.find("__read-mesh") != std::string::npos && text.find(at("slow.obj")) != std::string::npos;
    }
    return count;
  };
  for (const auto& [signal, status] : {std::pair{SIGINT, 130}, {SIGKILL, -SIGKILL}}) {
    Process process({{"mesh", at("slow.obj")}});
    process.waitForErrorLine();  // of its progress
    EXPECT_EQ(readers(), 1u);
    process.send(signal);
    const Outcome outcome = process.finish();
    EXPECT_EQ(outcome.status, status);
    EXPECT_THAT(outcome.err, EndsWith(signal == SIGINT ? "hpsdf: cancelled; nothing is half-written\n" : ""));
    for (int i = 0; i < 500 && readers() > 0; ++i) usleep(10000);
    EXPECT_EQ(readers(), 0u);
  }
}

TEST_F(Cli, outputsAreNotTheirInputs) {
  fs::copy_file(field(), at("f.hpsdf"));
  writeFile(at("mesh.obj"), kTetrahedron);
  writeFile(at("points"), "0 0 0\n");
  fs::create_symlink(at("f.hpsdf"), at("link.csv"));
  const auto before = namesIn(folder_.path());
  expectRefused({{"build", at("mesh.obj"), "-o", at("mesh.obj")}}, "mesh.obj", before);
  expectRefused({{"query", at("f.hpsdf"), at("points"), "-o", at("f.hpsdf")}}, "f.hpsdf", before);
  expectRefused({{"query", at("f.hpsdf"), at("points"), "-o", at("points")}}, "points", before);
  expectRefused({{"slice", at("f.hpsdf"), "-o", at("link.csv"), "--cpu"}}, "link.csv", before);
  expectRefused({{"run", "-e", "query " + at("f.hpsdf") + " " + at("points") + " output=" + at("points")}}, "points",
                before);
  EXPECT_EQ(readFile(at("f.hpsdf")), readFile(field()));
  EXPECT_EQ(readFile(at("points")), "0 0 0\n");
  EXPECT_EQ(readFile(at("mesh.obj")), kTetrahedron);
}

TEST_F(Cli, slicesOfFieldsAwayFromTheOriginCutTheirMiddle) {
  ASSERT_EQ(run({{"build", "analytic:sphere", "-o", at("far.hpsdf"), "--domain", "10,10,10,11,12,13", "--target-error",
                  "1e-2"}})
                .status,
            0);
  const Outcome outcome = run({{"slice", at("far.hpsdf"), "-o", at("s.csv"), "--cpu", "--size", "16x16"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(readFile(at("s.csv")), HasSubstr(",11.5,"));
}

TEST_F(Cli, aDomainBesideTheSurfaceIsWarnedAbout) {
  const auto build = [&](const std::string& domain) {
    return run({{"build", "analytic:sphere", "-o", at("f.hpsdf"), "--domain", domain, "--target-error", "1e-2"}}).err;
  };
  EXPECT_THAT(build("5,5,5,6,6,6"), HasSubstr("warning: the domain leaves out the whole surface"));
  EXPECT_THAT(build("0,-2,-2,2,2,2"), HasSubstr("warning: the domain leaves out part of the surface"));
  EXPECT_THAT(build("-2,-2,-2,2,2,2"), Not(HasSubstr("warning")));
}

TEST_F(Cli, normalizationIsRemembered) {
  writeFile(at("mesh.off"), "OFF\n4 4 0\n10 0 0\n14 0 0\n10 2 0\n10 0 2\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
  ASSERT_EQ(run({{"build", at("mesh.off"), "-o", at("f.hpsdf"), "--normalize", "--target-error", "1e-3"}}).status, 0);
  const auto json = nlohmann::json::parse(run({{"info", at("f.hpsdf"), "--json"}}).out);
  EXPECT_EQ(json["normalization"]["scale"], 0.5);
  EXPECT_EQ(json["normalization"]["center"], nlohmann::json({12.0, 1.0, 1.0}));
  EXPECT_THAT(run({{"info", at("f.hpsdf")}}).out, HasSubstr("field = 0.5 · (mesh − (12, 1, 1))"));
}

/// The process waits in the middle of its output's temporary file: what a full pipe does to it.
TEST_F(Cli, anInterruptOutsideOfAConstructionLeavesNothingEither) {
  Process process({.words = {"query", field(), "-o", at("q.csv")}, .keepInputOpen = true});
  for (int i = 0; i < 1000 && namesIn(folder_.path()).empty(); ++i) usleep(10000);
  ASSERT_EQ(namesIn(folder_.path()).size(), 1u) << "the temporary file";
  process.send(SIGTERM);
  const Outcome outcome = process.finish();
  EXPECT_EQ(outcome.status, 143);
  EXPECT_THAT(outcome.err, EndsWith("hpsdf: cancelled; nothing is half-written\n"));
  EXPECT_THAT(namesIn(folder_.path()), IsEmpty());
}

/// A program that asks point by point gets its answers point by point.
TEST_F(Cli, queriesOnAPipeAreAnsweredAtOnce) {
  Process process({.words = {"query", field()}, .keepInputOpen = true});
  process.type("0 0 0\n");
  process.waitForLines(2);
  process.type("1 1 1\n");
  process.waitForLines(3);
  process.closeInput();
  const Outcome outcome = process.finish();
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(lineCount(outcome.out), 3u);
}

TEST_F(Cli, anOlderFileSurvivesAnInterrupt) {
  fs::copy_file(field(), at("f.hpsdf"));
  Process process({{"build", "builtin:gear", "-o", at("f.hpsdf"), "--target-error", "1e-12"}});
  process.waitForErrorLine();
  process.send(SIGINT);
  EXPECT_EQ(process.finish().status, 130);
  EXPECT_EQ(readFile(at("f.hpsdf")), readFile(field()));
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("f.hpsdf"));
}

// Progress

TEST(Progress, aPipeGetsALineAQuarterAndEveryTenSeconds) {
  std::ostringstream out;
  const Clock::time_point start{};
  const auto after = [&](double seconds) {
    return start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  };
  {
    ProgressLine line(out, false, start);
    line.report("refining", 0, after(1.9));
    line.report("refining", 0, after(2.1));
    line.report("refining", 0.1, after(5));
    line.report("refining", 0.26, after(6));
    line.report("refining", 0.3, after(7));
    line.report("refining", 0.31, after(17));
    line.report("refining", 1, after(18));
  }
  EXPECT_EQ(out.str(),
            "refining   0 %, 2 s\n"
            "refining  26 %, 6 s, about 17 s left\n"
            "refining  31 %, 17 s, about 38 s left\n"
            "refining 100 %, 18 s\n");
}

TEST(Progress, aTerminalGetsOneLineThatIsErased) {
  std::ostringstream out;
  const Clock::time_point start{};
  {
    ProgressLine line(out, true, start);
    for (int i = 0; i <= 1000; ++i) line.report("refining", i / 1000.0, start + std::chrono::milliseconds(i));
  }
  EXPECT_EQ(lineCount(out.str()), 0u);
  EXPECT_LE(std::ranges::count(out.str(), '['), 2 * 12);  // a bar and an escape sequence each: at most 10 a second
  EXPECT_THAT(out.str(), EndsWith("\r\x1b[K"));
}

TEST(Progress, quickWorkNeedsNoWords) {
  for (const bool redraws : {false, true}) {
    std::ostringstream out;
    const Clock::time_point start{};
    {
      ProgressLine line(out, redraws, start);
      const auto step = std::chrono::milliseconds(redraws ? 50 : 450);
      for (int i = 0; i <= 4; ++i) line.report("measuring", i / 4.0, start + i * step);
    }
    EXPECT_EQ(out.str(), "");
  }
}

TEST(Progress, durationsAreReadable) {
  EXPECT_EQ(durationText(0.2), "0 s");
  EXPECT_EQ(durationText(187), "3 min 07 s");
  EXPECT_EQ(durationText(7500), "2 h 05 min");
}

}  // namespace
}  // namespace hpsdf::app
