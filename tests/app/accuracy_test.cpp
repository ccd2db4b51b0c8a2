// Tests the errors that `verify` and `study` report.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "commands/commands.h"
#include "files/other_program.h"
#include "files/text_file.h"
#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/render/image.h"
#include "hpsdf/shapes.h"
#include "language/script.h"
#include "outcome.h"
#include "session/session.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace accuracy_test {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kMesh = "builtin:torus,segments=48,sides=24";

/// Writes the field of a torus with `offset` added to the constant coefficient of every cell.
void writeField(const fs::path& file, double offset) {
  const TriangleMesh mesh = shapes::mesh(kMesh);
  const ExactDistance exact(mesh);
  const BuildOptions options{.targetError = 1e-4, .strategy = Strategy::hp, .coefficients = CoefficientType::float64};
  FieldData data = build(exact, domainAround(mesh), options).data();
  auto& coefficients = std::get<FieldArray<double>>(data.coefficients).values();
  for (const std::uint64_t node : data.nodes)
    if (node::isLeaf(node)) coefficients[node::offset(node)] += offset;
  save(Field(std::move(data)), file);
}

class Accuracy : public testing::Test {
 protected:
  std::string at(const std::string& name) const { return (folder_ / name).string(); }

  Json verified(std::vector<std::string> words) const {
    words.insert(words.begin(), "verify");
    words.insert(words.end(), {"--points", "20000", "--json"});
    const Outcome outcome = runHere(words);
    EXPECT_EQ(outcome.status, kExitDone) << outcome.err;
    return Json::parse(outcome.out);
  }

  support::TemporaryDirectory folder_;
};

TEST_F(Accuracy, anOffsetShowsAsTheError) {
  writeField(at("right.hpsdf"), 0);
  writeField(at("wrong.hpsdf"), 0.25);
  const Json right = verified({at("right.hpsdf")}), wrong = verified({at("wrong.hpsdf"), kMesh});
  EXPECT_LT(right["uniform"]["error"]["max"], 0.1);
  EXPECT_NEAR(wrong["uniform"]["error"]["rms"], 0.25, 0.01);
  EXPECT_NEAR(wrong["uniform"]["error"]["mean"], 0.25, 0.01);
  EXPECT_NEAR(wrong["near_surface"]["error"]["percentiles"]["50"], 0.25, 0.02);
  EXPECT_EQ(wrong["uniform"]["points"], 10000);
  EXPECT_NEAR(wrong["near"], 0.02, 1e-4);
  EXPECT_NEAR(wrong["jumps"]["value_max"], right["jumps"]["value_max"], 1e-12);
  EXPECT_GT(wrong["near_surface"]["signs"]["mismatches"], 4000);
  ASSERT_EQ(wrong["worst"].size(), 10u);
  for (const Json& point : wrong["worst"]) EXPECT_GE(point["error"], 0.25);
  EXPECT_EQ(wrong["thresholds"].size(), 0u);
}

