// The scenes of `simulate`, in small.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

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
    EXPECT_GT(figures["touching"]["max"], 0) << kind.name;
    if (kind.name != "cloth") {
      EXPECT_GT(figures["contacts"]["max"], 0) << kind.name;
    }
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

// Pictures

std::string readFile(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::string> joined(std::vector<std::string> words, const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

TEST(Simulate, AFilmShowsItAndChangesNothing) {
  const support::TemporaryDirectory folder;
  const std::string cache = folder.path() / "cache";
  const auto at = [&](const std::string& name) { return (folder.path() / name).string(); };
  for (const char* scene : {"bowl", "slope", "cloth"}) {
    std::vector<std::string> words = {"simulate", scene,       "--target-error", "1e-4",  "--cache",
                                      cache,      "--seconds", "0.75",           "--json"};
    if (scene == std::string("bowl"))
      words = joined(words, {"--ground", "builtin:structured-bowl,cells=24,bumps=4", "--bodies", "300"});
    else
      words = joined(words, {"--points", "500"});
    if (scene == std::string("slope")) words = joined(words, {"--bodies", "8"});
    if (scene == std::string("cloth")) words = joined(words, {"--nodes", "400"});
    const std::vector<std::string> look = {"--cpu", "--size", "96x64"};
    const Json undrawn = Json::parse(runHere(words).out);
    const Outcome outcome = runHere(joined(joined(words, look), {"--fps", "8", "-o", at(scene)}));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json film = Json::parse(outcome.out);
    EXPECT_EQ(film["state"], undrawn["state"]) << scene;
    EXPECT_EQ(film["pictures"], Json::parse(readFile(at(scene) + "/frames.json")));
    ASSERT_EQ(film["pictures"]["frames"].size(), 7u);
    std::set<std::string> different;
    for (std::size_t frame = 0; frame < 7; ++frame) {
      EXPECT_EQ(film["pictures"]["frames"][frame]["seconds"], double(frame) / 8);
      different.insert(readFile(at(scene) + "/frame-000" + std::to_string(frame) + ".png"));
    }
    EXPECT_EQ(different.size(), 7u) << "what moves is seen to move";

    // on one thread, and the last frame alone
    ASSERT_EQ(runHere(joined(joined(words, look), {"--fps", "8", "-o", at("again"), "--threads", "1"})).status, 0);
    for (int frame = 0; frame < 7; ++frame) {
      const std::string name = "/frame-000" + std::to_string(frame) + ".png";
      EXPECT_TRUE(readFile(at("again") + name) == readFile(at(scene) + name)) << scene << name;
    }
    const Outcome still = runHere(joined(joined(words, look), {"-o", at("end.png")}));
    ASSERT_EQ(still.status, 0) << still.err;
    EXPECT_EQ(Json::parse(still.out)["state"], undrawn["state"]) << scene;
    EXPECT_EQ(Json::parse(still.out)["pictures"]["renderer"], "CPU, double precision");
    EXPECT_TRUE(readFile(at("end.png")) == readFile(at(scene) + "/frame-0006.png")) << scene;
  }
}

TEST(Simulate, AStillIsThePictureOfAScript) {
  const support::TemporaryDirectory folder;
  const std::string still =
      "simulate helix ground=builtin:helix-bowl,cells=32 target-error=1e-4 seconds=0.1 cpu=true "
      "size=96x64 output=\"" +
      (folder.path() / "s.png").string() + "\"";
  const auto script = [&](const std::string& more) { return runHere({"run", "-e", still + "; " + more}); };
  const Outcome good = script("expect pick(48,40).position.2 == 0 within 0.5; info");
  EXPECT_EQ(good.status, 0) << good.err << good.out;
  EXPECT_THAT(good.out, HasSubstr("helix-bowl"));
  EXPECT_EQ(script("expect pick(48,40).position.2 > 5").status, 1);
}

struct Impatient final : WorkListener {
  void report(std::string_view task, double fraction) override { simulating |= task == "simulating" && fraction > 0.3; }
  bool wantsCancel() override { return simulating; }
  void ended() override {}
  bool simulating = false;
};

TEST(Simulate, OneThatIsBrokenOffLeavesNoPictures) {
  const support::TemporaryDirectory folder;
  const std::string output = folder.path() / "frames";
  Impatient listener;
  std::istringstream in;
  std::ostringstream out, err;
  const std::vector<std::string> words = {"simulate",
                                          "helix",
                                          "--ground",
                                          "builtin:helix-bowl,cells=32",
                                          "--target-error",
                                          "1e-4",
                                          "--seconds",
                                          "1",
                                          "--cpu",
                                          "--size",
                                          "64x48",
                                          "--fps",
                                          "10",
                                          "-o",
                                          output};
  const int status = runProgram(words, Console{in, out, err, false, &listener});
  EXPECT_EQ(status, kExitCancelled) << err.str();
  EXPECT_FALSE(std::filesystem::exists(output));
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
  refused({"simulate", "poles", "--size", "64x48"}, "size: is for pictures: give output");
  refused({"simulate", "poles", "--fps", "10"}, "fps: is for pictures: give output");
  refused({"simulate", "poles", "-o", "x.png", "--fps", "10"}, "fps: is for films");
  refused({"simulate", "poles", "-o", "x", "--fps", "500"}, "there are 240: give rate");
  refused({"simulate", "poles", "-o", "x", "--seconds", "3600"}, "more than 10000 frames");
  refused({"simulate", "poles", "-o", "x.png", "--camera", "0,99,1"}, "elevation");
  refused({"simulate", "poles", "-o", "x.gif"}, "x.gif");
  // before anything is built: the mesh is not even looked for
  refused({"simulate", "poles", "-o", "none/x.png", "--body", "none.obj"}, "none/x.png");
  refused({"simulate", "helix", "--ground", "builtin:torus,major=0.3,minor=0.1", "--target-error", "1e-3"},
          "nothing lies below");
}

}  // namespace
}  // namespace hpsdf::app
