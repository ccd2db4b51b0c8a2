// Tests `hpsdf build --checkpoint`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <csignal>
#include <functional>
#include <optional>

#include "cli_fixture.h"
#include "support/short_files.h"

namespace hpsdf::app {
namespace cli_checkpoint_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)

/// Returns the file's inode number, which changes with each write; nothing if the file does not exist.
std::optional<ino_t> identityOf(const fs::path& file) {
  struct stat status {};
  return stat(file.c_str(), &status) == 0 ? std::optional(status.st_ino) : std::nullopt;
}

class Checkpoints : public Cli {
 protected:
  /// Returns a call whose construction takes about a second and writes its checkpoint as often as it may.
  Call build(std::vector<std::string> more = {}) const {
    std::vector<std::string> words = {"build",          "builtin:gear", "-o",          at("f.hpsdf"),
                                      "--target-error", "1e-6",         "--checkpoint"};
    if (std::ranges::find(more, "--checkpoint-seconds") == more.end())
      more.insert(more.end(), {"--checkpoint-seconds", "0"});
    words.insert(words.end(), more.begin(), more.end());
    return {words};
  }
  std::string state() const { return at("f.hpsdf.checkpoint"); }

  /// Returns a condition that holds once a new checkpoint was written.
  std::function<bool()> newState() const {
    return [file = state(), before = identityOf(state())] {
      const auto now = identityOf(file);
      return now && now != before;
    };
  }
  /// Returns a condition that holds while a checkpoint is being written.
  std::function<bool()> halfState() const {
    return [folder = folder_.path()] {
      return std::ranges::any_of(namesIn(folder),
                                 [](const std::string& name) { return name.starts_with("f.hpsdf.checkpoint.part-"); });
    };
  }
};

TEST_F(Checkpoints, killedConstructionContinuesToTheSameBytes) {
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

TEST_F(Checkpoints, checkpointsOfOtherConstructionsAreRefused) {
  Process process(build());
  ASSERT_TRUE(process.sendWhen(newState(), SIGINT));
  const Outcome outcome = process.finish();
  EXPECT_EQ(outcome.status, 130);
  EXPECT_THAT(outcome.err, HasSubstr("cancelled; " + state() + " keeps the state"));
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

TEST_F(Checkpoints, checkpointsNeedAnOutput) {
  expectRefused({{"run", "-e", "build builtin:torus checkpoint=true"}}, "give output");
  expectRefused({{"build", "builtin:torus", "-o", at("f.hpsdf"), "--checkpoint-seconds", "1"}},
                "belongs to checkpoint");
}

/// The file-size limit admits the field in single precision, but not the checkpoint in double precision.
TEST_F(Checkpoints, warnsWhereACheckpointCannotBeWritten) {
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

}  // namespace cli_checkpoint_test
}  // namespace hpsdf::app