TEST_F(Accuracy, anExceededThresholdEndsWithStatus1AndSaysWhich) {
  writeField(at("f.hpsdf"), 0.01);
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"verify", at("f.hpsdf"), "--points", "20000"};
    words.insert(words.end(), more.begin(), more.end());
    return runHere(words);
  };
  const Outcome good =
      with({"--max-rms", "0.02", "--max-near-rms", "0.02", "--max-error", "0.2", "--max-mismatches", "0", "--max-angle",
            "90", "--max-slope", "5", "--max-jump", "1", "--max-step", "1", "--max-gradient-step", "5"});
  EXPECT_EQ(good.status, kExitDone) << good.err;
  EXPECT_THAT(good.out, HasSubstr("RMS error"));
  const std::vector<std::pair<std::vector<std::string>, std::string>> exceeded = {
      {{"--max-rms", "1e-3"}, "the RMS error over uniform points is"},
      {{"--max-near-rms", "1e-3"}, "the RMS error near the surface is"},
      {{"--max-error", "1e-3"}, "the greatest error is"},
      {{"--max-mismatches", "0", "--sign-bound", "1e-6"}, "the number of wrong signs beyond the sign bound is"},
      {{"--max-angle", "1e-3"}, "the angle between gradients near the surface is"},
      {{"--max-slope", "0.5"}, "the greatest slope is"},
      {{"--max-jump", "1e-9"}, "the greatest jump of the value is"},
      {{"--max-step", "1e-12"}, "the greatest step of the value across a face, of the domain's diagonal, is"},
      {{"--max-gradient-step", "1e-9"}, "the greatest step of the gradient across a face is"}};
  for (const auto& [words, message] : exceeded) {
    const Outcome outcome = with(words);
    EXPECT_EQ(outcome.status, kExitFailed) << message;
    EXPECT_THAT(outcome.err, AllOf(HasSubstr(message), HasSubstr("above " + words[0].substr(2) + "=")));
    EXPECT_THAT(outcome.out, AllOf(HasSubstr("RMS error"), HasSubstr("depth  cell"))) << "all figures are written";
  }
  const Outcome both = with({"--max-rms", "1e-3", "--max-jump", "1e-9", "--json"});
  EXPECT_EQ(both.status, kExitFailed);
  EXPECT_THAT(both.err, HasSubstr("; the greatest jump"));
  EXPECT_EQ(Json::parse(both.out)["thresholds"][1]["holds"], false);
  EXPECT_EQ(with({"--max-rms", "x"}).status, kExitBadInput);
  EXPECT_THAT(with({"--near", "1e30"}).err, HasSubstr("or near means too far"));
}

TEST_F(Accuracy, nothingStepsAcrossTheFacesOfABlendedField) {
  writeField(at("f.hpsdf"), 0);
  ASSERT_EQ(runHere({"blend", at("f.hpsdf"), "-o", at("b.hpsdf")}).status, kExitDone);
  const Json alone = verified({at("f.hpsdf")})["steps"];
  EXPECT_EQ(alone["points"], 20000);
  EXPECT_GT(alone["value"], 1e-3);
  EXPECT_GT(alone["gradient"], 1e-2);
  EXPECT_NEAR(alone["value_of_diagonal"].get<double>() * load(at("f.hpsdf")).domain().diagonal().norm(), alone["value"],
              1e-12);
  const Json blended = verified({at("b.hpsdf"), "--max-step", "1e-12", "--max-gradient-step", "1e-9"});
  EXPECT_TRUE(blended["thresholds"][0]["holds"]);
  EXPECT_TRUE(blended["thresholds"][1]["holds"]);
  EXPECT_THAT(runHere({"verify", at("b.hpsdf"), "--points", "20000"}).out,
              AllOf(HasSubstr("greatest steps across faces"), HasSubstr("20,000 points")));
}

/// A listener that cancels the work as soon as the given task is reported.
struct Canceller : WorkListener {
  explicit Canceller(std::string task) : task_(std::move(task)) {}
  void report(std::string_view task, double) override { heard_ = heard_ || task == task_; }
  bool wantsCancel() override { return heard_; }
  void ended() override {}

 private:
  std::string task_;
  std::atomic<bool> heard_ = false;
};

TEST_F(Accuracy, cancelledBoundsLeaveWhatWasThere) {
  writeField(at("f.hpsdf"), 0);
  writeTextFile(at("old.hpsdf"), "old");
  Canceller canceller("finding bounds");
  std::istringstream in;
  std::ostringstream out, err;
  const std::vector<std::string> words = {"bounds", at("f.hpsdf"), "-o", at("old.hpsdf")};
  EXPECT_EQ(runProgram(words, Console{in, out, err, false, &canceller}), kExitCancelled);
  EXPECT_THAT(out.str(), IsEmpty());
  EXPECT_THAT(err.str(), HasSubstr("nothing is half-written"));
  EXPECT_EQ(readTextFile(at("old.hpsdf")), "old");
  EXPECT_FALSE(fs::exists(at("old.hpsdf.tmp")));
}

