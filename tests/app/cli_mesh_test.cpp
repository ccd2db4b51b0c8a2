// Tests `hpsdf mesh`, and meshes that cannot be used.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "cli_fixture.h"
#include "support/assimp_files.h"

namespace hpsdf::app {
namespace cli_mesh_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using MeshCommand = Cli;

TEST_F(MeshCommand, reportsSelfIntersectionsAndInsideTest) {
  std::string text;
  for (const double x : {0.0, 0.2}) text += fmt::format("v {0} 0 0\nv {1} 0 0\nv {0} 1 0\nv {0} 0 1\n", x, x + 1);
  text += "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\nf 5 7 6\nf 5 6 8\nf 6 7 8\nf 5 8 7\n";
  writeFile(at("two.obj"), text);
  const Outcome told = run({{"mesh", at("two.obj"), "--check-sign", "500"}});
  EXPECT_EQ(told.status, 0) << told.err;
  EXPECT_THAT(told.out, HasSubstr("pairs of faces, as at ("));
  EXPECT_THAT(told.out, HasSubstr("winding: the mesh intersects itself"));
  EXPECT_THAT(told.out, HasSubstr("wrong signs            0\n"));
  const Json json = Json::parse(run({{"mesh", at("two.obj"), "--json", "--places", "1", "--check-sign", "500"}}).out);
  const Json& crossings = json.at("defects").at("crossings");
  EXPECT_GT(crossings.at("count"), 1);
  EXPECT_EQ(crossings.at("places").size(), 1u);
  EXPECT_EQ(crossings.at("places")[0].at("at").size(), 3u);
  EXPECT_EQ(crossings.at("within_parts"), 0);
  EXPECT_TRUE(json.at("verdict").at("parts_overlap"));
  EXPECT_FALSE(json.at("verdict").at("self_folding"));
  EXPECT_EQ(json.at("sign").at("by"), "winding");
  EXPECT_EQ(json.at("sign").at("at").size(), 3u);
  EXPECT_EQ(json.at("sign_check").at("wrong"), 0);
  const std::string place = told.out.substr(told.out.rfind(", as at ("), std::string(", as at (0.5, 0.5, 0.5").size());
  EXPECT_THAT(run({{"build", at("two.obj"), "-o", at("t.hpsdf"), "--normalize", "--target-error", "1"}}).err,
              HasSubstr("the mesh intersects itself, so that normals may mislead" + place))
      << "in the file's units";
  EXPECT_THAT(run({{"mesh", "builtin:gear"}}).out,
              AllOf(HasSubstr("closed, orientable, does not intersect itself"),
                    HasSubstr("pseudonormal: the mesh has no holes"), Not(HasSubstr("as at"))));
  EXPECT_THAT(run({{"mesh", "builtin:gear", "--seed", "2"}}).err, HasSubstr("seed belongs to check-sign"));
}

/// A tetrahedron with one reversed face and one duplicate face.
const char* const kBadTetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 4 2\nf 2 3 4\nf 1 4 3\nf 4 3 2\n";

TEST_F(MeshCommand, repairsAMesh) {
  writeFile(at("bad.obj"), kBadTetrahedron);
  const Json before = Json::parse(run({{"mesh", at("bad.obj"), "--json"}}).out);
  EXPECT_EQ(before.at("defects").at("inconsistent_edges").at("count"), 3);
  EXPECT_EQ(before.at("defects").at("inconsistent_edges").at("places")[0].at("edge").size(), 2u);
  EXPECT_EQ(before.at("duplicate_faces"), 1);
  EXPECT_THAT(run({{"mesh", at("bad.obj")}}).out, HasSubstr(" 1 face dropped, as at "));
  const Outcome repaired = run({{"mesh", at("bad.obj"), "--repair", at("repaired.ply")}});
  EXPECT_EQ(repaired.status, 0) << repaired.err;
  EXPECT_THAT(repaired.out, AllOf(HasSubstr("removed 1 face; reversed 1 face"), HasSubstr("repaired.ply: closed")));
  const Json after = Json::parse(run({{"mesh", at("repaired.ply"), "--json"}}).out);
  EXPECT_TRUE(after.at("verdict").at("closed"));
  EXPECT_EQ(after.at("faces"), 4);
  EXPECT_EQ(after.at("sign").at("by"), "pseudonormal");
  EXPECT_THAT(run({{"mesh", at("repaired.ply"), "--repair", at("again.obj")}}).out, HasSubstr("nothing to do"));
  expectRefused({{"mesh", at("bad.obj"), "--repair", at("repaired.fbx")}}, ".stl or .glb");
  expectRefused({{"mesh", at("bad.obj"), "--repair", at("none/mended.obj")}}, "none");
}

TEST_F(MeshCommand, drawsAMesh) {
  writeFile(at("bad.obj"), kBadTetrahedron);
  const Outcome drawn = run({{"mesh", at("bad.obj"), "--picture", at("bad.png"), "--cpu", "--size", "320x200"}});
  EXPECT_EQ(drawn.status, 0) << drawn.err;
  EXPECT_GT(fs::file_size(at("bad.png")), 1000u);
  expectRefused({{"mesh", at("bad.obj"), "--picture", at("bad.jpg")}}, "written as .png");
  expectRefused({{"mesh", at("bad.obj"), "--view", "front"}}, "view belongs to picture");
  expectRefused({{"mesh", at("none.obj"), "--picture", at("bad.png"), "--size", "9000x9000"}}, "64 million");
}

TEST_F(MeshCommand, reportsAndRepairsWhereThePictureFails) {
  writeFile(at("bad.obj"), kBadTetrahedron);
  for (const bool json : {false, true}) {
    Call call{{"mesh", at("bad.obj"), "--picture", at("bad.png"), "--cpu", "--repair", at("repaired.obj"), "--target",
               "1e300,0,0"}};
    if (json) call.words.push_back("--json");
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, AllOf(StartsWith("hpsdf: error: "), HasSubstr("too far from the mesh")));
    EXPECT_THAT(outcome.out, AllOf(HasSubstr("inconsistent"), HasSubstr("repaired.obj"), Not(HasSubstr("picture"))));
    EXPECT_TRUE(fs::remove(at("repaired.obj")));
    EXPECT_FALSE(fs::exists(at("bad.png")));
  }
}

