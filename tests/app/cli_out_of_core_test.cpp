// Tests `hpsdf build --out-of-core`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "cli_fixture.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/shapes.h"

namespace hpsdf::app {
namespace cli_out_of_core_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using testing::HasSubstr;

class OutOfCore : public Cli {
 protected:
  void SetUp() override {
    fs::create_directory(at("parts"));
    saveMesh(shapes::mesh("structured-bowl,cells=30"), at("bowl.ply"));
  }
  Call build(const std::string& mesh, const std::string& output, const std::vector<std::string>& more = {}) const {
    Call call{
        {"build", mesh, "-o", at(output), "--target-error", "1e-4", "--strategy", "hp", "--estimator", "embedded"}};
    call.words.insert(call.words.end(), more.begin(), more.end());
    return call;
  }
};

TEST_F(OutOfCore, TheOctreeIsThatOfTheMeshInMemory) {
  const Outcome onDisk = run(build(at("bowl.ply"), "disk.hpsdf", {"--out-of-core", at("parts")}));
  ASSERT_EQ(onDisk.status, 0) << onDisk.err;
  EXPECT_THAT(onDisk.err, HasSubstr("faces in"));
  ASSERT_EQ(run(build(at("bowl.ply"), "memory.hpsdf")).status, 0);
  const Field disk = load(at("disk.hpsdf")), memory = load(at("memory.hpsdf"));
  ASSERT_EQ(statistics(disk).leaves, statistics(memory).leaves);
  EXPECT_EQ(disk.metadata().source.fingerprint, memory.metadata().source.fingerprint);
  for (const double x : {-0.9, -0.5, 0.0, 0.3, 0.8})
    for (const double z : {-0.4, 0.0, 0.4}) EXPECT_EQ(disk.value({x, 0.1, z}), memory.value({x, 0.1, z}));
}

TEST_F(OutOfCore, TakesTheMeshOfAnyFormat) {
  saveMesh(shapes::mesh("structured-bowl,cells=30"), at("bowl.obj"));
  for (const std::string& mesh : {at("bowl.obj"), std::string("builtin:structured-bowl,cells=30")}) {
    const Outcome outcome = run(build(mesh, "f.hpsdf", {"--out-of-core", at("parts"), "--memory-limit", "50000000"}));
    EXPECT_EQ(outcome.status, 0) << outcome.err;
  }
}

TEST_F(OutOfCore, RefusesWhatNeedsTheMeshInMemory) {
  const std::vector<std::string> there = {"--out-of-core", at("parts")};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), there.begin(), there.end());
    return build(at("bowl.ply"), "f.hpsdf", more);
  };
  expectRefused(with({"--sign", "winding"}), "pseudonormals");
  expectRefused(with({"--normalize"}), "normalize");
  expectRefused(with({"--bounds"}), "nothing is proven");
  expectRefused(build("analytic:torus", "f.hpsdf", there), "has no mesh");
  expectRefused(build(at("bowl.ply"), "f.hpsdf", {"--out-of-core", at("none")}), "is not a folder");
  expectRefused({{"build", "--batch", at("list"), "-o", at("fields"), "--out-of-core", at("parts")}}, "out-of-core");
}

TEST_F(OutOfCore, RefusesMeshesThatMustBeRepairedFirst) {
  TriangleMesh open = shapes::mesh("torus,segments=20,sides=10");
  open.triangles.pop_back();
  saveMesh(open, at("open.ply"));
  expectRefused(build(at("open.ply"), "f.hpsdf", {"--out-of-core", at("parts")}), "hole");
  EXPECT_TRUE(fs::is_empty(at("parts")));
}

}  // namespace cli_out_of_core_test
}  // namespace hpsdf::app