TEST_F(Accuracy, aDifferentMeshIsRefusedUnlessAskedFor) {
  writeField(at("f.hpsdf"), 0);
  const Outcome other = runHere({"verify", at("f.hpsdf"), "builtin:gear"});
  EXPECT_EQ(other.status, kExitBadInput);
  EXPECT_THAT(other.out, IsEmpty());
  EXPECT_THAT(other.err, AllOf(HasSubstr(kMesh), HasSubstr("not from builtin:gear"), HasSubstr("--any-mesh")));
  EXPECT_EQ(runHere({"verify", at("f.hpsdf"), "analytic:torus", "--points", "1000"}).status, kExitBadInput);
  const Json figures = verified({at("f.hpsdf"), "analytic:torus", "--any-mesh"});
  EXPECT_LT(figures["uniform"]["error"]["rms"], 0.01);
  EXPECT_LT(figures["near_surface"]["gradient"]["mean_angle"], 10);
  EXPECT_GT(verified({at("f.hpsdf"), "builtin:gear", "--any-mesh"})["uniform"]["error"]["rms"], 0.03);
}

TEST_F(Accuracy, aMeshThatIsNotKnownIsAskedFor) {
  std::ofstream(at("t.off")) << "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  ASSERT_EQ(runHere({"build", at("t.off"), "-o", at("t.hpsdf"), "--target-error", "1e-2", "--grid", "2"}).status, 0);
  std::filesystem::create_directory(at("alone"));
  std::filesystem::copy(at("t.hpsdf"), at("alone"));
  EXPECT_THAT(runHere({"verify", at("alone/t.hpsdf")}).err, HasSubstr("give MESH, t.off"));
  EXPECT_EQ(runHere({"verify", at("t.hpsdf"), "--points", "1000"}).status, kExitDone) << "the mesh lies beside it";
  EXPECT_EQ(runHere({"verify", at("t.hpsdf"), at("t.off"), "--points", "1000"}).status, kExitDone);
  // A field of a normalized mesh is compared with the normalized mesh.
  ASSERT_EQ(runHere({"build", at("t.off"), "-o", at("n.hpsdf"), "--target-error", "1e-2", "--grid", "2", "--normalize"})
                .status,
            0);
  EXPECT_LT(verified({at("n.hpsdf"), at("t.off")})["uniform"]["error"]["rms"], 0.1);
}

TEST_F(Accuracy, theSameSeedGivesTheSameBytesForAnyNumberOfThreads) {
  writeField(at("f.hpsdf"), 0);
  const Json one = verified({at("f.hpsdf"), "--threads", "1"}), three = verified({at("f.hpsdf"), "--threads", "3"});
  EXPECT_EQ(one.dump(), three.dump());
  EXPECT_NE(one["worst"], verified({at("f.hpsdf"), "--seed", "2"})["worst"]);
  const Json band = verified({at("f.hpsdf"), "--band", "0.01"});
  EXPECT_EQ(band["near"], 0.01);
  EXPECT_NE(band["uniform"], one["uniform"]);
}

TEST_F(Accuracy, theScriptFliesToTheWorstPoints) {
  writeField(at("f.hpsdf"), 0);
  const Outcome outcome =
      runHere({"verify", at("f.hpsdf"), "--points", "20000", "--worst", "2", "--script", at("worst.hps"), "--json"});
  const Json point = Json::parse(outcome.out)["worst"][1]["position"];
  const std::string script = readTextFile(at("worst.hps"));
  EXPECT_THAT(script, AllOf(HasSubstr("load " + at("f.hpsdf")), HasSubstr("shot output=worst-2.png")));
  std::string found;
  std::istringstream lines(script);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("fly to=")) found = line.substr(7);
  std::istringstream numbers(found);
  for (int axis = 0; axis < 3; ++axis) {
    std::string number;
    std::getline(numbers, number, ',');
    EXPECT_EQ(std::stod(number), point[axis].get<double>());
  }
  // The script's lines run without errors; lines that save pictures are omitted here.
  std::string lookOnly;
  for (std::istringstream all(script); std::getline(all, found);)
    if (!found.starts_with("shot")) lookOnly += found + "\n";
  writeTextFile(at("look.hps"), lookOnly + "copy-view\n");
  const Outcome looked = runHere({"run", at("look.hps")});
  EXPECT_EQ(looked.status, kExitDone) << looked.err;
  EXPECT_THAT(looked.out, HasSubstr("zoom="));
}

std::vector<std::vector<std::string>> rowsOf(const std::string& csv) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