TEST_F(MeshCommand, badMeshesAreRefused) {
  writeFile(at("empty.obj"), "");
  writeFile(at("text.obj"), "this is no mesh\n");
  writeFile(at("text.xyz"), "this is no mesh\n");
  writeFile(at("nan.obj"), "v 0 0 nan\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n");
  writeFile(at("flat.obj"), "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  writeFile(at("range.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  fs::create_directory(at("folder.obj"));
  const auto before = namesIn(folder_.path());
  for (const char* name :
       {"missing.obj", "empty.obj", "text.obj", "text.xyz", "nan.obj", "flat.obj", "range.obj", "folder.obj"}) {
    expectRefused({{"build", at(name), "-o", at("f.hpsdf")}}, name, before);
    expectRefused({{"mesh", at(name)}}, name, before);
    expectRefused({{"report", at(name), "-o", at("report/deep")}}, name, before);
  }
  expectRefused({{"build", "builtin:tours", "-o", at("f.hpsdf")}}, "torus", before);
  expectRefused({{"build", "builtin:torus,majr=1", "-o", at("f.hpsdf")}}, "major", before);
  expectRefused({{"build", "analytic:gear", "-o", at("f.hpsdf")}}, "gear", before);
  expectRefused({{"mesh", "analytic:sphere"}}, "analytic", before);
}

TEST_F(MeshCommand, filesThatCrashTheImporterAreRefused) {
  writeFile(at("down.3ds"), support::crashing3ds());
  writeFile(at("slow.3ds"), support::slow3ds());
  writeFile(at("t.3ds"), support::tetrahedron3ds());
  const auto before = namesIn(folder_.path());
  for (const Call& call : {Call{{"mesh", at("down.3ds")}}, Call{{"build", at("down.3ds"), "-o", at("f.hpsdf")}},
                           Call{{"verify", field(), at("down.3ds")}}})
    expectRefused(call, "down.3ds: the process that read it came down (", before);
  const auto mesh = [&](const char* name, const std::string& variable, const std::string& value) {
    return Call{.words = {"mesh", at(name)}, .environment = {{variable, value}}};
  };
  const Outcome slow = run(mesh("slow.3ds", "HPSDF_IMPORT_SECONDS", "0.5"));
  EXPECT_EQ(slow.status, 2);
  EXPECT_THAT(slow.err, HasSubstr("slow.3ds: reading it takes more than 0.5 s"));
  expectRefused(mesh("t.3ds", "HPSDF_IMPORT_SECONDS", "soon"), "HPSDF_IMPORT_SECONDS: expected a number above 0",
                before);
  expectRefused(mesh("t.3ds", "HPSDF_IMPORT_BYTES", "-1"), "HPSDF_IMPORT_BYTES: expected a number above 0", before);
  EXPECT_EQ(run(mesh("t.3ds", "HPSDF_IMPORT_BYTES", "1e9")).status, 0);
}

TEST_F(MeshCommand, importerIsNotACommand) {
  EXPECT_EQ(Json::parse(run({{"doctor", "--json"}}).out).at("mesh_reader"), "own process");
  EXPECT_EQ(Json::parse(runHere({"doctor", "--json"}).out).at("mesh_reader"), "this process");
  EXPECT_THAT(run({{"docs"}}).out, Not(HasSubstr("__read-mesh")));
  expectRefused({{"__read-mesh", at("t.obj")}}, "unknown command '__read-mesh'");
}

/// The process that reads a mesh file ends with the program, however the program ends.
TEST_F(MeshCommand, importerEndsWithTheProgram) {
  writeFile(at("slow.3ds"), support::slow3ds());
  const auto readers = [&] {
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator("/proc")) {
      std::ifstream words(entry.path() / "cmdline");
      const std::string text{std::istreambuf_iterator<char>(words), {}};
      count += text.find("__read-mesh") != std::string::npos && text.find(at("slow.3ds")) != std::string::npos;
    }
    return count;
  };
  for (const auto& [signal, status] : {std::pair{SIGINT, 130}, {SIGKILL, -SIGKILL}}) {
    Process process({{"mesh", at("slow.3ds")}});
    process.waitForErrorLine();  // waits for the first report of progress
    EXPECT_EQ(readers(), 1u);
    process.send(signal);
    const Outcome outcome = process.finish();
    EXPECT_EQ(outcome.status, status);
    EXPECT_THAT(outcome.err, EndsWith(signal == SIGINT ? "hpsdf: cancelled; nothing is half-written\n" : ""));
    for (int i = 0; i < 500 && readers() > 0; ++i) usleep(10000);
    EXPECT_EQ(readers(), 0u);
  }
}

/// Returns an OBJ file with one polygon of corners back and forth on a line, which takes tens of seconds to
/// triangulate.
std::string slowPolygon() {
  constexpr int kCorners = 100'000;
  std::string file;
  for (int i = 0; i < kCorners; ++i) file += "v " + std::to_string(i % 2 == 0 ? kCorners - i : i) + " 0 0\n";
  file += "f";
  for (int i = 1; i <= kCorners; ++i) file += " " + std::to_string(i);
  return file + "\n";
}

/// Files of the other formats are read by the program itself, which tells how far it is and can be stopped.
TEST_F(MeshCommand, readingShowsProgressAndIsCancelled) {
  writeFile(at("slow.obj"), slowPolygon());
  Process process({{"mesh", at("slow.obj")}});
  process.waitForErrorLine();
  process.send(SIGINT);
  const Outcome outcome = process.finish();
  EXPECT_EQ(outcome.status, 130);
  EXPECT_THAT(outcome.err, HasSubstr("Triangulating a polygon of the mesh"));
  EXPECT_THAT(outcome.err, EndsWith("hpsdf: cancelled; nothing is half-written\n"));
}

}  // namespace cli_mesh_test
}  // namespace hpsdf::app
