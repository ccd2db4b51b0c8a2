// Tests the scenes of `hpsdf simulate` with few bodies and short durations.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "hpsdf/field_file.h"
#include "outcome.h"
#include "simulate/scene_request.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace simulate_test {

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

TEST(Simulate, everySceneKeepsItsBodiesAndEndsTheSameForAnyThreads) {
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

TEST(Simulate, theSeedChangesTheState) {
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

TEST(Simulate, aMarbleFollowsTheGrooveDownwards) {
  const support::TemporaryDirectory folder;
  const Outcome outcome = runHere({"simulate", "helix", "--ground", "builtin:helix-bowl,cells=48", "--seconds", "6",
                                   "--target-error", "1e-6", "--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json figures = Json::parse(outcome.out);
  EXPECT_EQ(figures["lost"], 0);
  EXPECT_LT(figures["penetration"]["last_second"], 0.02 * figures["penetration"]["size"].get<double>());
}

std::string readFile(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::string> joined(std::vector<std::string> words, const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

TEST(Simulate, aFilmShowsItAndChangesNothing) {
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

    // The same film, simulated on one thread, has the same pixels.
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

TEST(Simulate, aStillIsThePictureOfAScript) {
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

TEST(Simulate, anInterruptedFilmLeavesNoPictures) {
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

/// Writes an OBJ file with a cube around the origin. An open cube lacks the last two triangles.
std::string cubeFile(const support::TemporaryDirectory& folder, const std::string& name, double side, bool open) {
  const std::string file = (folder / name).string();
  std::ofstream out(file);
  for (int corner = 0; corner < 8; ++corner)
    out << "v " << side * ((corner & 1) - 0.5) << ' ' << side * ((corner >> 1 & 1) - 0.5) << ' '
        << side * ((corner >> 2) - 0.5) << '\n';
  out << "f 1 3 4\nf 1 4 2\nf 5 6 8\nf 5 8 7\nf 1 2 6\nf 1 6 5\nf 3 7 8\nf 3 8 4\nf 1 5 7\nf 1 7 3\n";
  if (!open) out << "f 2 4 8\nf 2 8 6\n";
  return file;
}

TEST(Simulate, lostAndWaitingBodiesAreReported) {
  const support::TemporaryDirectory folder;
  const auto figures = [&](std::vector<std::string> words) {
    words.push_back("--json");
    const Outcome outcome = runHere(words);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return Json::parse(outcome.out);
  };
  // With time steps of one second, the cloth passes through the ground and the table.
  std::vector<std::string> words = {"simulate",  "cloth", "--nodes",        "16",   "--rate",   "1",
                                    "--seconds", "20",    "--target-error", "1e-3", "--points", "100"};
  EXPECT_EQ(figures(words)["lost"], 1);
  words = {"simulate",       "helix", "--bodies", "3", "--seconds", "2.5", "--ground", "builtin:helix-bowl,cells=32",
           "--target-error", "1e-3"};
  EXPECT_EQ(figures(words)["bodies"], 2);
  EXPECT_EQ(figures(words)["waiting"], 1);
  EXPECT_THAT(runHere(words).out, HasSubstr("still to come       1 bodies"));
}

TEST(Simulate, aRunHasBodiesOfAllMeshes) {
  const support::TemporaryDirectory folder;
  const auto state = [&](const std::vector<std::string>& bodies) {
    std::vector<std::string> words = inSmall("run", folder.path().string());
    words.insert(words.end(), {"--points", "300", "--json"});
    for (const std::string& body : bodies) words.insert(words.end(), {"--body", body});
    return Json::parse(runHere(words).out)["state"];
  };
  EXPECT_NE(state({"builtin:torus"}), state({"builtin:torus", "builtin:gear"}));
}

TEST(Simulate, openMeshesCauseAWarning) {
  const support::TemporaryDirectory folder;
  const auto warning = [&](bool open) {
    const Outcome outcome = runHere({"simulate", "cloth", "--ground", cubeFile(folder, "cube.obj", 1, open), "--nodes",
                                     "16", "--seconds", "0.01", "--target-error", "1e-2", "--points", "50"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(warning(true), HasSubstr("cube.obj is not closed"));
  EXPECT_THAT(warning(false), testing::Not(HasSubstr("warning")));
}

void refused(const std::vector<std::string>& words, const std::string& message) {
  const Outcome outcome = runHere(words);
  EXPECT_EQ(outcome.status, 2) << message;
  EXPECT_THAT(outcome.err, HasSubstr(message));
  std::istringstream lines(outcome.err);
  int errors = 0;
  for (std::string line; std::getline(lines, line);)
    if (line.find(" %, ") == std::string::npos) ++errors;  // lines with a percentage report progress
  EXPECT_EQ(errors, 1) << outcome.err;
}

TEST(Simulate, aCacheWithAnotherFieldIsRefused) {
  const support::TemporaryDirectory folder;
  const auto words = [&](const std::string& cache, const std::string& error) {
    return std::vector<std::string>{"simulate", "cloth", "--nodes", "16",  "--seconds",      "0.01",
                                    "--points", "50",    "--cache", cache, "--target-error", error};
  };
  const std::string cache = (folder / "fields").string();
  ASSERT_EQ(runHere(words(cache, "1e-2")).status, 0);
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(cache)) files.push_back(entry.path());
  ASSERT_EQ(files.size(), 2u);  // the fields of the ground and the table
  // Each target error has its own field in the cache, however small the difference.
  ASSERT_EQ(runHere(words(cache, "1.0000001e-2")).status, 0);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(cache), {}), 4);

  const std::uintmax_t size = std::filesystem::file_size(files[0]);
  std::filesystem::copy_file(files[0], folder / "good");
  std::filesystem::resize_file(files[0], size / 2);
  refused(words(cache, "1e-2"), files[0].string() + ": the field file is damaged");
  refused(words(cache, "1e-2"), "remove the file");
  const auto overwrite = std::filesystem::copy_options::overwrite_existing;
  std::filesystem::copy_file(files[1], files[0], overwrite);
  refused(words(cache, "1e-2"), files[0].string() + ": is the field of another mesh");
  // A coarser field of the same mesh is refused.
  const std::string coarse = (folder / "coarse").string();
  ASSERT_EQ(runHere(words(coarse, "1")).status, 0);
  const std::string print = files[0].filename().string().substr(0, 16);
  for (const auto& entry : std::filesystem::directory_iterator(coarse))
    if (entry.path().filename().string().starts_with(print)) std::filesystem::copy_file(entry, files[0], overwrite);
  refused(words(cache, "1e-2"), "of another target error");
  std::filesystem::copy_file(folder / "good", files[0], overwrite);
  EXPECT_EQ(runHere(words(cache, "1e-2")).status, 0);

  refused(words((folder / "good").string(), "1e-2"), "good: cannot be made a folder for fields");
  refused(words("/sys", "1e-2"), "cannot be written");
}

TEST(Simulate, fieldsMayHaveExactLeaves) {
  const support::TemporaryDirectory folder;
  const std::filesystem::path cache = folder / "fields";
  for (const std::string strategy : {"hp", "hpx", "hpx"}) {
    std::vector<std::string> words = inSmall("cloth", cache.string());
    words.insert(words.end(), {"--ground", "builtin:gear", "--strategy", strategy, "--json"});
    const Outcome outcome = runHere(words);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(Json::parse(outcome.out)["lost"], 0);
  }
  std::multiset<bool> haveExactLeaves;  // of the fields in the cache: ground and table, of either strategy
  for (const auto& entry : std::filesystem::directory_iterator(cache))
    haveExactLeaves.insert(statistics(load(entry)).exact.leaves > 0);
  EXPECT_EQ(haveExactLeaves, (std::multiset<bool>{false, false, true, true}));
}

/// A listener that cancels the work when it reports the given task.
struct CancelsWhile final : WorkListener {
  explicit CancelsWhile(std::string of) : task(std::move(of)) {}
  void report(std::string_view now, double) override { reached = reached || now == task; }
  bool wantsCancel() override { return reached; }
  void ended() override {}

  std::string task;
  std::atomic<bool> reached = false;
};

TEST(Simulate, aCancelledSimulationLeavesNoFiles) {
  const support::TemporaryDirectory folder;
  std::istringstream in;
  for (const std::string task : {"refining", "simulating"}) {
    const std::string cache = (folder / task).string();
    std::ostringstream out, err;
    CancelsWhile listener(task);
    const std::vector<std::string> words = {"simulate", "cloth", "--nodes",        "100",  "--seconds", "60",
                                            "--points", "50",    "--target-error", "1e-5", "--cache",   cache};
    EXPECT_EQ(runProgram(words, Console{in, out, err, false, &listener}), 130) << task;
    EXPECT_EQ(out.str(), "");
    EXPECT_THAT(err.str(), testing::EndsWith("hpsdf: cancelled; nothing is half-written\n"));
    const auto kept = std::distance(std::filesystem::directory_iterator(cache), {});
    EXPECT_EQ(kept, task == "refining" ? 0 : 2) << "fields that are whole are kept";
  }
}

TEST(Simulate, mistakesAreReportedInOneLine) {
  const support::TemporaryDirectory folder;
  refused({"simulate", "bowl", "--bodies", "0"}, "bodies");
  refused({"simulate", "bowls"}, "bowl");
  refused({"simulate", "poles", "--body", "none.obj", "--bodies", "1"}, "none.obj");
  refused({"simulate", "poles", "--ground", "builtin:torus"}, "ground: the scene poles does not take it");
  refused({"simulate", "cloth", "--bodies", "3"}, "bodies: the scene cloth does not take it");
  refused({"simulate", "poles", "--size", "64x48"}, "size: is for pictures: give output");
  refused({"simulate", "poles", "--fps", "10"}, "fps: is for pictures: give output");
  refused({"simulate", "poles", "-o", "x.png", "--fps", "10"}, "fps: is for films");
  refused({"simulate", "poles", "-o", "x", "--fps", "500"}, "there are 240: give rate");
  refused({"simulate", "poles", "-o", "x", "--seconds", "3600"}, "more than 10000 frames");
  refused({"simulate", "poles", "-o", "x.png", "--camera", "0,99,1"}, "elevation");
  refused({"simulate", "poles", "-o", "x.gif"}, "x.gif");
  // Arguments are checked before the mesh is read: this mesh does not exist.
  refused({"simulate", "poles", "-o", "none/x.png", "--body", "none.obj"}, "none/x.png");
  refused({"simulate", "helix", "--ground", "builtin:torus,major=0.3,minor=0.1", "--target-error", "1e-3"},
          "builtin:torus,major=0.3,minor=0.1: nothing lies below");
  for (const double side : {0.01, 100.0})
    refused({"simulate", "bowl", "--ground", cubeFile(folder, "cube.obj", side, false)}, "for marbles of radius 0.03");
  std::ofstream(folder / "flat.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  refused({"simulate", "poles", "--body", (folder / "flat.obj").string()}, "flat.obj: a body needs a closed surface");
}

}  // namespace simulate_test
}  // namespace hpsdf::app
