// verify and study: how wrong fields are, as the program's user is told.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/shapes.h"
#include "program.h"
#include "script.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

struct Outcome {
  int status;
  std::string out, err;
};

Outcome run(const std::vector<std::string>& words) {
  std::istringstream in;
  std::ostringstream out, err;
  const int status = runProgram(words, Console{in, out, err});
  return {status, out.str(), err.str()};
}

constexpr const char* kMesh = "builtin:torus,segments=48,sides=24";

/// A torus's field, each cell's constant raised by `offset`.
void writeField(const fs::path& file, double offset) {
  const TriangleMesh mesh = shapes::mesh(kMesh);
  const ExactDistance exact(mesh);
  FieldData data =
      build(exact, domainAround(mesh), {.targetError = 1e-4, .coefficients = CoefficientType::float64}).data();
  auto& coefficients = std::get<std::vector<double>>(data.coefficients);
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
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.status, kExitDone) << outcome.err;
    return Json::parse(outcome.out);
  }

  support::TemporaryDirectory folder_;
};

TEST_F(Accuracy, AnOffsetShowsAsTheError) {
  writeField(at("right.hpsdf"), 0);
  writeField(at("wrong.hpsdf"), 0.25);
  const Json right = verified({at("right.hpsdf")}), wrong = verified({at("wrong.hpsdf"), kMesh});
  EXPECT_LT(right["uniform"]["error"]["max"], 0.1);
  EXPECT_NEAR(wrong["uniform"]["error"]["rms"], 0.25, 0.01);
  EXPECT_NEAR(wrong["uniform"]["error"]["mean"], 0.25, 0.01);
  EXPECT_NEAR(wrong["near_surface"]["error"]["percentiles"]["50"], 0.25, 0.02);
  EXPECT_EQ(wrong["uniform"]["points"], 10000);
  EXPECT_NEAR(wrong["near"], 0.02, 1e-4);
  EXPECT_EQ(wrong["jumps"]["value_max"], right["jumps"]["value_max"]);
  EXPECT_GT(wrong["near_surface"]["signs"]["mismatches"], 4000);
  ASSERT_EQ(wrong["worst"].size(), 10u);
  for (const Json& point : wrong["worst"]) EXPECT_GE(point["error"], 0.25);
  EXPECT_EQ(wrong["thresholds"].size(), 0u);
}

TEST_F(Accuracy, AnExceededThresholdEndsWithStatus1AndSaysWhich) {
  writeField(at("f.hpsdf"), 0.01);
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"verify", at("f.hpsdf"), "--points", "20000"};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  };
  const Outcome good = with({"--max-rms", "0.02", "--max-near-rms", "0.02", "--max-error", "0.2", "--max-mismatches",
                             "0", "--max-angle", "90", "--max-slope", "5", "--max-jump", "1"});
  EXPECT_EQ(good.status, kExitDone) << good.err;
  EXPECT_THAT(good.out, HasSubstr("RMS error"));
  const std::vector<std::pair<std::vector<std::string>, std::string>> exceeded = {
      {{"--max-rms", "1e-3"}, "the RMS error over uniform points is"},
      {{"--max-near-rms", "1e-3"}, "the RMS error near the surface is"},
      {{"--max-error", "1e-3"}, "the greatest error is"},
      {{"--max-mismatches", "0", "--sign-bound", "1e-6"}, "the number of wrong signs beyond the sign bound is"},
      {{"--max-angle", "1e-3"}, "the angle between gradients near the surface is"},
      {{"--max-slope", "0.5"}, "the greatest slope is"},
      {{"--max-jump", "1e-9"}, "the greatest jump of the value is"}};
  for (const auto& [words, message] : exceeded) {
    const Outcome outcome = with(words);
    EXPECT_EQ(outcome.status, kExitFailed) << message;
    EXPECT_THAT(outcome.err, AllOf(HasSubstr(message), HasSubstr("above " + words[0].substr(2) + "=")));
    EXPECT_EQ(outcome.out, with({}).out.substr(0, outcome.out.size())) << "the figures are written all the same";
  }
  const Outcome both = with({"--max-rms", "1e-3", "--max-jump", "1e-9", "--json"});
  EXPECT_EQ(both.status, kExitFailed);
  EXPECT_THAT(both.err, HasSubstr("; the greatest jump"));
  EXPECT_EQ(Json::parse(both.out)["thresholds"][1]["holds"], false);
  EXPECT_EQ(with({"--max-rms", "x"}).status, kExitBadInput);
}