TEST_F(Accuracy, convergenceOfATorusFallsAndHpIsAhead) {
  const std::vector<std::string> words = {"study",   "convergence", "analytic:torus", "-o",
                                          at("out"), "--json",      "--no-plot",      "--max-coefficients",
                                          "60000",   "--points",    "20000"};
  const Outcome outcome = runHere(words);
  ASSERT_EQ(outcome.status, kExitDone) << outcome.err;
  const Json json = Json::parse(outcome.out);
  const auto rows = rowsOf(readTextFile(at("out/convergence.csv")));
  EXPECT_EQ(rows[0], (std::vector<std::string>{"mesh", "strategy", "steps", "leaves", "coefficients", "estimated_rms",
                                               "measured_rms", "measured_max"}));
  std::map<std::string, std::vector<std::vector<std::string>>> curves;
  for (std::size_t n = 1; n < rows.size(); ++n) curves[rows[n][1]].push_back(rows[n]);
  ASSERT_EQ(curves.size(), 3u);
  for (const auto& [strategy, curve] : curves) {
    EXPECT_GE(curve.size(), 8u) << strategy;
    EXPECT_EQ(curve[0][0], "torus");
    EXPECT_EQ(curve[0][2], "0");
    for (std::size_t n = 1; n < curve.size(); ++n) {
      const double growth = std::stod(curve[n][4]) / std::stod(curve[n - 1][4]);
      EXPECT_GT(growth, 1.25) << strategy;
      EXPECT_LT(growth, 1.6) << strategy;
      EXPECT_LT(std::stod(curve[n][5]), std::stod(curve[n - 1][5])) << strategy;
      EXPECT_LT(std::stod(curve[n][6]), 1.01 * std::stod(curve[n - 1][6])) << strategy;
      EXPECT_GE(std::stod(curve[n][7]), std::stod(curve[n][6])) << strategy;
    }
    EXPECT_LE(std::stod(curve.back()[4]), 60000) << strategy;
    EXPECT_GT(std::stod(curve.back()[4]), 30000) << strategy;
  }
  const Json& equal = json["meshes"][0]["equal_error"];
  EXPECT_EQ(equal["hp"]["over_hp"], 1);
  EXPECT_GT(equal["h2"]["over_hp"], 1);
  EXPECT_GT(equal["h1"]["over_hp"], equal["h2"]["over_hp"].get<double>());
  EXPECT_LT(2 * std::stod(curves["hp"].back()[6]), std::stod(curves["h2"].back()[6]));
  // By default the strategies are compared at the smallest error that all of them reach.
  EXPECT_NEAR(equal["measured_rms"], std::stod(curves["h1"].back()[6]), 1e-12);
  EXPECT_EQ(json["meshes"][0]["curves"]["h1"].size(), curves["h1"].size());
  EXPECT_EQ(Json::parse(readTextFile(at("out/convergence.json"))), json);
  EXPECT_FALSE(fs::exists(at("out/convergence-torus.png")));

  std::vector<std::string> again = words;
  again[4] = at("again");
  again.insert(again.end(), {"--threads", "1"});
  EXPECT_EQ(runHere(again).status, kExitDone);
  EXPECT_EQ(readTextFile(at("again/convergence.csv")), readTextFile(at("out/convergence.csv")));
}

TEST_F(Accuracy, tablesHaveNoEstimateWithinATolerance) {
  const Outcome outcome = runHere({"study", "table", "builtin:box", "-o", at("out"), "--tolerance", "5%", "--grid", "2",
                                   "--points", "1000", "--cpu"});
  ASSERT_EQ(outcome.status, kExitDone) << outcome.err;
  EXPECT_THAT(outcome.out, testing::ContainsRegex("weighted estimate \\(τ\\) –"));
  EXPECT_THAT(readTextFile(at("out/index.html")), HasSubstr("<td class=\"figure\">–</td>"));
  const Json row = Json::parse(readTextFile(at("out/table.json")))["meshes"][0];
  EXPECT_TRUE(row.at("estimated_rms").is_null());
  EXPECT_TRUE(row.at("target_error").is_null());
  EXPECT_GT(row.at("tolerance"), 0);
}

TEST_F(Accuracy, convergenceNamesTheWeightedEstimate) {
  const Outcome outcome = runHere({"study", "convergence", "analytic:torus", "-o", at("out"), "--no-plot",
                                   "--max-coefficients", "5000", "--points", "1000"});
  ASSERT_EQ(outcome.status, kExitDone) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("weighted estimate  measured RMS"));
}

