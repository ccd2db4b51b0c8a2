#pragma once
// The test fixture for tests that start the program as a user does.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "started_program.h"
#include "support/temporary_directory.h"

namespace hpsdf::app::cli {

namespace fs = std::filesystem;
using Json = nlohmann::json;  // sorts keys, so that equality does not depend on the order of the output
using Clock = std::chrono::steady_clock;
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

inline constexpr std::string_view kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

/// Each test has a folder of its own; the tests of a suite share a small field, which the program builds once.
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

  /// Expects that the call is refused as bad input: status 2, one line of error that contains `message`, nothing on
  /// standard output, and no files besides `before`.
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

}  // namespace hpsdf::app::cli
