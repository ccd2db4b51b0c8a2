// Tests `hpsdf export` to grids for other programs, and `hpsdf build` from such grids. tests/clients has what these
// programs say about the files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "cli_fixture.h"
#include "hpsdf/field_file.h"
#include "hpsdf/input/grid_distance.h"

namespace hpsdf::app {
namespace cli_grid_test {

using namespace cli;
using Grids = Cli;

/// Returns true if the program was built with OpenVDB.
bool hasOpenVdb(const std::string& field, const std::string& file) {
  return run({{"export", field, "-o", file, "--voxel", "0.1"}}).status == 0;
}

TEST_F(Grids, areExportedByTheExtension) {
  const Outcome outcome = run({{"export", field(), "-o", at("grid.vti"), "--resolution", "9,10,11", "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json.at("output"), at("grid.vti"));
  EXPECT_EQ(json.at("file_bytes"), readFile(at("grid.vti")).size());
  EXPECT_EQ(json.at("points"), Json({10, 11, 12}));
  const Field torus = load(field());
  EXPECT_EQ(json.at("origin")[0], torus.domain().min().x());
  const RegularGrid grid = loadGrid(at("grid.vti"));
  EXPECT_EQ(grid.layout.points, (std::array<std::uint32_t, 3>{10, 11, 12}));
  EXPECT_EQ(grid.values[5], float(torus.value(grid.layout.position(5, 0, 0))));

  ASSERT_EQ(run({{"export", field(), "-o", at("grid.NPY"), "--voxel", "10%", "--gradients", "--double"}}).status, 0);
  const double voxel = 0.1 * torus.domain().sizes().maxCoeff();
  const Vector3 first = voxel * (torus.domain().min() / voxel).array().ceil();
  EXPECT_NEAR(loadGrid(at("grid.NPY")).values.front(), torus.value(first), 1e-12);
  EXPECT_THAT(run({{"export", field(), "-o", at("leaves.vtu")}}).out, HasSubstr("leaves as voxels"));
  EXPECT_THAT(run({{"export", field(), "-o", at("leaves.vtu"), "--order", "3"}}).out, HasSubstr("up to order 3"));
}

TEST_F(Grids, refuseWhatHasNoEffectOrDoesNotFit) {
  expectRefused({{"export", field(), "-o", at("x.vti"), "--band", "3"}}, "band has no effect on a .vti", {});
  expectRefused({{"export", field(), "-o", at("x.vtu"), "--voxel", "0.1"}}, "voxel has no effect on a .vtu", {});
  expectRefused({{"export", field(), "-o", at("x.cdf"), "--double"}}, "double has no effect on a .cdf", {});
  expectRefused({{"export", field(), "-o", at("x.vti"), "--voxel", "0.1", "--resolution", "9"}}, "excludes", {});
  expectRefused({{"export", field(), "-o", at("x.vti"), "--voxel", "1e-6"}}, "give larger voxels", {});
  expectRefused({{"export", field(), "-o", at("x.npy"), "--voxel", "1e-320"}},
                "voxel: the box has more than 1073741824 voxels along an axis; give larger voxels", {});
  expectRefused({{"export", field(), "-o", at("x.npy"), "--resolution", "1e7"}}, "give larger voxels", {});
  expectRefused({{"export", field(), "-o", at("x.vtu"), "--order", "11"}}, "order", {});
  expectRefused({{"export", field(), "-o", at("none/x.vti")}}, "none/x.vti", {});
}

TEST_F(Grids, ofFormatsThatAreOnlyWrittenAreRefused) {
  for (const std::string name : {"x.vtu", "x.nvdb", "x.CDF"}) {
    writeFile(at(name), "grid");
    for (const std::vector<std::string>& words : {std::vector<std::string>{"build", at(name), "-o", at("x.hpsdf")},
                                                  {"combine", "offset(" + at(name) + ", 1)", "-o", at("x.hpsdf")},
                                                  {"query", "--closest", at(name), "0,0,0"}})
      expectRefused({words}, "the grids that it reads are .vdb, .vti and .npy", {name});
    fs::remove(at(name));
  }
}

TEST_F(Grids, ofVtkAndNumPyBecomeFields) {
  for (const std::string name : {"grid.vti", "grid.npy"}) {
    SCOPED_TRACE(name);
    ASSERT_EQ(run({{"export", field(), "-o", at(name), "--voxel", "0.05"}}).status, 0);
    std::vector<std::string> words = {"build", at(name), "-o", at("again.hpsdf"), "--target-error", "1e-4"};
    if (name == "grid.npy") {
      const Json report = Json::parse(run({{"export", field(), "-o", at(name), "--voxel", "0.05", "--json"}}).out);
      const auto& x = report.at("origin");
      words.insert(words.end(),
                   {"--spacing", "0.05", "--origin=" + x[0].dump() + "," + x[1].dump() + "," + x[2].dump()});
    }
    const Outcome built = run({words});
    ASSERT_EQ(built.status, 0) << built.err;
    EXPECT_THAT(built.err, HasSubstr("leaving samples out suggests an error of RMS"));
    EXPECT_THAT(built.out, HasSubstr("measured: near the surface RMS"));
    const Field torus = load(field()), again = load(at("again.hpsdf"));
    for (const Vector3& x : {Vector3(0.7, 0, 0.2), Vector3(0, -0.9, 0), Vector3(0.5, 0.5, 0.1)})
      EXPECT_NEAR(again.value(x), torus.value(x), 0.02) << x.transpose();
    EXPECT_EQ(again.metadata().source.name, name);
  }
  // A note tells of a domain that reaches beyond the samples.
  const auto notes = [&](const std::string& domain) {
    return run({{"build", at("grid.vti"), "-o", at("wide.hpsdf"), "--max-steps", "8", "--domain", domain}}).err;
  };
  EXPECT_THAT(notes("-3,-1,-1,1,1,1"), AllOf(HasSubstr("the domain reaches beyond the grid's samples"),
                                             HasSubstr(": --domain -1.1,-1,-1,1,1,1 ends where the samples do")));
  EXPECT_THAT(notes("-1,-1,-1,1.1,1,1"), Not(HasSubstr("beyond the grid")));

  ASSERT_EQ(run({{"export", field(), "-o", at("unit.npy"), "--resolution", "20"}}).status, 0);
  const Outcome unit = run({{"build", at("unit.npy"), "-o", at("unit.hpsdf"), "--target-error", "1e-2"}});
  EXPECT_EQ(unit.status, 0) << unit.err;
  EXPECT_THAT(unit.err, HasSubstr("--spacing gives another one"));
}

TEST_F(Grids, ofOpenVdbBecomeFields) {
  if (!hasOpenVdb(field(), at("grid.vdb"))) GTEST_SKIP() << "built without OpenVDB";
  const Outcome exported = run({{"export", field(), "-o", at("grid.vdb"), "--voxel", "0.04", "--json"}});
  ASSERT_EQ(exported.status, 0) << exported.err;
  const Json json = Json::parse(exported.out);
  EXPECT_EQ(json.at("voxel"), 0.04);
  EXPECT_EQ(json.at("band"), 3);
  EXPECT_GT(json.at("active_voxels"), 1000);
  const Outcome built = run({{"build", at("grid.vdb"), "-o", at("again.hpsdf"), "--target-error", "1e-5"}});
  ASSERT_EQ(built.status, 0) << built.err;
  const Field torus = load(field()), again = load(at("again.hpsdf"));
  for (const Vector3& x : {Vector3(0.7, 0, 0.2), Vector3(0, -0.9, 0), Vector3(0.5, 0.5, 0.1), Vector3(0, 0, 0.9)})
    EXPECT_NEAR(again.value(x), torus.value(x), 0.02) << x.transpose();
  ASSERT_EQ(run({{"export", field(), "-o", at("grid.nvdb"), "--voxel", "0.04"}}).status, 0);
  EXPECT_THAT(readFile(at("grid.nvdb")), StartsWith("NanoVDB"));

  const std::set<std::string> before = namesIn(folder_.path());
  expectRefused({{"export", field(), "-o", at("x.vdb"), "--voxel", "1e-7"}}, "give larger voxels", before);
  expectRefused({{"export", field(), "-o", at("x.nvdb"), "--voxel", "1e-320"}}, "give larger voxels", before);
  expectRefused({{"export", field(), "-o", at("x.vdb"), "--voxel", "1e308"}}, "give smaller voxels", before);
  expectRefused({{"export", field(), "-o", at("x.vdb"), "--band", "0"}}, "band", before);
  const std::string whole = readFile(at("grid.vdb"));
  writeFile(at("cut.vdb"), whole.substr(0, whole.size() / 2));
  expectRefused({{"build", at("cut.vdb"), "-o", at("x.hpsdf")}},
                "cut.vdb: the OpenVDB file is damaged or ends too early");
}

TEST_F(Grids, thatAreDamagedOrForeignAreRefused) {
  const auto refused = [&](const std::string& name, const std::string& bytes, const std::string& message) {
    writeFile(at(name), bytes);
    expectRefused({{"build", at(name), "-o", at("x.hpsdf")}}, message);
  };
  refused("foreign.npy", "nothing", "foreign.npy: this is no array of NumPy");
  refused("foreign.vti", "nothing", "foreign.vti: this is no file of VTK in XML");
  refused("empty.vti", "", "the file is empty");
  expectRefused({{"build", at("none.vti"), "-o", at("x.hpsdf")}}, "no such file");
  ASSERT_EQ(run({{"export", field(), "-o", at("whole.vti"), "--resolution", "9"}}).status, 0);
  const std::string whole = readFile(at("whole.vti"));
  refused("cut.vti", whole.substr(0, whole.size() / 2), "ends within the array");
  expectRefused({{"build", at("whole.vti"), "-o", at("x.hpsdf"), "--spacing", "2"}}, "leave them out");
  expectRefused({{"build", at("whole.vti"), "-o", at("x.hpsdf"), "--sign", "winding"}}, "a grid has a sign of its own");
  expectRefused({{"build", at("whole.vti"), "-o", at("x.hpsdf"), "--bounds"}}, "nothing is proven");
  expectRefused({{"mesh", at("whole.vti")}}, "a grid has no mesh");
  expectRefused({{"verify", field(), at("whole.vti")}}, "a grid has no mesh");
}

}  // namespace cli_grid_test
}  // namespace hpsdf::app