/// The default limit of the memory belongs to constructions that a target error ends.
TEST_F(Accuracy, convergenceIsLimitedByItsCoefficientsAlone) {
  const std::vector<std::string> words = {"study",    "convergence", "analytic:torus",     "-o",
                                          at("out"),  "--no-plot",   "--points",           "1000",
                                          "--stages", "1",           "--max-coefficients", "1800000"};
  const Outcome outcome = runHere(words);
  EXPECT_EQ(outcome.status, kExitDone) << outcome.err;
  std::vector<std::string> limited = words;
  limited.insert(limited.end(), {"--memory-limit", "1e6"});
  EXPECT_EQ(runHere(limited).status, kExitBadInput);
}

/// The curves are the same for a torus of any size.
TEST_F(Accuracy, convergenceOfASmallTorusIsThatOfALargeOne) {
  const auto curves = [&](const std::string& torus) {
    const Outcome outcome = runHere({"study", "convergence", torus, "-o", at("out"), "--no-plot", "--max-coefficients",
                                     "10000", "--points", "1000", "--json"});
    if (outcome.status != kExitDone) throw std::runtime_error(outcome.err);
    return Json::parse(outcome.out)["meshes"][0]["curves"];
  };
  const Json small = curves("analytic:torus,major=0.125,minor=0.03125");
  const Json large = curves("analytic:torus,major=4,minor=1");
  ASSERT_EQ(small["hp"].size(), large["hp"].size());
  for (std::size_t n = 0; n < small["hp"].size(); ++n) {
    const double rms = large["hp"][n]["measured_rms"];
    EXPECT_EQ(small["hp"][n]["coefficients"], large["hp"][n]["coefficients"]);
    EXPECT_NEAR(small["hp"][n]["measured_rms"], rms, 1e-6 * rms);
  }
}

TEST_F(Accuracy, convergenceComparesAtTheErrorThatIsAskedFor) {
  const auto comparison = [&](const std::string& at) {
    const Outcome outcome = runHere({"study", "convergence", "analytic:torus", "-o", this->at("out"), "--no-plot",
                                     "--max-coefficients", "30000", "--points", "5000", "--json", "--at", at});
    EXPECT_EQ(outcome.status, kExitDone) << outcome.err;
    return Json::parse(outcome.out)["meshes"][0];
  };
  const Json mesh = comparison("1e-3");
  const Json& hp = mesh["curves"]["hp"];
  const auto after = std::ranges::find_if(hp, [](const Json& stage) { return stage["measured_rms"] <= 1e-3; });
  ASSERT_NE(after, hp.end());
  EXPECT_LE(mesh["equal_error"]["hp"]["coefficients"], (*after)["coefficients"].get<double>());
  EXPECT_GT(mesh["equal_error"]["hp"]["coefficients"], (*(after - 1))["coefficients"].get<double>());
  EXPECT_TRUE(mesh["equal_error"]["h1"]["coefficients"].is_null()) << "out of reach";
}

TEST_F(Accuracy, convergenceIsDrawnByGnuplot) {
  const char* path = std::getenv("PATH");
  const std::string before = path == nullptr ? "" : path;
  const auto study = [&](const std::string& program) {
    fs::create_directories(at("bin"));
    if (!program.empty()) {
      writeTextFile(at("bin/gnuplot"), "#!/bin/sh\n" + program);
      fs::permissions(at("bin/gnuplot"), fs::perms::owner_all);
    }
    setenv("PATH", at("bin").c_str(), 1);
    const Outcome outcome = runHere({"study", "convergence", "analytic:torus", "-o", at("plots"), "--max-coefficients",
                                     "5000", "--points", "1000"});
    setenv("PATH", before.c_str(), 1);
    return outcome;
  };
  const Outcome none = study("");
  EXPECT_EQ(none.status, kExitBadInput);
  EXPECT_THAT(none.err, HasSubstr("install the package gnuplot-nox, or give --no-plot"));
  const Outcome broken = study("echo 'no such terminal' ; exit 3\n");
  EXPECT_THAT(broken.err, HasSubstr("gnuplot failed with status 3 (no such terminal)"));
  EXPECT_FALSE(fs::exists(at("plots"))) << "nothing is left behind";
  // The gnuplot script sets scales and labels and draws a curve for each strategy and error measure.
  const Outcome drawn = study("while read -r line; do echo \"$line\"; done < plot.gp > plot.png\n");
  ASSERT_EQ(drawn.status, kExitDone) << drawn.err;
  const std::string script = readTextFile(at("plots/convergence-torus.png"));
  EXPECT_THAT(script, AllOf(HasSubstr("set logscale xy"), HasSubstr("set xlabel"), HasSubstr("set ylabel"),
                            HasSubstr("hp, measured RMS"), HasSubstr("h1, measured maximum")));
}

