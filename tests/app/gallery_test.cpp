// Tests that the pictures in README and docs equal what their scripts draw; slightly wrong pictures must fail.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "outcome.h"
#include "support/require_gl.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace gallery_test {

constexpr const char* kBunny = "/usr/share/glmark2/models/bunny.obj";

TEST(Gallery, picturesAreWhatTheirScriptsMake) {
  HPSDF_REQUIRE_GL();
  if (!std::filesystem::exists(kBunny)) GTEST_SKIP() << kBunny << " is not installed (package glmark2-data)";
  const support::TemporaryDirectory folder;
  const std::vector<std::string> words = {"check", HPSDF_SOURCE_DIR "/screenshots", std::string("mesh=") + kBunny,
                                          "--out", folder.path() / "results"};
  const Outcome outcome = runHere(words);
  EXPECT_EQ(outcome.status, kExitDone) << outcome.out << outcome.err;
}

}  // namespace gallery_test
}  // namespace hpsdf::app
