// Tests `hpsdf build`: meshes, domains, memory limits, inside tests and warnings.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "cli_fixture.h"
#include "commands/commands.h"
#include "hpsdf/app/failed.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/verify.h"
#include "session/asked_errors.h"

namespace hpsdf::app {
namespace cli_build_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using BuildCommand = Cli;

TEST_F(BuildCommand, buildWritesAFieldThatLoads) {
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

TEST_F(BuildCommand, normalizedCubeIsExact) {
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

TEST_F(BuildCommand, tellsTheErrorsOfTheFinishedField) {
  const Outcome text = run({{"build", "builtin:torus", "-o", at("t.hpsdf"), "--target-error", "1e-4"}});
  EXPECT_THAT(text.out, HasSubstr("measured: near the surface RMS "));
  EXPECT_THAT(text.out, HasSubstr("% of the surface torn (mesh units)"));
  const Outcome info = run({{"info", at("t.hpsdf"), "--json"}});
  const Json measured = Json::parse(info.out).at("measured");
  const Field field = load(at("t.hpsdf"));
  const Measurement found = measure(field, ExactDistance(loadMesh("builtin:torus")));
  EXPECT_EQ(measured.at("near").at("rms"), found.near.rms);
  EXPECT_EQ(measured.at("domain").at("max"), found.domain.max);
  EXPECT_EQ(measured.at("torn_share"), found.tornShare);
  EXPECT_EQ(measured.at("wrong_signs"), 0);
  EXPECT_THAT(run({{"info", at("t.hpsdf")}}).out,
              AllOf(HasSubstr("error near surface"), HasSubstr("worst point"), HasSubstr("weighted estimate")));
  ASSERT_EQ(run({{"smooth", at("t.hpsdf"), "-o", at("s.hpsdf")}}).status, 0);
  EXPECT_TRUE(Json::parse(run({{"info", at("s.hpsdf"), "--json"}}).out).at("measured").is_null());
  EXPECT_THAT(run({{"info", at("s.hpsdf")}}).out, HasSubstr("no, or not since the field was changed"));
}

/// The construction compares estimates with the errors that are asked for; what counts is what is measured.
TEST_F(BuildCommand, failsWhereTheMeasuredErrorExceedsTheOneAskedFor) {
  const auto buildWith = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"build", "builtin:torus", "-o", at("t.hpsdf"), "--strategy",
                                      "hp",    "--max-degree",  "2"};
    words.insert(words.end(), more.begin(), more.end());
    return run({words});
  };
  const Outcome kept = buildWith({"--max-error", "0.05", "--target-error", "1e-4"});
  EXPECT_EQ(kept.status, 0) << kept.err;
  const Outcome missed = buildWith({"--max-error", "1e-3", "--target-error", "1e-4", "--max-depth", "1"});
  EXPECT_EQ(missed.status, kExitFailed);
  EXPECT_THAT(missed.err, HasSubstr("max-error: an error of "));
  EXPECT_THAT(missed.err, HasSubstr("was measured, more than the 1e-3 that was asked for"));
  EXPECT_GT(load(at("t.hpsdf")).metadata().measurement->domain.max, 1e-3) << "the field is kept";
  const Outcome near = buildWith({"--near-error", "1e-5", "--far-error", "1e-3", "--max-depth", "1", "--json"});
  EXPECT_EQ(near.status, kExitFailed);
  EXPECT_THAT(near.err, HasSubstr("near-error: an RMS error near the surface of "));
  EXPECT_FALSE(Json::parse(near.out).at("measured").is_null());
}

TEST_F(BuildCommand, tolerancesAreLengthsOrPercentages) {
  const auto buildWith = [&](const std::string& mesh, const std::vector<std::string>& options) {
    std::vector<std::string> words = {"build", mesh, "-o", at("t.hpsdf"), "--grid", "3"};
    words.insert(words.end(), options.begin(), options.end());
    return run({words});
  };
  // The box of this torus is 2 long.
  const Outcome kept = buildWith("builtin:torus,major=0.75,minor=0.25", {"--tolerance", "1%"});
  EXPECT_EQ(kept.status, 0) << kept.err;
  EXPECT_THAT(kept.out, HasSubstr("tolerance: 0.02 within 0.1 of the surface"));
  EXPECT_THAT(kept.out, HasSubstr("kept, errors reach "));
  const std::vector<std::uint64_t> nodes = load(at("t.hpsdf")).data().nodes;
  EXPECT_THAT(run({{"info", at("t.hpsdf")}}).out, HasSubstr("0.02 within 0.1 of the surface"));
  ASSERT_EQ(buildWith("builtin:torus,major=0.75,minor=0.25", {"--tolerance", "0.02", "--within", "5%"}).status, 0);
  EXPECT_EQ(load(at("t.hpsdf")).data().nodes, nodes);
  const Outcome larger = buildWith("builtin:gear", {"--tolerance", "0.2%", "--json"});
  ASSERT_EQ(larger.status, 0) << larger.err;
  EXPECT_THAT(larger.err, HasSubstr("note: the field will take about "));
  const Json measured = Json::parse(larger.out).at("measured");
  EXPECT_LE(measured.at("tolerance_ratio"), 1);
  EXPECT_EQ(measured.at("beyond_tolerance"), 0);
}

TEST_F(BuildCommand, aMissedToleranceIsToldWithAdvice) {
  const Registry registry = makeRegistry();
  const std::vector<Word> words = {{.text = "builtin:torus"}, {.text = "--tolerance=0.01"}};
  const Arguments arguments = parseArguments(registry.command("build"), words, Origin::script);
  const auto missed = [&](double measuredError, std::uint64_t beyond) {
    FieldData data = load(field()).data();
    data.metadata.settings.tolerance = 0.01;
    data.metadata.settings.within = 0.1;
    data.metadata.measuredError = measuredError;
    data.metadata.measurement->beyondTolerance = beyond;
    data.metadata.measurement->toleranceRatio = 2.5;
    return missedErrors(arguments, Field(std::move(data)));
  };
  const std::string advice =
      ": take a larger tolerance; where the distance jumps because the mesh has holes or intersects itself, repair the "
      "mesh first ('hpsdf mesh --help')";
  const std::string tolerance = "tolerance: 0.01 within 0.1 of the surface, and 1 % of the distance beyond; ";
  EXPECT_EQ(missed(0.009, 0), "");
  EXPECT_EQ(missed(0.03, 0), tolerance + "missed in some cells, where the error is up to 3 times as great" + advice);
  EXPECT_EQ(missed(0.01001, 0), tolerance + "missed in some cells" + advice) << "not 1 times as great";
  EXPECT_THAT(missed(0.009, 7), AllOf(StartsWith(tolerance + "missed at 7 of "), EndsWith(advice)));
}

/// A changed field is neither within the tolerance nor has an estimate of its error, so that texts speak of neither.
TEST_F(BuildCommand, changedFieldsHaveNoToleranceAndNoEstimate) {
  ASSERT_EQ(run({{"build", "builtin:box", "-o", at("t.hpsdf"), "--tolerance", "5%", "--grid", "2"}}).status, 0);
  for (const std::string command : {"smooth", "blend"}) {
    const Outcome changed = run({{command, at("t.hpsdf"), "-o", at("c.hpsdf")}});
    ASSERT_EQ(changed.status, 0) << changed.err;
    EXPECT_THAT(changed.out, Not(HasSubstr("estimate")));
    EXPECT_THAT(run({{"info", at("c.hpsdf")}}).out,
                AllOf(Not(HasSubstr("tolerance")), Not(HasSubstr("estimate")), Not(HasSubstr("error, target"))));
    const Json info = Json::parse(run({{"info", at("c.hpsdf"), "--json"}}).out);
    for (const char* key : {"tolerance", "total_error", "rms_estimate", "target_error", "measured", "measured_error"})
      EXPECT_TRUE(info.at(key).is_null()) << command << " " << key;
  }
}

TEST_F(BuildCommand, analyticShapesAreNormalizedToo) {
  const Outcome built = run({{"build", "analytic:sphere,radius=0.25", "-o", at("s.hpsdf"), "--normalize",
                              "--target-error", "1e-5", "--grid", "3"}});
  ASSERT_EQ(built.status, 0) << built.err;
  const Field sphere = load(at("s.hpsdf"));
  EXPECT_NEAR(sphere.value(Vector3(1, 0, 0)), 0, 0.02);
  EXPECT_NEAR(sphere.value(Vector3(0, 0.5, 0)), -0.5, 0.02);
}

TEST_F(BuildCommand, warnsOfOpenMeshes) {
  writeFile(at("open.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const auto built = [&](const std::string& sign) {
    const Outcome outcome = run({{"build", at("open.obj"), "-o", at("f.hpsdf"), "--target-error", "1", "--domain",
                                  "-1,-1,-1,2,2,2", "--sign", sign}});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(built("pseudonormal"),
              HasSubstr("warning: " + at("open.obj") + ": the surface is not closed (3 boundary"));
  EXPECT_THAT(built("auto"), HasSubstr("sign by winding number: 3 edges are unbalanced"));
  EXPECT_THAT(built("auto"), testing::Not(HasSubstr("warning")));
  const Json mesh = Json::parse(run({{"mesh", at("open.obj"), "--json"}}).out);
  EXPECT_EQ(mesh.at("closed"), false);
  EXPECT_EQ(mesh.at("boundary_edges"), 3);
}

TEST_F(BuildCommand, memoryIsLimitedWithoutATarget) {
  std::string soup;  // random triangles that enclose no volume
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
  EXPECT_THAT(limited.err, Not(HasSubstr("besides the mesh's distance"))) << "this limit was asked for";
  const Outcome byDefault = built({});
  EXPECT_EQ(byDefault.status, 2);
  EXPECT_THAT(byDefault.err, HasSubstr("(where no target is given either, 0.1 GB are allowed besides the mesh's"));
  EXPECT_FALSE(std::filesystem::exists(at("soup.hpsdf")));
  EXPECT_EQ(built({"--memory-limit", "1e8", "--target-error", "1"}).status, 0);
  const Outcome small = run({{"build", "analytic:sphere", "-o", at("s.hpsdf"), "--grid", "1", "--target-error", "1e-14",
                              "--memory-limit", "1e5"}});
  EXPECT_EQ(small.status, 2);
  EXPECT_THAT(small.err, ContainsRegex("about [0-9]+ cells and [0-9.]+ kB of memory are needed")) << "not 0.00 million";
}

TEST_F(BuildCommand, memoryLimitsThatMessagesNameSuffice) {
  for (const std::vector<std::string>& options : std::vector<std::vector<std::string>>{
           {"analytic:torus", "--target-error", "1e-7", "--memory-limit", "1e6"},
           {"analytic:torus", "--grid", "40", "--memory-limit", "1e6"},
           {"builtin:gear,segments=24", "--tolerance", "1", "--grid", "20", "--memory-limit", "2.7e6"},
           {"builtin:torus", "--target-error", "1e-5", "--memory-limit", "1e5"},
           {"builtin:gear", "--strategy", "hpx", "--memory-limit", "2e6"}}) {
    std::vector<std::string> words = {"build", "-o", at("f.hpsdf")};
    words.insert(words.end(), options.begin(), options.end());
    const Outcome refused = run({words});
    EXPECT_EQ(refused.status, 2);
    if (words.back() == "2.7e6") {
      EXPECT_THAT(refused.err, HasSubstr("take a coarser grid, or allow")) << "no cell is divided";
    }
    const std::string name = "--memory-limit ";
    const std::size_t found = refused.err.find(name);
    ASSERT_NE(found, std::string::npos) << refused.err;
    words.back() =
        refused.err.substr(found + name.size(), refused.err.find(' ', found + name.size()) - found - name.size());
    const Outcome built = run({words});
    EXPECT_EQ(built.status, 0) << built.err;
  }
  const Outcome huge =
      run({{"build", "analytic:torus", "-o", at("f.hpsdf"), "--grid", "1000", "--memory-limit", "1e6"}});
  EXPECT_EQ(huge.status, 2);
  EXPECT_THAT(huge.err, HasSubstr("take a coarser grid, at most 14 an axis; this machine does not allow more memory"));
  // A grid that needs more than half of the machine's memory fits all the same.
  const double fitting = std::min(0.6 * allowedMemory() / 330, 4e8);  // cells; one needs 330 bytes
  const Outcome large = run({{"build", "analytic:torus", "-o", at("f.hpsdf"), "--memory-limit", "1e6", "--grid",
                              std::to_string(int(std::cbrt(fitting)))}});
  EXPECT_EQ(large.status, 2);
  EXPECT_THAT(large.err, ContainsRegex("at most 14 an axis, or allow more memory: --memory-limit .* is likely"));
}

TEST_F(BuildCommand, memoryLimitIncludesTheExactDistance) {
  const auto built = [&](const std::string& surface, std::vector<std::string> more) {
    more.insert(more.begin(), {"build", surface, "-o", at("f.hpsdf"), "--max-steps", "0"});
    return run({more});
  };
  const Outcome limited = built("builtin:torus", {"--memory-limit", "1e6"});
  EXPECT_EQ(limited.status, 2);
  EXPECT_THAT(limited.err, HasSubstr("the distance that the field is made from holds"));
  EXPECT_THAT(limited.err, HasSubstr("of memory, more than the 1.00 MB allowed"));
  EXPECT_EQ(built("builtin:torus", {"--memory-limit", "1e8"}).status, 0);
  EXPECT_EQ(built("builtin:torus,segments=700,sides=700", {}).status, 0) << "untold, the limit is for what grows";
}

TEST_F(BuildCommand, studiesNameTheOptionThatAllowsMoreMemory) {
  for (const std::vector<std::string>& kind :
       {std::vector<std::string>{"tradeoff", "--target-errors", "1e-3"}, {"continuity"}, {"convergence"}}) {
    std::vector<std::string> words = {"study", kind[0], "builtin:torus", "-o", at("study"), "--memory-limit", "8e6"};
    words.insert(words.end(), kind.begin() + 1, kind.end());
    const Outcome outcome = run({words});
    EXPECT_EQ(outcome.status, 2) << kind[0];
    EXPECT_THAT(outcome.err, HasSubstr("or allow more memory: --memory-limit ")) << kind[0];
    EXPECT_THAT(outcome.err, Not(HasSubstr("memoryLimit"))) << kind[0];
  }
}

TEST_F(BuildCommand, keepsTheDigitsOfCoordinatesFarFromTheOrigin) {
  const auto tetrahedron = [&](double x) {
    return fmt::format("v {0} 0 0\nv {1} 0 0\nv {0} 2 0\nv {0} 0 2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n", x, x + 2);
  };
  writeFile(at("far.obj"), tetrahedron(1e7 + 1e-6));
  const Outcome mesh = run({{"mesh", at("far.obj"), "--json"}});
  EXPECT_THAT(mesh.err, IsEmpty());
  EXPECT_EQ(Json::parse(mesh.out).at("box").at(0).at(0), 1e7 + 1e-6);
  const Outcome built = run({{"build", at("far.obj"), "-o", at("far.hpsdf"), "--target-error", "1e-3"}});
  EXPECT_EQ(built.status, 0);
  EXPECT_THAT(run({{"info", at("far.hpsdf")}}).out, HasSubstr("(9999999.9, -0.1, -0.1) to (10000002.1, 2.1, 2.1)"));
}

TEST_F(BuildCommand, everyGivenOptionHasAnEffect) {
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

TEST_F(BuildCommand, controlCharactersInNamesDoNotReachTheTerminal) {
  const std::string name = at("red\x1b[31m.obj");
  writeFile(name, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n");
  for (const Call& call : {Call{{"build", name, "-o", at("x.hpsdf"), "--sign", "pseudonormal", "--max-steps", "3"}},
                           Call{{"render", field(), "--defects", name, "-o", at("x.png"), "--cpu"}},
                           Call{{"slice", field(), "--color", "error", "--mesh", name, "-o", at("y.png"), "--cpu"}}}) {
    const Outcome outcome = run(call);
    EXPECT_THAT(outcome.err, AllOf(HasSubstr("warning"), HasSubstr("red"), Not(HasSubstr("\x1b"))));
  }
}

TEST_F(BuildCommand, outerHullOmitsInteriorWalls) {
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

TEST_F(BuildCommand, optionsWithoutEffectAreRefused) {
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
  // `hpsdf study` refuses options that would have no effect or another meaning than in `hpsdf build`.
  refused({"--within", "0.1"}, "within belongs to tolerance");
  refused({"--certified"}, "certified belongs to tolerance");
  refused({"--tolerance", "0.1", "--certified", "--sign", "pseudonormal"}, "certified: nothing is proven where");
  refused({"--tolerance", "0.1", "--strategy", "hp"}, "strategy has no effect with tolerance");
  refused({"--tolerance", "0.1", "--target-error", "1e-3"}, "target-error and tolerance exclude each other");
  refused({"--tolerance", "0.1", "--strategy", "hp"}, "leave out strategy, or give a target error");
  refused({"--tolerance", "0.1", "--checkpoint"}, "no checkpoint: leave out the checkpoint or the tolerance");
  refused({"--tolerance", "0.1x"}, "expected a number above 0, or a percentage, found '0.1x'");
  for (const char* option : {"--blend-width=0.1", "--max-bytes=1e6", "--max-error=0.1", "--bounds", "--tolerance=1%"})
    expectRefused({{"study", "continuity", "builtin:torus", "-o", at("study"), option}}, "not for 'study continuity'");
  for (const char* option :
       {"--near-error=0.1", "--max-bytes=1e6", "--max-error=0.1", "--bounds", "--criterion=optimal", "--tolerance=1%"})
    expectRefused({{"study", "convergence", "builtin:torus", "-o", at("study"), option}},
                  "not for 'study convergence'");
}

TEST_F(BuildCommand, warnsOfADomainBesideTheSurface) {
  const auto build = [&](const std::string& domain) {
    return run({{"build", "analytic:sphere", "-o", at("f.hpsdf"), "--domain", domain, "--target-error", "1e-2"}}).err;
  };
  EXPECT_THAT(build("5,5,5,6,6,6"), HasSubstr("warning: the domain leaves out the whole surface"));
  EXPECT_THAT(build("0,-2,-2,2,2,2"), HasSubstr("warning: the domain leaves out part of the surface"));
  EXPECT_THAT(build("-2,-2,-2,2,2,2"), Not(HasSubstr("warning")));
}

TEST_F(BuildCommand, aMeshThatIsNormalizedAlreadyStaysAsItIs) {
  // The coordinates 0.3 and 0.7 would be rounded differently by a scale about a centre.
  writeFile(at("mesh.off"),
            "OFF\n4 4 0\n-1 -1 -1\n1 0.3 0.7\n0.3 1 -0.1\n0.7 0.1 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
  ASSERT_EQ(run({{"build", at("mesh.off"), "-o", at("f.hpsdf"), "--normalize", "--tolerance", "5%"}}).status, 0);
  const Outcome outcome = run({{"verify", at("f.hpsdf"), "--points", "1000"}});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
}

TEST_F(BuildCommand, normalizationIsRemembered) {
  writeFile(at("mesh.off"), "OFF\n4 4 0\n10 0 0\n14 0 0\n10 2 0\n10 0 2\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
  ASSERT_EQ(run({{"build", at("mesh.off"), "-o", at("f.hpsdf"), "--normalize", "--target-error", "1e-3"}}).status, 0);
  const auto json = nlohmann::json::parse(run({{"info", at("f.hpsdf"), "--json"}}).out);
  EXPECT_EQ(json["normalization"]["scale"], 0.5);
  EXPECT_EQ(json["normalization"]["center"], nlohmann::json({12.0, 1.0, 1.0}));
  EXPECT_THAT(run({{"info", at("f.hpsdf")}}).out, HasSubstr("field = 0.5 · (mesh − (12, 1, 1))"));
}

}  // namespace cli_build_test
}  // namespace hpsdf::app