TEST_F(Accuracy, gnuplotTakesWhatItIsTold) {
  if (!findProgram("gnuplot")) GTEST_SKIP() << "gnuplot is not installed (package gnuplot-nox)";
  const Outcome outcome = runHere(
      {"study", "convergence", "analytic:torus", "-o", at("plots"), "--max-coefficients", "5000", "--points", "1000"});
  ASSERT_EQ(outcome.status, kExitDone) << outcome.err;
  const render::Image picture = render::loadPng(at("plots/convergence-torus.png"));
  EXPECT_EQ(picture.width, 900);
  EXPECT_EQ(picture.height, 560);
}

TEST_F(Accuracy, aStudyIsWrittenWholeOrNotAtAll) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> studies = {
      {{"convergence", "--no-plot", "--max-coefficients", "3000"}, "convergence.json"},
      {{"table", "--cpu", "--target-error", "1e-1", "--grid", "2"}, "table.json"},
      {{"continuity", "--target-error", "1e-1", "--grid", "2", "--weights", "1"}, "continuity.json"}};
  for (const auto& [options, late] : studies) {
    fs::create_directories(at("out/" + late));  // a folder prevents one of the last files from being written
    std::vector<std::string> words = {"study"};
    words.insert(words.end(), options.begin(), options.end());
    words.insert(words.end(), {"analytic:sphere", "-o", at("out"), "--points", "1000"});
    const Outcome outcome = runHere(words);
    EXPECT_EQ(outcome.status, kExitBadInput) << options[0];
    EXPECT_THAT(outcome.err, HasSubstr(late + ": is a folder"));
    std::vector<std::string> left;
    for (const auto& entry : fs::directory_iterator(at("out"))) left.push_back(entry.path().filename().string());
    EXPECT_EQ(left, std::vector{late});
    fs::remove_all(at("out"));
  }
}

TEST_F(Accuracy, aFieldInAnotherFormKeepsItsSurface) {
  std::ofstream(at("t.off")) << "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  const Registry registry = makeRegistry();
  for (const char* verb : {"blend", "smooth"}) {
    std::istringstream in;
    std::ostringstream out, err;
    Session session(registry, Console{in, out, err});
    const auto run = [&](const std::string& line) { runScript(session, parseScript(registry, "test", line, {})); };
    run("build " + at("t.off") + " target-error=1e-2 grid=2");
    const DistanceFunction* surface = &session.exact("");
    run(verb);
    EXPECT_EQ(&session.exact(""), surface) << verb << ": it would be read anew";
  }
}

