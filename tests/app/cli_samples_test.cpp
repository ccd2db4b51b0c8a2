// Tests `hpsdf sample` and `hpsdf query --closest`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <sstream>

#include "cli_fixture.h"
#include "commands/point_query.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"

namespace hpsdf::app {
namespace cli_samples_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using Samples = Cli;

/// Returns the rows of a table of numbers, without its header.
std::vector<std::vector<double>> rowsOf(const std::string& table) {
  std::istringstream lines(table);
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(std::stod(cell));
  }
  return rows;
}

std::vector<std::string> withCounts(std::vector<std::string> words) {
  for (const char* word : {"--surface", "40", "--edge", "30", "--near", "20", "--uniform", "10"})
    words.emplace_back(word);
  return words;
}

TEST_F(Samples, ofAMeshAreItsExactDistances) {
  const Outcome outcome = run({withCounts({"sample", "builtin:gear", "-o", at("s.csv"), "--double", "--json"})});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json.at("points"), 100);
  EXPECT_EQ(json.at("surface"), 40);
  EXPECT_EQ(json.at("edge"), 30);
  EXPECT_EQ(json.at("near"), 20);
  EXPECT_EQ(json.at("uniform"), 10);
  EXPECT_EQ(json.at("file_bytes"), readFile(at("s.csv")).size());
  const std::string table = readFile(at("s.csv"));
  EXPECT_THAT(table, StartsWith("x,y,z,distance,gx,gy,gz,kind,px,py,pz,face,nx,ny,nz\n"));
  const ExactDistance exact(loadMesh("builtin:gear"));
  const auto rows = rowsOf(table);
  ASSERT_EQ(rows.size(), 100u);
  std::size_t inside = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i][3], exact({rows[i][0], rows[i][1], rows[i][2]}));
    EXPECT_EQ(rows[i][7], i < 40 ? 0 : i < 70 ? 1 : i < 90 ? 2 : 3);
    inside += rows[i][3] < 0;
  }
  EXPECT_EQ(json.at("inside"), inside);

  const Outcome text = run({withCounts({"sample", "builtin:gear", "-o", at("s.npz"), "--unit-sphere"})});
  EXPECT_THAT(text.out, AllOf(StartsWith(at("s.npz") + ": 100 points, "),
                              HasSubstr("40 on the surface, 30 on sharp edges"), HasSubstr("unit sphere")));
}

TEST_F(Samples, areTheSameForAnyNumberOfThreads) {
  for (const char* name : {"s.npz", "s.ply", "s.csv"}) {
    ASSERT_EQ(run({withCounts({"sample", "builtin:gear", "-o", at(name), "--threads", "1"})}).status, 0);
    const std::string one = readFile(at(name));
    ASSERT_EQ(run({withCounts({"sample", "builtin:gear", "-o", at(name), "--threads", "4"})}).status, 0);
    EXPECT_EQ(readFile(at(name)), one) << name;
    ASSERT_EQ(run({withCounts({"sample", "builtin:gear", "-o", at(name), "--seed", "2"})}).status, 0);
    EXPECT_NE(readFile(at(name)), one) << name;
  }
}

TEST_F(Samples, ofAFieldAreItsValues) {
  const Field torus = load(field());
  for (const bool withMesh : {false, true}) {
    std::vector<std::string> words = {"sample", field()};
    if (withMesh) words.emplace_back("builtin:torus");
    for (const char* word : {"--double", "--surface", "50", "--near", "50", "--uniform", "50", "-o"})
      words.emplace_back(word);
    words.push_back(at("s.csv"));
    const Outcome outcome = run({words});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const std::string table = readFile(at("s.csv"));
    EXPECT_THAT(table, StartsWith("x,y,z,distance,gx,gy,gz,kind\n"));
    const auto rows = rowsOf(table);
    ASSERT_EQ(rows.size(), 150u);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_EQ(rows[i][3], torus.value({rows[i][0], rows[i][1], rows[i][2]}));
      EXPECT_LT(std::abs(rows[i][3]), i < 50 ? 0.02 : 9) << "surface points are near the surface";
    }
  }
}

