// Tests constructions that are interrupted and resumed from a checkpoint.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/shapes.h"
#include "support/file_checksums.h"
#include "support/short_files.h"
#include "support/temporary_directory.h"
#include "support/ways_to_build.h"

namespace hpsdf {
namespace checkpoint_test {

namespace fs = std::filesystem;

using support::cube;
using support::everyWay;
using support::everyWayToExactLeaves;
using support::spheres;

std::string readAll(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void writeAll(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

std::set<std::string> namesIn(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
  return names;
}

std::string bytesOf(const Field& field, const fs::path& folder) {
  save(field, folder / "field");
  return readAll(folder / "field");
}

/// Returns settings with which the construction writes a checkpoint as often as it can.
Checkpoint alwaysAt(const fs::path& file) { return {.file = file, .seconds = 0, .share = 1}; }

/// Cancels a construction after it has asked `questions` times whether to end.
Progress endingAfter(std::atomic<int>& questions) {
  return {.report = {}, .cancelled = [&questions] { return --questions < 0; }};
}

constexpr int kProbes = 4096;  // points at which distances without a fingerprint are compared

/// Interrupts constructions at random moments and resumes them with random numbers of threads until they end. Each of
/// their checkpoints equals, byte by byte, a checkpoint of the construction without interruption.
void expectTheSameBytes(const DistanceFunction& distance, const Box& domain, const std::vector<BuildOptions>& ways) {
  support::TemporaryDirectory folder;
  std::mt19937_64 random(7);
  constexpr int kResumed = 4, kAttempts = 300;
  int path = 0;
  for (BuildOptions options : ways) {
    SCOPED_TRACE("way " + std::to_string(path++));
    constexpr int kMany = 1 << 30;
    std::atomic<int> left = kMany;
    Checkpoint checkpoint = alwaysAt(folder / "state");
    std::set<std::string> states;
    Progress progress = endingAfter(left);
    progress.report = [&](std::string_view, double) { states.insert(readAll(checkpoint.file)); };
    const std::string whole = bytesOf(buildResumably(distance, domain, options, checkpoint, progress), folder.path());
    states.insert(readAll(checkpoint.file));
    EXPECT_TRUE(bytesOf(build(distance, domain, options), folder.path()) == whole);
    const int all = kMany - left;
    fs::remove(checkpoint.file);
    progress.report = [&](std::string_view, double) { EXPECT_TRUE(states.contains(readAll(checkpoint.file))); };
    int resumed = 0, ends = 0;
    checkpoint.resumed = [&](std::uint64_t) { ++resumed; };
    for (int n = 0; n < kAttempts && (resumed < kResumed || ends == 0); ++n) {
      options.threads = 1 + static_cast<int>(random() % 3);
      left = static_cast<int>(random() % std::uint64_t(all));
      try {
        const Field field = buildResumably(distance, domain, options, checkpoint, progress);
        EXPECT_TRUE(bytesOf(field, folder.path()) == whole);
        fs::remove(checkpoint.file);
        ++ends;
      } catch (const Cancelled&) {
      }
    }
    EXPECT_GE(ends, 1);
    EXPECT_GE(resumed, kResumed);
    fs::remove(checkpoint.file);
  }
}

TEST(Checkpoint, whateverIsInterruptedEndsWithTheSameBytes) { expectTheSameBytes(spheres, cube(), everyWay()); }

TEST(Checkpoint, exactLeavesEndWithTheSameBytesToo) {
  const ExactDistance gear(shapes::mesh("gear,teeth=4,segments=2"));
  expectTheSameBytes(gear, domainAround(gear.source().box), everyWayToExactLeaves());
}

/// The checkpoint of a finished construction gives the field without another step.
TEST(Checkpoint, whatWasDoneIsNotDoneAgain) {
  support::TemporaryDirectory folder;
  std::atomic<int> calls = 0;
  const auto counting = [&](const Vector3& x) {
    ++calls;
    return spheres(x);
  };
  const BuildOptions options{.targetError = 1e-6};
  const Field first = buildResumably(counting, cube(), options, alwaysAt(folder / "state"));
  EXPECT_EQ(std::uint64_t(calls), kProbes + first.metadata().exactEvaluations);
  calls = 0;
  Checkpoint checkpoint = alwaysAt(folder / "state");
  std::uint64_t steps = 0;
  checkpoint.resumed = [&](std::uint64_t taken) { steps = taken; };
  const Field again = buildResumably(counting, cube(), options, checkpoint);
  EXPECT_EQ(calls, kProbes);
  EXPECT_EQ(steps, first.metadata().steps);
  EXPECT_TRUE(bytesOf(again, folder.path()) == bytesOf(first, folder.path()));
}

/// Fixture: an interrupted construction, whose checkpoint is then altered or resumed with other inputs.
class Refused : public testing::Test {
 protected:
  void SetUp() override {
    std::atomic<int> questions = 400;
    EXPECT_THROW(buildResumably(distance(), cube(), options_, alwaysAt(file()), endingAfter(questions)), Cancelled);
    state_ = readAll(file());
    ASSERT_GT(state_.size(), 1000u);
  }

  DistanceFunction distance(const Source& source = {"two.obj", 1, 2, 3, cube(1)}) {
    return DistanceFunction(
        [this](const Vector3& x) {
          ++calls_;
          return spheres(x);
        },
        source);
  }
  fs::path file() const { return folder_ / "state"; }

  /// Returns the error that refuses the checkpoint before anything is built; empty if the construction resumes.
  std::string refusal(const DistanceFunction& phi, const Box& domain, const BuildOptions& options,
                      const std::string& about = "") {
    Checkpoint checkpoint = alwaysAt(file());
    checkpoint.about = about;
    calls_ = 0;
    std::atomic<int> questions = 0;
    try {
      buildResumably(phi, domain, options, checkpoint, endingAfter(questions));
    } catch (const Cancelled&) {
      return "";
    } catch (const Error& error) {
      EXPECT_LE(calls_, kProbes);
      EXPECT_EQ(namesIn(folder_.path()), std::set<std::string>({"state"}));
      EXPECT_EQ(std::string(error.what()).find(file().string()), 0u) << error.what();
      return error.what();
    }
    ADD_FAILURE() << "it went on to its end";
    return "";
  }
  std::string refusal() { return refusal(distance(), cube(), options_); }
  std::string refusalOf(const std::string& bytes) {
    writeAll(file(), bytes);
    return refusal();
  }

  support::TemporaryDirectory folder_;
  BuildOptions options_{.targetError = 1e-6, .grid = {2, 2, 2}, .criterion = Criterion::optimal};
  std::string state_;
  std::atomic<int> calls_ = 0;
};

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST_F(Refused, areOthersStates) {
  EXPECT_EQ(refusal(), "");
  BuildOptions other = options_;
  other.threads = 2;
  EXPECT_EQ(refusal(distance(), cube(), other), "");
  EXPECT_EQ(refusal(distance({"renamed.obj", 1, 2, 3, cube(1)}), cube(), options_), "");
  EXPECT_TRUE(holds(refusal(distance({"two.obj", 2, 2, 3, cube(1)}), cube(), options_), "another surface"));
  EXPECT_TRUE(holds(refusal(distance({"two.obj", 0, 2, 3, cube(1)}), cube(), options_), "another surface"));
  EXPECT_TRUE(holds(refusal(distance(), cube(1.2), options_), "other options"));
  EXPECT_TRUE(holds(refusal(distance(), cube(), options_, "winding"), "other options"));
  const DistanceFunction moved([](const Vector3& x) { return spheres(x) + 1e-15; }, distance().source());
  EXPECT_TRUE(holds(refusal(moved, cube(), options_), "another distance"));
  std::vector<BuildOptions> others(9, options_);
  others[0].targetError = 2e-6;
  others[1].grid = {2, 2, 3};
  others[2].maxSteps = 1000;
  others[3].maxBytes = 1000000;
  others[4].enrich = true;
  others[5].continuityWeight = 1;
  others[6].bounds = true;
  others[7].coefficients = CoefficientType::float64;
  others[8].cubature = CubatureKind::product;
  for (const BuildOptions& options : others)
    EXPECT_TRUE(holds(refusal(distance(), cube(), options), "other options; delete it"));
}

TEST_F(Refused, areFilesThatAreNoStates) {
  EXPECT_TRUE(holds(refusalOf("solid cube\nfacet normal 0 0 1\n"), "is no checkpoint"));
  EXPECT_TRUE(holds(refusalOf(""), "is no checkpoint"));
  std::string bytes = state_;
  bytes[8] = 9;  // follows the magic number
  EXPECT_TRUE(holds(refusalOf(bytes), "version 9"));
  bytes = state_;
  bytes[16] = '7';  // the version text follows its length
  EXPECT_TRUE(holds(refusalOf(bytes), "of hpsdf 7"));
  fs::remove(file());
  fs::create_directory(file());
  EXPECT_TRUE(holds(refusal(), "folder"));
}

TEST_F(Refused, areTruncatedAndAlteredStates) {
  std::size_t count = 0;
  for (std::size_t length = 0; length < state_.size(); length += length < 200 ? 1 : state_.size() / 200, ++count)
    ASSERT_NE(refusalOf(state_.substr(0, length)), "") << length << " of " << state_.size() << " bytes";
  EXPECT_GT(count, 300u);
  EXPECT_TRUE(holds(refusalOf(state_ + "x"), "too long"));
  std::mt19937_64 random(2);
  for (int n = 0; n < 400; ++n) {
    std::string bytes = state_;
    const std::size_t position = n < 200 ? std::size_t(n) : random() % state_.size();
    bytes[position] = char(bytes[position] ^ (1 << (random() % 8)));
    ASSERT_NE(refusalOf(bytes), "") << "byte " << position;
  }
  EXPECT_EQ(refusalOf(state_), "");
}

/// Random changes with a corrected checksum are refused, or the construction ends as usual; it must not crash.
TEST_F(Refused, forgedStatesDoNoHarm) {
  std::mt19937_64 random(3);
  int refused = 0;
  constexpr int kForged = 200;
  for (int n = 0; n < kForged; ++n) {
    std::string bytes = state_;
    const std::size_t from = n < kForged / 2 ? 80 : bytes.size() - 300;  // settings and first cells, or lists of cells
    for (int changes = 1 + static_cast<int>(random() % 3); changes-- > 0;)
      bytes[from + random() % 200] = char(random() % 2 == 0 ? random() : random() % 9);
    support::mendChecksum(bytes);
    writeAll(file(), bytes);
    std::atomic<int> questions = 60;
    try {
      buildResumably(distance(), cube(), options_, alwaysAt(file()), endingAfter(questions));
    } catch (const Cancelled&) {
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, kForged / 20);
  EXPECT_LT(refused, kForged) << "some get past the checks";
}

/// Random changes of a state with exact leaves, with a corrected checksum, do no harm either.
TEST(Checkpoint, forgedExactLeavesDoNoHarm) {
  support::TemporaryDirectory folder;
  const fs::path file = folder / "state";
  const ExactDistance ball(shapes::mesh("sphere,subdivisions=1"));
  const Box domain = domainAround(ball.source().box);
  const BuildOptions options{.targetError = 1e-3,
                             .grid = {2, 2, 2},
                             .criterion = Criterion::optimal,
                             .maxDegree = 3,
                             .maxDepth = 2,
                             .strategy = Strategy::hpx,
                             .exactTriangles = 16,
                             .threads = 1};
  buildResumably(ball, domain, options, alwaysAt(file));
  const std::string state = readAll(file);
  std::mt19937_64 random(4);
  int refused = 0;
  constexpr int kForged = 300;
  for (int n = 0; n < kForged; ++n) {
    std::string bytes = state;
    for (int changes = 1 + static_cast<int>(random() % 3); changes-- > 0;)
      bytes[80 + random() % (bytes.size() - 88)] = char(random() % 2 == 0 ? random() : random() % 64);
    support::mendChecksum(bytes);
    writeAll(file, bytes);
    Checkpoint checkpoint = alwaysAt(file);
    checkpoint.seconds = 1000;
    try {
      const Field field = buildResumably(ball, domain, options, checkpoint);
      EXPECT_TRUE(std::isfinite(field.value(domain.center())));
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, kForged / 20);
  EXPECT_LT(refused, kForged) << "some get past the checks";
}

TEST(Checkpoint, timesOutOfRangeAreRefused) {
  support::TemporaryDirectory folder;
  for (const auto& [seconds, share] : {std::pair(-1.0, 0.1), {NAN, 0.1}, {1e10, 0.1}, {1.0, 0.0}, {1.0, 1.5}})
    EXPECT_THROW(buildResumably(spheres, cube(), {.targetError = 1e-3},
                                {.file = folder / "state", .seconds = seconds, .share = share}),
                 Error);
  EXPECT_THROW(buildResumably(spheres, cube(), {.targetError = 1e-3}, {.file = folder / "none" / "state"}), Error);
}

/// Limits the size of files, like a full disk, and ignores SIGXFSZ, which the library leaves to the program.
support::ShortFiles shortFiles(rlim_t bytes) {
  std::signal(SIGXFSZ, SIG_IGN);
  return support::ShortFiles(bytes);
}

/// Returns how often the construction tries to write a checkpoint; every attempt fails because of the size limit.
int attempts(const Checkpoint& checkpoint) {
  const support::ShortFiles limit = shortFiles(1000);
  int failures = 0;
  Checkpoint counted = checkpoint;
  counted.failed = [&](const Error& error) {
    ++failures;
    EXPECT_TRUE(holds(error.what(), "writing failed")) << error.what();
  };
  buildResumably(spheres, cube(), {.targetError = 1e-6}, counted);
  return failures;
}

TEST(Checkpoint, statesAreKeptNoMoreOftenThanAsked) {
  support::TemporaryDirectory folder;
  const int always = attempts(alwaysAt(folder / "state"));
  EXPECT_GT(always, 5);
  EXPECT_EQ(attempts({.file = folder / "state", .seconds = 1000, .share = 1}), 0);
  EXPECT_EQ(attempts({.file = folder / "state", .seconds = 0, .share = 1e-9}), 1);
}

TEST(Checkpoint, aFullDiskLeavesTheOlderStateAndTheConstruction) {
  support::TemporaryDirectory folder;
  const fs::path file = folder / "state";
  const BuildOptions options{.targetError = 1e-6};
  std::atomic<int> questions = 600;
  EXPECT_THROW(buildResumably(spheres, cube(), options, alwaysAt(file), endingAfter(questions)), Cancelled);
  const std::string before = readAll(file);
  ASSERT_GT(before.size(), 1000u);
  {
    const support::ShortFiles limit = shortFiles(1000);
    EXPECT_THROW(buildResumably(spheres, cube(), options, alwaysAt(file)), Error);
  }
  EXPECT_EQ(namesIn(folder.path()), std::set<std::string>({"state"}));
  EXPECT_TRUE(readAll(file) == before);
  Checkpoint checkpoint = alwaysAt(file);
  int failures = 0;
  checkpoint.failed = [&](const Error&) { ++failures; };
  const Field field = [&] {
    const support::ShortFiles limit = shortFiles(1000);
    return buildResumably(spheres, cube(), options, checkpoint);
  }();
  EXPECT_GT(failures, 0);
  EXPECT_TRUE(readAll(file) == before);
  EXPECT_TRUE(bytesOf(field, folder.path()) == bytesOf(build(spheres, cube(), options), folder.path()));
}

/// Returns the id of a process that has ended.
pid_t pastProcess() {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  waitpid(child, nullptr, 0);
  return child;
}

/// Returns the beginning of the names of temporary files of "out", up to the process id.
std::string temporaryOfOut(const std::filesystem::path& folder) {
  const OutputFile file(folder / "out");
  for (const std::string& name : namesIn(folder))
    if (name.starts_with("out.part-")) return name.substr(0, name.find('-', std::string("out.part-").size()) + 1);
  return "";
}

TEST(OutputFile, leftoversOfKilledProcessesAreRemoved) {
  support::TemporaryDirectory folder;
  const std::string ours = temporaryOfOut(folder.path()), another = "out.part-another-";
  ASSERT_THAT(ours, testing::MatchesRegex("out\\.part-[0-9a-f]{8}-"));
  const auto leftover = [&](const std::string& beginning, pid_t process, const std::string& rest) {
    const std::string whole = beginning + std::to_string(process) + rest;
    writeAll(folder / whole, "half");
    return whole;
  };
  const pid_t past = pastProcess();
  leftover(ours, past, "-0");
  leftover(ours, past, "-17");
  leftover(ours, getpid(), "-999999");  // from an earlier process with our id
  const std::string old = leftover(another, getpid(), "-0");
  std::filesystem::last_write_time(folder / old,
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(25));
  const std::vector<std::string> stay = {leftover(ours, getppid(), "-0"), leftover(another, past, "-1"),
                                         leftover("out.txt" + ours.substr(3), past, "-0"), leftover(ours, past, "x")};
  OutputFile file(folder / "out");
  const std::size_t all = namesIn(folder.path()).size();
  OutputFile::removeAbandoned(folder / "out");
  const std::set<std::string> left = namesIn(folder.path());
  EXPECT_EQ(left.size(), all - 4);
  for (const std::string& name : stay) EXPECT_TRUE(left.contains(name)) << name;
  file.commit();
  EXPECT_NO_THROW(OutputFile::removeAbandoned(folder / "none" / "out"));
}

/// A file name has at most 255 bytes, so that a suffix does not fit behind the longest names.
TEST(OutputFile, longNamesHaveShortTemporaryOnes) {
  support::TemporaryDirectory folder;
  std::string letters;
  for (int i = 0; i < 127; ++i) letters += "\u00e4";  // "ä" has two bytes in UTF-8
  for (const std::string& name : {std::string(255, 'n'), letters}) {
    OutputFile whole(folder / name);
    whole.write("whole");
    whole.commit();
    EXPECT_EQ(namesIn(folder.path()), std::set<std::string>{name});
    if (const pid_t killed = fork(); killed == 0) {
      OutputFile half(folder / name);
      _exit(0);
    } else {
      waitpid(killed, nullptr, 0);
    }
    EXPECT_EQ(namesIn(folder.path()).size(), 2u);
    for (const std::string& left : namesIn(folder.path()))
      EXPECT_TRUE(left == name || left.find('\xa4', 60) == std::string::npos) << "whole letters only: " << left;
    OutputFile::removeAbandoned(folder / (name.substr(0, name.size() - 2) + "oo"));
    EXPECT_EQ(namesIn(folder.path()).size(), 2u) << "of another name that begins so";
    OutputFile::removeAbandoned(folder / name);
    EXPECT_EQ(namesIn(folder.path()), std::set<std::string>{name});
    std::filesystem::remove(folder / name);
  }
}

/// In a container, the next process often has the same id as the process that was killed.
TEST(OutputFile, aTakenTemporaryNameIsNoObstacle) {
  support::TemporaryDirectory folder;
  unsigned next = 0;
  std::string beginning;
  {
    const OutputFile output(folder / "out");
    const std::string name = *namesIn(folder.path()).begin();
    beginning = name.substr(0, name.rfind('-') + 1);
    next = static_cast<unsigned>(std::stoul(name.substr(name.rfind('-') + 1))) + 1;
  }
  for (unsigned n = next; n < next + 3; ++n) writeAll(folder / (beginning + std::to_string(n)), "half");
  OutputFile output(folder / "out");
  output.write("whole");
  output.commit();
  EXPECT_EQ(readAll(folder / "out"), "whole");
  EXPECT_EQ(namesIn(folder.path()).size(), 4u);
}

}  // namespace checkpoint_test
}  // namespace hpsdf
