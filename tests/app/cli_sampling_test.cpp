// Tests `hpsdf jumps`, `export`, `contour` and `probe`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "cli_fixture.h"
#include "hpsdf/detail/cubic_grid.h"
#include "hpsdf/field_file.h"
#include "hpsdf/jumps.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/render/image.h"

namespace hpsdf::app {
namespace cli_sampling_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using Sampling = Cli;

TEST_F(Sampling, jumpsAreReportedAndListed) {
  const Outcome outcome = run({{"jumps", field(), "--json", "--worst", "3", "-o", at("jumps.csv")}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  const Jumps jumps = findJumps(load(field()));
  EXPECT_EQ(json.at("interfaces"), jumps.interfaces.size());
  EXPECT_EQ(json.at("hanging"), jumps.hanging);
  EXPECT_EQ(json.at("value").at("rms"), jumps.value.rms);
  EXPECT_EQ(json.at("gradient").at("max"), jumps.gradient.max);
  ASSERT_EQ(json.at("worst").size(), 3u);
  EXPECT_EQ(json.at("worst")[0].at("value").at("max"), jumps.value.max);
  std::size_t counted = 0;
  for (const Json& bin : json.at("value_histogram")) counted += bin.at("interfaces").get<std::size_t>();
  EXPECT_EQ(counted, jumps.interfaces.size());
  const std::string table = readFile(at("jumps.csv"));
  EXPECT_EQ(lineCount(table), jumps.interfaces.size() + 1);
  EXPECT_THAT(table, StartsWith("cell0,cell1,"));

  const Outcome byGradient = run({{"jumps", field(), "--json", "--worst", "1", "--by", "gradient"}});
  EXPECT_EQ(Json::parse(byGradient.out).at("worst")[0].at("gradient").at("max"), jumps.gradient.max);
  const Outcome text = run({{"jumps", field()}});
  EXPECT_THAT(text.out, AllOf(HasSubstr("value jump"), HasSubstr("▇"), HasSubstr("degrees, depths")));
  EXPECT_THAT(run({{"jumps", field(), "--worst", "0"}}).out, Not(HasSubstr("degrees, depths")));
  expectRefused({{"jumps", field(), "--by", "valeu"}}, "value");
  expectRefused({{"jumps", field(), "-o", field()}}, field(), {"jumps.csv"});
}

TEST_F(Sampling, contoursAreWrittenAsClosedMeshes) {
  const Outcome outcome = run({{"contour", field(), "-o", at("s.ply"), "--tolerance", "1%", "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  const ImportedMesh mesh = importMesh(at("s.ply"));
  EXPECT_TRUE(mesh.report.closed());
  EXPECT_EQ(json.at("triangles"), mesh.report.faces);
  EXPECT_EQ(json.at("vertices"), mesh.report.vertices);
  EXPECT_EQ(json.at("file_bytes"), readFile(at("s.ply")).size());
  const double tolerance = 0.01 * load(field()).domain().sizes().maxCoeff();
  EXPECT_NEAR(json.at("tolerance"), tolerance, 1e-12);
  EXPECT_LE(json.at("greatest_value"), tolerance);
  EXPECT_EQ(json.at("missed"), 0);
  EXPECT_TRUE(json.at("blended"));

  const Outcome text =
      run({{"contour", field(), "-o", at("grown.obj"), "--tolerance", "0.05", "--offset", "0.1", "--keep-jumps"}});
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(HasSubstr("vertices"), HasSubstr("a tolerance of 0.05"), Not(HasSubstr("blended"))));
  EXPECT_GT(signedVolume(importMesh(at("grown.obj")).mesh), signedVolume(mesh.mesh));

  const Outcome several = run({{"contour", field(), "-o", at("at{offset}.stl"), "--offset", "0", "--offset", "0.1",
                                "--resolution", "100", "--json"}});
  EXPECT_EQ(several.status, 0) << several.err;
  const Json surfaces = Json::parse(several.out).at("surfaces");
  ASSERT_EQ(surfaces.size(), 2u);
  EXPECT_EQ(surfaces[1].at("output"), at("at0.1.stl"));
  EXPECT_EQ(surfaces[1].at("offset"), 0.1);
  EXPECT_EQ(surfaces[0].at("tolerance"), json.at("tolerance"));
  EXPECT_TRUE(importMesh(at("at0.stl")).report.closed());
  EXPECT_GT(signedVolume(importMesh(at("at0.1.stl")).mesh), signedVolume(importMesh(at("at0.stl")).mesh));

  const std::set<std::string> before = namesIn(folder_.path());
  expectRefused({{"contour", field(), "-o", at("x.ply"), "--offset", "0", "--offset", "0.1"}}, "{offset}", before);
  expectRefused(
      {{"contour", field(), "-o", at("x{offset}.ply"), "--tolerance", "5%", "--offset", "0", "--offset", "-9"}},
      "no surface", before);
  expectRefused({{"contour", field(), "-o", at("x{offset}.ply"), "--offset", "1", "--offset", "1"}}, "given twice",
                before);
  expectRefused({{"contour", field(), "-o", at("x.stl"), "--tolerance", "1e-5"}}, "single-precision", before);
  expectRefused({{"contour", field(), "-o", at("x.ply"), "--tolerance", "1e-2", "--resolution", "100"}}, "excludes",
                before);
  expectRefused({{"contour", field(), "-o", at("x.stp")}}, "x.stp", before);
  expectRefused({{"contour", field(), "-o", at("x.ply"), "--tolerance", "0"}}, "--tolerance", before);
  expectRefused({{"contour", field(), "-o", at("x.ply"), "--offset", "-9"}}, "there is no surface", before);
  expectRefused({{"contour", field(), "-o", at("x.ply"), "--tolerance", "1e-9"}}, "allow a greater tolerance", before);
  expectRefused({{"contour", field(), "-o", at("none/x.ply")}}, "none/x.ply", before);
}

TEST_F(Sampling, contoursHaveTheColoursOfPictures) {
  const auto colored = [&](const std::string& file, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"contour", field(), "-o", at(file), "--tolerance", "1%", "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return run({.words = words});
  };
  const Outcome outcome = colored("degree.ply", {"--color", "degree"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(Json::parse(outcome.out).at("color").at("by"), "degree");
  const Field torus = load(field());
  EXPECT_EQ(Json::parse(outcome.out).at("color").at("levels").size(), statistics(torus).degreeVolume.size());
  ASSERT_EQ(colored("plain.ply", {}).status, 0);
  const std::size_t vertices = readMesh(at("plain.ply")).vertices.size();
  const std::size_t header = std::string_view("property uchar red\nproperty uchar green\nproperty uchar blue\n").size();
  EXPECT_EQ(readFile(at("degree.ply")).size(), readFile(at("plain.ply")).size() + 3 * vertices + header);

  const Outcome error = colored("error.glb", {"--color", "error", "--range", "1e-6,1e-3"});
  ASSERT_EQ(error.status, 0) << error.err;
  EXPECT_EQ(Json::parse(error.out).at("color").at("range"), Json({1e-6, 1e-3}));
  ASSERT_EQ(colored("other.glb", {"--color", "error", "--range", "1e-5,1e-3"}).status, 0);
  EXPECT_NE(readFile(at("error.glb")), readFile(at("other.glb")));
  EXPECT_THAT(run({{"contour", field(), "-o", at("e.glb"), "--tolerance", "1%", "--color", "slope"}}).out,
              ContainsRegex("colours +slope from [^ ]+ to [^ ]+, logarithmic"));

  const std::set<std::string> before = namesIn(folder_.path());
  expectRefused({{"contour", field(), "-o", at("x.stl"), "--color", "degree"}}, "no colours", before);
  expectRefused({{"contour", field(), "-o", at("x.ply"), "--range", "1,2"}}, "needs color", before);
  expectRefused({{"contour", field(), "-o", at("x.ply"), "--color", "degree", "--range", "1,2"}}, "range", before);
  expectRefused({{"contour", field(), "-o", at("x.ply"), "--color", "normal"}}, "color", before);
}

TEST_F(Sampling, cubicGridsAreExportedAndMeasured) {
  const Outcome outcome = run({{"export", field(), "-o", at("grid.cdf"), "--resolution", "20", "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  const Field torus = load(field());
  const GridResolution cells = cubicGridResolution(torus.domain(), 20);
  EXPECT_EQ(json.at("resolution"), Json(cells));
  EXPECT_EQ(json.at("file_bytes"), readFile(at("grid.cdf")).size());
  EXPECT_EQ(json.at("file_bytes").get<double>(), cubicGridBytes(cells));
  const CubicGrid grid = sampleCubicGrid(torus, cells);
  const CubicGridError error = measureCubicGrid(grid, torus, 100000);
  EXPECT_EQ(json.at("difference").at("points"), 100000);
  EXPECT_EQ(json.at("difference").at("rms"), error.everywhere.rms);
  EXPECT_EQ(json.at("difference").at("max"), error.everywhere.max);
  EXPECT_EQ(json.at("difference_near").at("points"), error.nearSurface.points);
  EXPECT_EQ(json.at("difference_near").at("rms"), error.nearSurface.rms);
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("grid.cdf"));

  const Outcome text = run({{"export", field(), "-o", at("grid.cdf"), "--max-bytes", "1e6"}});
  EXPECT_THAT(text.out, AllOf(HasSubstr("cubic cells"), HasSubstr("beside the field       RMS"),
                              HasSubstr("random points within")));
  EXPECT_LE(readFile(at("grid.cdf")).size(), 1000000u);
  EXPECT_GT(readFile(at("grid.cdf")).size(), 700000u);
  ASSERT_EQ(run({{"export", field(), "-o", at("box.cdf"), "--resolution", "3,4,5"}}).status, 0);
  EXPECT_EQ(double(readFile(at("box.cdf")).size()), cubicGridBytes({3, 4, 5}));

  const std::set<std::string> before = {"box.cdf", "grid.cdf"};
  expectRefused({{"export", field(), "-o", at("x.obj")}}, "expected .cdf", before);
  expectRefused({{"export", field(), "-o", at("x.cdf"), "--resolution", "3,4"}}, "resolution", before);
  expectRefused({{"export", field(), "-o", at("x.cdf"), "--resolution", "9", "--max-bytes", "1e6"}}, "excludes",
                before);
  expectRefused({{"export", field(), "-o", at("x.cdf"), "--resolution", "225"}},
                "takes 2148 MB as a file, of which Bullet's loader reads 2147 at most", before);
  expectRefused({{"export", field(), "-o", at("x.cdf"), "--resolution", "1e7,1e7,1e7"}}, "give fewer cells", before);
  expectRefused({{"export", field(), "-o", at("x.cdf"), "--max-bytes", "559"}}, "560 at least", before);
  expectRefused({{"export", at("none.hpsdf"), "-o", at("x.cdf")}}, "none.hpsdf", before);
  expectRefused({{"export", field(), "-o", at("none/x.cdf")}}, "none/x.cdf", before);
}

/// Returns the rows of a CSV file, beginning with the header.
std::vector<std::vector<std::string>> tableOf(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    rows.emplace_back();
    std::istringstream words(line + ",");
    for (std::string word; std::getline(words, word, ',');) rows.back().push_back(word);
  }
  return rows;
}

TEST_F(Sampling, probeListsBothSidesOfEachBorder) {
  const Outcome outcome = run({{"probe", field(), "--from", "-2,0.1,0.05", "--to", "0.9,0.1,0.05", "-o", at("line.csv"),
                                "--samples", "50", "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto rows = tableOf(readFile(at("line.csv")));
  const std::vector<std::string> header = {"t",     "s",     "x",     "y",  "z",  "cell", "degree",     "depth",
                                           "value", "exact", "error", "gx", "gy", "gz",   "slope_along"};
  EXPECT_EQ(rows[0], header);
  const Field torus = load(field());
  std::size_t outside = 0, borders = 0, inner = 0;
  double greatestJump = 0, greatestError = 0;
  for (std::size_t n = 1; n < rows.size(); ++n) {
    ASSERT_EQ(rows[n].size(), header.size());
    const auto number = [&](std::size_t column, std::size_t row) { return std::stod(rows[row][column]); };
    const Vector3 x(number(2, n), number(3, n), number(4, n));
    EXPECT_NEAR(number(1, n), 2.9 * number(0, n), 1e-12);
    EXPECT_EQ(number(10, n), number(8, n) - number(9, n)) << "a built-in shape is known";
    greatestError = std::max(greatestError, std::abs(number(10, n)));
    const bool border = n > 1 && rows[n][0] == rows[n - 1][0];
    if (border) {
      ++borders;
      EXPECT_NE(rows[n][5], rows[n - 1][5]);
      if (!rows[n - 1][5].empty()) greatestJump = std::max(greatestJump, std::abs(number(8, n) - number(8, n - 1)));
    } else if (n + 1 < rows.size() && rows[n][0] != rows[n + 1][0]) {
      ++inner;
      const ValueAndGradient expected = torus.valueAndGradient(x);
      EXPECT_EQ(number(8, n), expected.value);
      EXPECT_EQ(number(11, n), expected.gradient.x());
      EXPECT_NEAR(number(14, n), expected.gradient.x(), 1e-14) << "along x";
    }
    outside += rows[n][5].empty();
  }
  EXPECT_GT(borders, 4u);
  EXPECT_GT(outside, 4u) << "the domain begins at x = -1.1";
  EXPECT_GT(inner, 40u);
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json.at("samples"), rows.size() - 1);
  EXPECT_EQ(json.at("cells"), borders);
  EXPECT_EQ(std::abs(json.at("greatest_jump").at("value").get<double>()), greatestJump);
  EXPECT_EQ(json.at("greatest_error"), greatestError);
}

TEST_F(Sampling, probeIsDrawn) {
  const std::vector<std::string> line = {"probe", field(), "--from", "-0.9,0,0", "--to", "0.9,0.1,0.2"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), line.begin(), line.end());
    return run({more});
  };
  const Outcome drawn = with({"-o", at("line.png"), "--size", "320x240"});
  ASSERT_EQ(drawn.status, 0) << drawn.err;
  EXPECT_THAT(drawn.out, AllOf(HasSubstr("line.png: "), HasSubstr("greatest jump"), HasSubstr("greatest error")));
  const render::Image image = render::loadPng(at("line.png"));
  EXPECT_EQ(image.width, 320);
  EXPECT_EQ(image.height, 240);
  const Outcome script = run({{"run", "-e",
                               "load \"" + field() + "\"; probe from=-0.9,0,0 to=0.9,0.1,0.2 size=320x240 output=\"" +
                                   at("script.png") + "\""}});
  ASSERT_EQ(script.status, 0) << script.err;
  EXPECT_EQ(render::loadPng(at("script.png")).pixels, image.pixels);

  expectRefused({{"probe", field(), "--from", "0,0,0", "-o", at("x.png")}}, "--to is missing");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "0,0", "-o", at("x.png")}}, "to");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "0,0,nan", "-o", at("x.png")}}, "nan");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "0,0,0", "-o", at("x.png")}}, "give two points");
  expectRefused({{"probe", field(), "--from", "5,0,0", "--to", "5,1,0", "-o", at("x.png")}}, "does not meet");
  expectRefused({{"probe", field(), "--from", "-1e308,0,0", "--to", "1e308,1,0", "-o", at("x.csv")}}, "too far");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "1,0,0", "-o", at("x.pfm")}}, "expected .png");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "1,0,0", "-o", at("x.csv"), "--size", "64x64"}},
                "leave it out");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "1,0,0", "-o", at("none/x.csv")}}, "none/x.csv");
}