TEST_F(Samples, inDeepSdfsLayoutHaveNoSurfacePointsUnlessAskedFor) {
  const auto pointsOf = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"sample",  "builtin:gear", "-o",     at("d.npz"), "--layout",
                                      "deepsdf", "--json",       "--near", "60"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run({words});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return Json::parse(outcome.out).at("points").get<int>();
  };
  EXPECT_EQ(pointsOf({"--uniform", "40"}), 100);
  EXPECT_EQ(pointsOf({"--uniform", "40", "--surface", "7"}), 107);
}

TEST_F(Samples, refuseBadInput) {
  const auto expectBad = [&](const std::vector<std::string>& words, const std::string& message) {
    expectRefused({words}, message);
    EXPECT_THAT(namesIn(folder_.path()), IsEmpty()) << words.back();
  };
  const std::string npz = at("x.npz");
  expectBad({"sample", "builtin:gear", "-o", at("x.txt")}, "samples are written as .npz, .ply or .csv");
  expectBad({"sample", "builtin:gear", "-o", at("x.ply"), "--layout", "deepsdf"},
            "DeepSDF's layout is one of .npz files");
  expectBad({"sample", "builtin:gear", "-o", at("none/x.npz")}, "none/x.npz");
  expectBad({"sample", "builtin:gear"}, "--output is missing");
  expectBad({"sample", "-o", npz}, "source is missing");
  expectBad({"sample", "builtin:gear", "-o", npz, "--surface", "4e9"}, "ask for fewer points");
  expectBad({"sample", "builtin:gear", "-o", npz, "--surface", "1e18"}, "--surface");
  expectBad({"sample", "builtin:gear", "-o", npz, "--near", "-1"}, "--near");
  expectBad({"sample", "builtin:gear", "-o", npz, "--near", "nan"}, "--near");
  for (const char* widths : {"inf", "nan", "0", "-0.1", "0.1,inf", "0.1,nan", "1e999", "0.1,0.2,0.3"})
    expectBad({"sample", "builtin:gear", "-o", npz, "--widths", widths}, "--widths");
  expectBad({"sample", "builtin:gear", "-o", npz, "--enlargement", "inf"}, "--enlargement");
  expectBad({"sample", "builtin:gear", "-o", npz, "--sharp-angle", "200"}, "--sharp-angle");
  expectBad({"sample", "builtin:gear", "-o", npz, "--surface", "0", "--near", "0", "--uniform", "0"},
            "no points are asked for");
  expectBad({"sample", "builtin:sphere", "-o", npz, "--edge", "5"}, "edge: the surface has no edge");
  expectBad({"sample", "analytic:sphere", "-o", npz}, "an analytic shape has no mesh");
  expectBad({"sample", at("none.obj"), "-o", npz}, "none.obj: no such file");
  expectBad({"sample", at("none.xyz"), "-o", npz}, "none.xyz: no such file");
  expectBad({"sample", "builtin:gear", "builtin:torus", "-o", npz}, "give the field first");
  expectBad({"sample", field(), "-o", npz, "--sign", "winding"}, "sign: applies to meshes only");
  expectBad({"sample", "builtin:gear", "-o", npz, "--thickness", "0.1"}, "thickness");
}

// --- Closest points