TEST_F(Accuracy, ADifferentMeshIsRefusedUnlessAskedFor) {
  writeField(at("f.hpsdf"), 0);
  const Outcome other = run({"verify", at("f.hpsdf"), "builtin:gear"});
  EXPECT_EQ(other.status, kExitBadInput);
  EXPECT_THAT(other.out, IsEmpty());
  EXPECT_THAT(other.err, AllOf(HasSubstr(kMesh), HasSubstr("not from builtin:gear"), HasSubstr("--any-mesh")));
  EXPECT_EQ(run({"verify", at("f.hpsdf"), "analytic:torus", "--points", "1000"}).status, kExitBadInput);
  const Json figures = verified({at("f.hpsdf"), "analytic:torus", "--any-mesh"});
  EXPECT_LT(figures["uniform"]["error"]["rms"], 0.01);
  EXPECT_LT(figures["near_surface"]["gradient"]["mean_angle"], 10);
  EXPECT_GT(verified({at("f.hpsdf"), "builtin:gear", "--any-mesh"})["uniform"]["error"]["rms"], 0.1);
}

TEST_F(Accuracy, AMeshThatIsNotKnownIsAskedFor) {
  std::ofstream(at("t.off")) << "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  ASSERT_EQ(run({"build", at("t.off"), "-o", at("t.hpsdf"), "--target-error", "1e-2", "--grid", "2"}).status, 0);
  EXPECT_THAT(run({"verify", at("t.hpsdf")}).err, HasSubstr("give MESH, t.off"));
  EXPECT_EQ(run({"verify", at("t.hpsdf"), at("t.off"), "--points", "1000"}).status, kExitDone);
  // a normalized field is measured against the mesh as it was normalized
  ASSERT_EQ(
      run({"build", at("t.off"), "-o", at("n.hpsdf"), "--target-error", "1e-2", "--grid", "2", "--normalize"}).status,
      0);
  EXPECT_LT(verified({at("n.hpsdf"), at("t.off")})["uniform"]["error"]["rms"], 0.1);
}

TEST_F(Accuracy, TheSameSeedGivesTheSameBytesForAnyNumberOfThreads) {
  writeField(at("f.hpsdf"), 0);
  const Json one = verified({at("f.hpsdf"), "--threads", "1"}), three = verified({at("f.hpsdf"), "--threads", "3"});
  EXPECT_EQ(one.dump(), three.dump());
  EXPECT_NE(one["worst"], verified({at("f.hpsdf"), "--seed", "2"})["worst"]);
  const Json band = verified({at("f.hpsdf"), "--band", "0.01"});
  EXPECT_EQ(band["near"], 0.01);
  EXPECT_NE(band["uniform"], one["uniform"]);
}

TEST_F(Accuracy, TheScriptFliesToTheWorstPoints) {
  writeField(at("f.hpsdf"), 0);
  const Outcome outcome =
      run({"verify", at("f.hpsdf"), "--points", "20000", "--worst", "2", "--script", at("worst.hps"), "--json"});
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
  // the lines run, but for the pictures
  std::string lookOnly;
  for (std::istringstream all(script); std::getline(all, found);)
    if (!found.starts_with("shot")) lookOnly += found + "\n";
  writeTextFile(at("look.hps"), lookOnly + "copy-view\n");
  const Outcome looked = run({"run", at("look.hps")});
  EXPECT_EQ(looked.status, kExitDone) << looked.err;
  EXPECT_THAT(looked.out, HasSubstr("zoom="));
}

}  // namespace
}  // namespace hpsdf::app
