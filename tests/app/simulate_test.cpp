// The scenes of `simulate`, in small.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "outcome.h"
#include "simulate/scene_request.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace {

using Json = nlohmann::ordered_json;
using testing::HasSubstr;

std::vector<std::string> inSmall(const std::string& scene, const std::string& cache) {
  std::vector<std::string> words = {"simulate", scene, "--target-error", "1e-4", "--cache", cache};
  const auto add = [&](const std::vector<std::string>& more) { words.insert(words.end(), more.begin(), more.end()); };
  if (scene == "bowl")
    add({"--ground", "builtin:structured-bowl,cells=24,bumps=4", "--bodies", "20", "--seconds", "3"});
  if (scene == "helix") add({"--ground", "builtin:helix-bowl,cells=32", "--seconds", "1"});
  if (scene == "run")
    add({"--ground", "builtin:marble-run,steps=32,sides=4,turns=1,height=0.4", "--bodies", "3", "--seconds", "4"});
  if (scene == "poles") add({"--bodies", "6", "--points", "1000", "--seconds", "2"});
  if (scene == "slope") add({"--bodies", "5", "--points", "1000", "--seconds", "2"});
  if (scene == "cloth") add({"--nodes", "400", "--seconds", "1"});
  return words;
}

TEST(Simulate, EverySceneKeepsItsBodiesAndEndsTheSameForAnyThreads) {
  const support::TemporaryDirectory folder;
  for (const SceneKind& kind : scenes()) {
    std::vector<std::string> words = inSmall(kind.name, folder.path().string());
    words.push_back("--json");
    const Outcome outcome = runHere(words);
    ASSERT_EQ(outcome.status, 0) << kind.name << ": " << outcome.err;
    const Json figures = Json::parse(outcome.out);
    EXPECT_EQ(figures["lost"], 0) << kind.name;
    EXPECT_GT(figures["steps"], 200) << kind.name;
    EXPECT_GT(figures["contacts"]["max"], 0) << kind.name;
    EXPECT_GE(figures["contacts"]["max"], figures["contacts"]["mean"]) << kind.name;
    EXPECT_GT(figures["milliseconds_a_step"]["all"], figures["milliseconds_a_step"]["queries"]) << kind.name;
    words.insert(words.end(), {"--threads", "1"});
    EXPECT_EQ(Json::parse(runHere(words).out)["state"], figures["state"]) << kind.name;
  }
}

TEST(Simulate, TheSeedDecides) {
  const support::TemporaryDirectory folder;
  std::vector<std::string> words = inSmall("poles", folder.path().string());
  words.insert(words.end(), {"--seconds", "0.5", "--json"});
  words.erase(std::find(words.begin(), words.end(), "--seconds"),
              std::find(words.begin(), words.end(), "--seconds") + 2);
  const auto state = [&](const std::string& seed) {
    std::vector<std::string> with = words;
    with.insert(with.end(), {"--seed", seed});
    return Json::parse(runHere(with).out)["state"];
  };
  EXPECT_NE(state("1"), state("2"));
}

TEST(Simulate, AMarbleFollowsTheGrooveDownwards) {
  const support::TemporaryDirectory folder;
  const Outcome outcome = runHere({"simulate", "helix", "--ground", "builtin:helix-bowl,cells=48", "--seconds", "6",
                                   "--target-error", "1e-6", "--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json figures = Json::parse(outcome.out);
  EXPECT_EQ(figures["lost"], 0);
  EXPECT_LT(figures["penetration"]["last_second"], 0.02 * figures["penetration"]["size"].get<double>());
}

TEST(Simulate, MistakesAreToldInALine) {
  const auto refused = [](const std::vector<std::string>& words, const std::string& message) {
    const Outcome outcome = runHere(words);
    EXPECT_EQ(outcome.status, 2) << message;
    EXPECT_THAT(outcome.err, HasSubstr(message));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  };
  refused({"simulate", "bowl", "--bodies", "0"}, "bodies");
  refused({"simulate", "bowls"}, "bowl");
  refused({"simulate", "poles", "--body", "none.obj", "--bodies", "1"}, "none.obj");
  refused({"simulate", "poles", "--ground", "builtin:torus"}, "ground: is not for the scene poles");
  refused({"simulate", "cloth", "--bodies", "3"}, "bodies: is not for the scene cloth");
  refused({"simulate", "helix", "--ground", "builtin:torus,major=0.3,minor=0.1", "--target-error", "1e-3"},
          "nothing lies below");
}

}  // namespace
}  // namespace hpsdf::app