TEST_F(Samples, queryFindsClosestPoints) {
  const std::string points = "x,y,z\n0.1,0.2,0.3\n5 5 5\n0 0 0\n";
  const Outcome outcome = run({{"query", "--closest", "builtin:box,width=2,height=2,depth=2"}, points});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  std::istringstream lines(outcome.out);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "x,y,z,distance,px,py,pz,face,feature,k,b0,b1,b2,winding");
  std::getline(lines, line);
  EXPECT_THAT(line, ContainsRegex("^0.1,0.2,0.3,-0.7,0.1,0.2,1,[0-9]+,face,0,[0-9.]+,[0-9.]+,[0-9.]+,1$"));
  std::getline(lines, line);
  EXPECT_THAT(line, ContainsRegex("^5,5,5,6.9282032302755[0-9]+,1,1,1,[0-9]+,vertex,[012],[01],[01],[01],0$"));

  const Outcome json = run({{"query", "--closest", "builtin:gear", "--json"}, points});
  const Json answers = Json::parse(json.out);
  ASSERT_EQ(answers.size(), 3u);
  const TriangleMesh gear = loadMesh("builtin:gear");
  const ExactDistance exact(gear);
  for (const Json& answer : answers) {
    const Vector3 x(answer.at("x"), answer.at("y"), answer.at("z"));
    const ClosestPoint closest = exact.closestPoint(x);
    EXPECT_EQ(answer.at("distance"), closest.signedDistance);
    EXPECT_EQ(answer.at("face"), closest.triangle);
    EXPECT_EQ(answer.at("px"), closest.point.x());
    EXPECT_EQ(answer.at("b1"), closest.barycentric[1]);
    EXPECT_EQ(answer.at("winding"), exact.windingNumber(x));
    EXPECT_EQ(answer.at("feature"), closest.feature == Feature::face   ? "face"
                                    : closest.feature == Feature::edge ? "edge"
                                                                       : "vertex");
  }
}

TEST_F(Samples, queryTakesPointsBesideAMeshOrAField) {
  const std::string header = "x,y,z,distance,px";
  writeFile(at("p.txt"), "0.1 0.2 0.3\n");
  const std::string expected = run({{"query", "--closest", "builtin:torus"}, "0.1 0.2 0.3\n"}).out;
  EXPECT_THAT(expected, StartsWith(header));
  EXPECT_EQ(run({{"query", "--closest", "builtin:torus", "0.1,0.2,0.3"}}).out, expected);
  EXPECT_EQ(run({{"query", "--closest", "builtin:torus", at("p.txt")}}).out, expected);
  EXPECT_EQ(run({{"query", field(), at("p.txt"), "--closest", "builtin:torus"}}).out, expected);
  EXPECT_EQ(run({{"query", field(), "0.1,0.2,0.3", "--closest", "builtin:torus"}}).out, expected);
  EXPECT_EQ(run({{"query", "0.1,0.2,0.3", "--closest", "builtin:torus", "-o", at("c.csv")}}).err,
            at("c.csv") + ": 1 point\n");
  EXPECT_EQ(readFile(at("c.csv")), expected);
  const std::set<std::string> before = {"c.csv", "p.txt"};
  expectRefused({{"query", "--closest", "analytic:torus", "0,0,0"}}, "an analytic shape has no mesh", before);
  expectRefused({{"query", "--closest", at("none.obj"), "0,0,0"}}, "none.obj: no such file", before);
  expectRefused({{"query", "--closest", "builtin:torus", at("none.txt")}}, "none.txt: no such file", before);
  expectRefused({{"query", "--closest", "builtin:torus", "0,0"}}, "expected three finite numbers", before);
  expectRefused({{"query", field(), "--closest", "builtin:torus", "--boxes", "-"}}, "boxes excludes closest", before);
  expectRefused({{"query"}}, "field is missing", before);
}

/// The units of a field that was made from a normalized mesh are those of the normalized mesh.
TEST_F(Samples, queryTakesTheMeshInTheUnitsOfTheField) {
  writeFile(at("t.obj"), kTetrahedron);
  ASSERT_EQ(run({{"build", at("t.obj"), "-o", at("t.hpsdf"), "--normalize", "--target-error", "1e-2"}}).status, 0);
  const Outcome outcome = run({{"query", at("t.hpsdf"), "0,0,3", "--closest", at("t.obj"), "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NEAR(Json::parse(outcome.out)[0].at("pz").get<double>(), 1, 1e-12);
}

}  // namespace cli_samples_test
}  // namespace hpsdf::app
