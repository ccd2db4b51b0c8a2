// Tests outputs that cannot be written, and interrupts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>

#include "cli_fixture.h"
#include "support/short_files.h"

namespace hpsdf::app {
namespace cli_output_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using Outputs = Cli;

TEST_F(Outputs, unwritableOutputsAreRefusedBeforeTheWork) {
  writeFile(at("file"), "x");
  for (const std::string& output :
       {at("none/f.hpsdf"), at("file/f.hpsdf"), folder_.path().string(), std::string("/dev/null")}) {
    const auto start = Clock::now();
    // The construction would take minutes, so that the test fails if the output is opened only afterwards.
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

/// The reader may have read what it wanted, as `head -1` does.
TEST_F(Outputs, aReaderThatHasGoneIsNoError) {
  for (const auto& words : {std::vector<std::string>{"info", field()},
                            {"info", field(), "--json"},
                            {"query", field()},
                            {"run", "-e", "load \"" + field() + "\"; info"},
                            {"--help"}}) {
    const Outcome outcome = run({.words = words, .input = "0 0 0\n", .stdoutClosed = true});
    EXPECT_EQ(outcome.status, 141) << words[0];
    EXPECT_THAT(outcome.err, IsEmpty());
  }
  const Outcome built =
      run({.words = {"build", "analytic:sphere", "-o", at("f.hpsdf"), "--target-error", "1e-2"}, .stdoutClosed = true});
  EXPECT_EQ(built.status, 141);
  EXPECT_THAT(built.err, IsEmpty());
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("f.hpsdf"));
}

/// Writing fails as on a full disk; older files must stay, and no unfinished files may remain.
TEST_F(Outputs, outputsThatDoNotFitLeaveOlderFiles) {
  const std::vector<std::vector<std::string>> calls = {
      {"build", "builtin:torus", "--target-error", "1e-4", "-o"},
      {"build", "builtin:torus", "--target-error", "1e-4", "--checkpoint", "-o"},
      {"combine", "union(builtin:torus, builtin:box)", "--target-error", "1e-4", "-o"},
      {"smooth", field(), "-o"},
      {"blend", field(), "-o"},
      {"bounds", field(), "-o"},
      {"contour", field(), "--tolerance", "5%", "-o"},
      {"export", field(), "--resolution", "9", "-o"},
      {"sample", "builtin:torus", "-o"},
      {"jumps", field(), "-o"},
      {"slice", field(), "--cpu", "--size", "64x64", "-o"},
      {"render", field(), "--cpu", "--size", "64x64", "-o"},
      {"docs", "-o"}};
  for (std::vector<std::string> words : calls) {
    const std::string output = at(words[0] == "contour"                         ? "old.ply"
                                  : words[0] == "export"                        ? "old.cdf"
                                  : words[0] == "slice" || words[0] == "render" ? "old.png"
                                  : words[0] == "jumps"                         ? "old.csv"
                                  : words[0] == "sample"                        ? "old.npz"
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

TEST_F(Outputs, standardOutputOnAFullDiskIsAnError) {
  for (const auto& words :
       {std::vector<std::string>{"info", field()}, {"info", field(), "--json"}, {"query", field()}}) {
    const Outcome outcome = run({.words = words, .input = "0 0 0\n", .output = "/dev/full"});
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, HasSubstr("cannot write to standard output"));
    EXPECT_EQ(lineCount(outcome.err), 1u) << outcome.err;
  }
}

TEST_F(Outputs, filesThatWereWrittenBeforeStandardOutputFailedAreNamed) {
  const auto expectNamed = [&](const std::vector<std::string>& words, const std::string& files) {
    const Outcome outcome = run({.words = words, .output = "/dev/full"});
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, StartsWith("hpsdf: error: cannot write to standard output; "));
    EXPECT_THAT(outcome.err, EndsWith("; " + files + " written all the same\n"));
    EXPECT_EQ(lineCount(outcome.err), 1u) << outcome.err;
  };
  const std::string field = at("f.hpsdf"), picture = at("s.png");
  for (const char* more : {"--json", "--threads=1"})
    expectNamed({"build", "analytic:sphere", "-o", field, "--target-error", "1e-2", more}, field + " is");
  EXPECT_GT(fs::file_size(field), 0u);
  expectNamed({"slice", field, "-o", picture, "--cpu", "--size", "64x64"}, picture + " is");
  expectNamed({"run", "-e", "load " + field + "; save -o " + at("g.hpsdf") + "; slice cpu=true output=" + picture},
              at("g.hpsdf") + ", " + picture + " are");
}

TEST_F(Outputs, symbolicLinksAreFollowedAndStay) {
  fs::create_directory(at("real"));
  writeFile(at("real/old.hpsdf"), "old");
  fs::create_symlink("real/old.hpsdf", at("there.hpsdf"));
  fs::create_symlink("real/new.hpsdf", at("dangling.hpsdf"));
  fs::create_symlink("dangling.hpsdf", at("chain.hpsdf"));
  fs::create_symlink("none/f.hpsdf", at("nowhere.hpsdf"));
  fs::create_symlink("circle.hpsdf", at("circle.hpsdf"));
  const auto build = [&](const std::string& output) {
    return Call{{"build", "analytic:sphere", "-o", at(output), "--target-error", "1e-2"}};
  };
  for (const auto& [link, target] : {std::pair("there.hpsdf", "real/old.hpsdf"), {"chain.hpsdf", "real/new.hpsdf"}}) {
    EXPECT_EQ(run(build(link)).status, 0) << link;
    EXPECT_TRUE(fs::is_symlink(at(link)));
    EXPECT_EQ(readFile(at(target)).substr(0, 6), readFile(field()).substr(0, 6)) << "a field's file";
  }
  EXPECT_TRUE(fs::is_symlink(at("dangling.hpsdf")));
  EXPECT_THAT(namesIn(at("real")), ElementsAre("new.hpsdf", "old.hpsdf"));
  expectRefused(build("nowhere.hpsdf"), "nowhere.hpsdf: cannot be written (No such file or directory)");
  expectRefused(build("circle.hpsdf"), "circle.hpsdf: cannot be written (Too many levels of symbolic links)");
}

TEST_F(Outputs, aSmallStackIsEnough) {
  writeFile(at("mesh.obj"), kTetrahedron);
  for (const std::size_t kilobytes : {48, 64})
    for (const auto& words : {std::vector<std::string>{"build", at("mesh.obj"), "-o", at("f.hpsdf"), "--grid", "2"},
                              {"verify", field(), "builtin:torus", "--points", "1000"},
                              {"render", field(), "-o", at("r.png"), "--cpu", "--size", "64x64"}}) {
      const Outcome outcome = run({.words = words, .stackKilobytes = kilobytes});
      EXPECT_EQ(outcome.status, 0) << words[0] << " with " << kilobytes << " kB: " << outcome.err;
    }
}

TEST_F(Outputs, readOnlyFoldersAreRefusedBeforeTheWork) {
  for (const std::string& output :
       {std::string("/proc/f.hpsdf"), std::string("/dev/full"), at(std::string(300, 'x'))}) {
    expectRefused({{"build", "builtin:gear", "-o", output, "--target-error", "1e-12"}}, output);
    expectRefused({{"build", "builtin:gear", "-o", output, "--target-error", "1e-12", "--checkpoint"}}, output);
  }
  expectRefused({{"report", field(), "-o", at(std::string(300, 'x'))}}, "File name too long; check");
}

TEST_F(Outputs, outputsMustDifferFromInputs) {
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

TEST_F(Outputs, interruptStopsTheConstruction) {
  for (const auto& words :
       {std::vector<std::string>{"build", "builtin:gear", "-o", at("f.hpsdf"), "--target-error", "1e-12"},
        std::vector<std::string>{"report", "builtin:gear", "-o", at("report"), "--target-error", "1e-12"},
        std::vector<std::string>{"frames", "builtin:gear", "-o", at("frames"), "--target-error", "1e-12"},
        std::vector<std::string>{"turntable", field(), "-o", at("turn"), "--frames", "9999", "--size", "160x120",
                                 "--cpu"},
        std::vector<std::string>{"compare", field(), field(), "-o", at("page.html"), "--points", "2e7"},
        std::vector<std::string>{"study", "tradeoff", "builtin:gear", "-o", at("study"), "--target-errors", "1e-12"},
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

/// The program waits for more points on standard input and has already opened its temporary file.
TEST_F(Outputs, interruptOutsideAConstructionLeavesNothing) {
  Process process({.words = {"query", field(), "-o", at("q.csv")}, .keepInputOpen = true});
  for (int i = 0; i < 1000 && namesIn(folder_.path()).empty(); ++i) usleep(10000);
  ASSERT_EQ(namesIn(folder_.path()).size(), 1u) << "the temporary file";
  process.send(SIGTERM);
  const Outcome outcome = process.finish();
  EXPECT_EQ(outcome.status, 143);
  EXPECT_THAT(outcome.err, EndsWith("hpsdf: cancelled; nothing is half-written\n"));
  EXPECT_THAT(namesIn(folder_.path()), IsEmpty());
}

/// The construction ends by a flag that its loops see, the query within the signal handler.
TEST_F(Outputs, signalsEndAllCommandsAlike) {
  for (const auto& [signal, status] : {std::pair{SIGINT, 130}, {SIGTERM, 143}, {SIGHUP, 129}}) {
    Process query({.words = {"query", field(), "-o", at("q.csv")}, .keepInputOpen = true});
    Process build({{"build", "builtin:gear", "-o", at("f.hpsdf"), "--target-error", "1e-12"}});
    build.waitForErrorLine();
    for (Process* process : {&query, &build}) {
      process->send(signal);
      const Outcome outcome = process->finish();
      EXPECT_EQ(outcome.status, status) << outcome.err;
      EXPECT_THAT(outcome.err, EndsWith("hpsdf: cancelled; nothing is half-written\n"));
      EXPECT_THAT(outcome.out, IsEmpty());
    }
    EXPECT_THAT(namesIn(folder_.path()), IsEmpty());
  }
}

TEST_F(Outputs, olderFileSurvivesAnInterrupt) {
  fs::copy_file(field(), at("f.hpsdf"));
  Process process({{"build", "builtin:gear", "-o", at("f.hpsdf"), "--target-error", "1e-12"}});
  process.waitForErrorLine();
  process.send(SIGINT);
  EXPECT_EQ(process.finish().status, 130);
  EXPECT_EQ(readFile(at("f.hpsdf")), readFile(field()));
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("f.hpsdf"));
}

}  // namespace cli_output_test
}  // namespace hpsdf::app