TEST_F(Accuracy, theTableIsWrittenThreeWays) {
  const Outcome outcome = runHere({"study", "table", kMesh, "builtin:torus,segments=20,sides=10", "analytic:box", "-o",
                                   at("out"), "--cpu", "--target-error", "1e-3", "--target-error", "1e-2",
                                   "--target-error", "1e-1", "--grid", "4", "--points", "5000", "--json"});
  ASSERT_EQ(outcome.status, kExitDone) << outcome.err;
  const Json json = Json::parse(outcome.out), file = Json::parse(readTextFile(at("out/table.json")));
  EXPECT_EQ(file["meshes"], json["meshes"]);
  ASSERT_EQ(json["meshes"].size(), 3u);
  const Json& torus = json["meshes"][0];
  EXPECT_EQ(torus["name"], "torus");
  EXPECT_EQ(torus["faces"], 2 * 48 * 24);
  EXPECT_EQ(torus["target_error"], 1e-3);
  EXPECT_EQ(json["meshes"][1]["name"], "torus-2");
  EXPECT_EQ(json["meshes"][1]["target_error"], 1e-2);
  for (const Json& mesh : json["meshes"]) {
    EXPECT_EQ(mesh["grid"], Json({4, 4, 4}));
    double volume = 0;
    for (const auto& [level, share] : mesh["degree_volume"].items()) volume += share.get<double>();
    EXPECT_NEAR(volume, 1, 1e-12);
    EXPECT_GT(mesh["measured_rms"], 0);
    EXPECT_GE(mesh["measured_max"], mesh["measured_rms"].get<double>());
  }
  const std::string page = readTextFile(at("out/index.html")), table = readTextFile(at("out/table.md"));
  EXPECT_THAT(page, AllOf(HasSubstr("<td>torus-2</td>"), HasSubstr("data:image/png;base64,"), HasSubstr("<svg"),
                          testing::Not(HasSubstr("src=\"http")), testing::Not(HasSubstr("src=\"torus"))));
  EXPECT_THAT(table, AllOf(HasSubstr("| torus | 1,152 | 2,304 | 4³ |"), HasSubstr("| weighted estimate (τ) |"),
                           HasSubstr("![degrees](torus-2-degree.svg)"), HasSubstr("Degree ![](degree-legend.svg)"),
                           HasSubstr("Depth ![](depth-legend.svg)")));
  // Every row of the table has as many cells as the header row.
  const auto count = [](const std::string& text, const std::string& what) {
    std::size_t found = 0;
    for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count(page, "<td"), 3 * count(page, "<th"));
  EXPECT_EQ(count(page, "<td>"), count(page, "</td>") - count(page, "<td class=\"figure\">"));
  EXPECT_THAT(page, testing::Not(HasSubstr("<th></th>")));
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line) && !line.empty();)
    EXPECT_EQ(std::ranges::count(line, '|'), 16) << line;
  // The legend lists all degrees, in the colours of the bars.
  const std::string legend = readTextFile(at("out/degree-legend.svg"));
  std::set<std::string> levels;
  for (const Json& mesh : json["meshes"])
    for (const auto& [level, share] : mesh["degree_volume"].items()) {
      levels.insert(level);
      EXPECT_THAT(legend, HasSubstr("<title>" + level + "</title>"));
    }
  EXPECT_EQ(count(legend, "<rect"), levels.size());
  EXPECT_THAT(page, HasSubstr(legend));
  for (const char* name : {"torus", "torus-2", "box"})
    for (const char* ending : {"-degree.png", "-depth.png", "-degree.svg", "-depth.svg"})
      EXPECT_GT(fs::file_size(at(std::string("out/") + name + ending)), 100u) << name << ending;
  // The parts of a bar are as long as each degree's share of the volume and have the legend's colours.
  const std::string bar = readTextFile(at("out/torus-degree.svg"));
  EXPECT_EQ(std::size_t(std::ranges::count(bar, '%')), torus["degree_volume"].size());
}

TEST_F(Accuracy, mistakesInStudiesAreNamedBeforeLongWork) {
  const auto refused = [&](const std::vector<std::string>& words, const std::string& message) {
    std::vector<std::string> all = {"study"};
    all.insert(all.end(), words.begin(), words.end());
    all.insert(all.end(), {"-o", at("out")});
    const Outcome outcome = runHere(all);
    EXPECT_EQ(outcome.status, kExitBadInput);
    EXPECT_THAT(outcome.err, HasSubstr(message));
    EXPECT_FALSE(fs::exists(at("out")));
  };
  refused({"convergance", "builtin:torus"}, "did you mean 'convergence'?");
  refused({"table", "builtin:torus", "--at", "1e-3"}, "at: is for 'study convergence', not for 'study table'");
  refused({"convergence", "builtin:torus", "--target-error", "1e-3"}, "target-error: is for 'study table'");
  refused({"table", "builtin:torus", "--grid", "4", "--grid", "5"}, "grid: given 2 times for 1 meshes");
  refused({"table", "none.obj"}, "none.obj");
  refused({"convergence", "analytic:torus", "--no-plot", "--max-coefficients", "200"},
          "max-coefficients: the base cells of");
}

}  // namespace accuracy_test
}  // namespace hpsdf::app