TEST_F(Sampling, probeNeedsNoExactDistance) {
  writeFile(at("t.obj"), kTetrahedron);
  ASSERT_EQ(run({{"build", at("t.obj"), "-o", at("t.hpsdf"), "--target-error", "1e-2"}}).status, 0);
  const auto rowsWith = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"probe", at("t.hpsdf"), "--from", "0,0,0", "--to", "1,1,1", "-o", at("line.csv")};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run({words});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.out.find("greatest error") == std::string::npos, more.empty());
    return tableOf(readFile(at("line.csv")));
  };
  const auto without = rowsWith({}), with = rowsWith({"--mesh", at("t.obj")});
  ASSERT_EQ(without.size(), with.size());
  for (std::size_t n = 1; n < with.size(); ++n) {
    EXPECT_EQ(without[n][9] + without[n][10], "");
    EXPECT_FALSE(with[n][9].empty() || with[n][10].empty());
    EXPECT_EQ(without[n][8], with[n][8]);
  }
  const std::string probe = "; probe from=0,0,0 to=1,1,1 output=\"" + at("script.csv") + "\"";
  ASSERT_EQ(run({{"run", "-e", "build \"" + at("t.obj") + "\" target-error=1e-2" + probe}}).status, 0);
  EXPECT_EQ(tableOf(readFile(at("script.csv"))), with) << "the mesh is still at hand";
}

}  // namespace cli_sampling_test
}  // namespace hpsdf::app
