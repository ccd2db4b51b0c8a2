// The pictures that README and docs show are what their script makes today.

#include <gtest/gtest.h>

#include <filesystem>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "hpsdf/render/image.h"
#include "program.h"
#include "support/compare_pictures.h"
#include "support/require_gl.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace {

constexpr const char* kBunny = "/usr/share/glmark2/models/bunny.obj";
constexpr double kBudget = 0.002;  // pixels at cell edges and silhouettes, where low bits differ between processors

void run(const std::vector<std::string>& words) {
  std::istringstream in;
  std::ostringstream out, err;
  ASSERT_EQ(runProgram(words, Console{in, out, err}), kExitDone) << err.str();
}

TEST(Gallery, PicturesAreWhatTheirScriptMakes) {
  HPSDF_REQUIRE_GL();
  if (!std::filesystem::exists(kBunny)) GTEST_SKIP() << kBunny << " is not installed (package glmark2-data)";
  const std::filesystem::path root = HPSDF_SOURCE_DIR;
  const support::TemporaryDirectory folder;
  run({"run", root / "screenshots/scripts/gallery.hps", std::string("mesh=") + kBunny,
       "out=" + folder.path().string()});
  int compared = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    const std::filesystem::path name = entry.path().filename();
    const render::Image baseline = render::loadPng(root / "screenshots/gallery" / name);
    const render::Image actual = render::loadPng(entry.path());
    EXPECT_EQ(support::pictureProblem(baseline, actual, kBudget), "") << name;
    ++compared;
  }
  EXPECT_EQ(compared, std::distance(std::filesystem::directory_iterator(root / "screenshots/gallery"), {}));
}

/// Slightly wrong pictures must not pass: the slice next door, another camera by a degree, a level of another colour.
TEST(Gallery, WrongPicturesAreNoticed) {
  HPSDF_REQUIRE_GL();
  const support::TemporaryDirectory folder;
  const auto make = [&](const std::string& look) {
    const std::filesystem::path file = folder / "picture.png";
    run({"run", "-e", "build builtin:torus target-error=1e-5; " + look + " gl=software output=" + file.string()});
    return render::loadPng(file);
  };
  const render::Image slice = make("slice color=degree size=480x270");
  EXPECT_EQ(support::pictureProblem(slice, make("slice color=degree size=480x270"), kBudget), "");
  EXPECT_NE(support::pictureProblem(slice, make("slice color=degree size=480x270 offset=0.02"), kBudget), "");
  EXPECT_NE(support::pictureProblem(slice, make("slice color=depth size=480x270"), kBudget), "");
  EXPECT_NE(support::pictureProblem(slice, make("slice color=degree size=480x269"), kBudget), "");
  const render::Image surface = make("render size=480x270 camera=30,20,1.1");
  EXPECT_NE(support::pictureProblem(surface, make("render size=480x270 camera=31,20,1.1"), kBudget), "");
}

}  // namespace
}  // namespace hpsdf::app
