// Tests that defects of meshes are found, and that repair reverses wrongly oriented faces.

#include <assimp/scene.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <vector>

#include "hpsdf/detail/crossings.h"
#include "hpsdf/detail/sign_check.h"
#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/mesh_repair.h"
#include "hpsdf/mesh_report.h"
#include "support/made_meshes.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace mesh_defects_test {

using support::boxBetween;
using support::boxOfTwo;
using support::joined;
using support::moved;
using support::openBox;
using support::reversed;
using testing::ElementsAre;

MeshDefects defectsOf(const TriangleMesh& mesh) { return findDefects(mesh, findCrossings(mesh)); }

TriangleMesh ball(const Vector3& center = Vector3::Zero(), double radius = 1) {
  return moved(shapes::mesh("builtin:sphere,subdivisions=3"), center, radius);
}

/// Returns a Möbius strip around the z axis with this number of quadrilaterals.
TriangleMesh moebiusStrip(int pieces) {
  TriangleMesh mesh;
  for (int i = 0; i < pieces; ++i) {
    const double around = 2 * std::numbers::pi * i / pieces, twist = around / 2;
    for (const double side : {-0.3, 0.3}) {
      const double radius = 1 + side * std::cos(twist);
      mesh.vertices.emplace_back(radius * std::cos(around), radius * std::sin(around), side * std::sin(twist));
    }
  }
  const auto corner = [&](int i, int side) {
    return std::uint32_t(i < pieces ? 2 * i + side : 1 - side);  // the strip closes upside down
  };
  for (int i = 0; i < pieces; ++i) {
    mesh.triangles.push_back({corner(i, 0), corner(i + 1, 0), corner(i + 1, 1)});
    mesh.triangles.push_back({corner(i, 0), corner(i + 1, 1), corner(i, 1)});
  }
  return mesh;
}

TEST(MeshDefects, doNotExistInClosedSurfaces) {
  for (const TriangleMesh& mesh : {boxOfTwo(), joined(ball(), ball({3, 0, 0}))}) {
    const MeshDefects defects = defectsOf(mesh);
    EXPECT_TRUE(defects.found.empty());
    EXPECT_TRUE(defects.orientable);
  }
}

TEST(MeshDefects, reportBoundaryEdges) {
  const MeshDefects defects = defectsOf(openBox());
  EXPECT_THAT(defects.counts, ElementsAre(4, 0, 0, 0, 0));
  for (const Defect& defect : defects.found) {
    EXPECT_EQ(defect.kind, DefectKind::boundaryEdge);
    EXPECT_EQ(defect.faces[0], defect.faces[1]);
    for (const Vector3& end : defect.ends) EXPECT_EQ(end.cwiseAbs(), Vector3(1, 1, 1));
    for (const Vector3& end : defect.ends) EXPECT_EQ(end.z(), 1);
    EXPECT_EQ((defect.ends[1] - defect.ends[0]).norm(), 2);
  }
}

TEST(MeshDefects, reportThreeInconsistentEdgesOfAReversedFace) {
  TriangleMesh mesh = boxOfTwo();
  std::swap(mesh.triangles[5][0], mesh.triangles[5][1]);
  const MeshDefects defects = defectsOf(mesh);
  EXPECT_THAT(defects.counts, ElementsAre(0, 0, 3, 0, 0));
  EXPECT_TRUE(defects.orientable);
  for (const Defect& defect : defects.found) EXPECT_TRUE(defect.faces[0] == 5 || defect.faces[1] == 5);
}

TEST(MeshDefects, reportWhereBodiesTouchAtAnEdgeOrACorner) {
  const MeshDefects edge = defectsOf(cleaned(joined(boxOfTwo(), moved(boxOfTwo(), {2, 2, 0}))).mesh);
  EXPECT_THAT(edge.counts, ElementsAre(0, 1, 0, 0, 0));
  EXPECT_EQ((edge.found[0].ends[0] + edge.found[0].ends[1]) / 2, Vector3(1, 1, 0));
  const MeshDefects corner = defectsOf(cleaned(joined(boxOfTwo(), moved(boxOfTwo(), {2, 2, 2}))).mesh);
  EXPECT_THAT(corner.counts, ElementsAre(0, 0, 0, 1, 0));
  EXPECT_EQ(corner.found[0].ends[0], Vector3(1, 1, 1));
}

TEST(MeshDefects, countCrossingsWithinOneComponent) {
  const MeshDefects two = defectsOf(joined(ball(), ball({1, 0, 0})));
  EXPECT_GT(two.count(DefectKind::crossing), 10u);
  EXPECT_EQ(two.count(DefectKind::crossing), two.found.size());
  EXPECT_EQ(two.crossingsWithinComponents, 0u);
  TriangleMesh spike = ball();
  spike.vertices[0] *= -1.5;  // moves a vertex through the opposite side
  const MeshDefects one = defectsOf(spike);
  EXPECT_GT(one.count(DefectKind::crossing), 0u);
  EXPECT_EQ(one.crossingsWithinComponents, one.count(DefectKind::crossing));
}

TEST(MeshDefects, reportThatAMoebiusStripIsNotOrientable) {
  const MeshDefects defects = defectsOf(moebiusStrip(24));
  EXPECT_FALSE(defects.orientable);
  EXPECT_EQ(defects.count(DefectKind::boundaryEdge), 48u);
  const RepairedMesh result = repaired(cleaned(moebiusStrip(24)));
  EXPECT_EQ(result.imported.report.inconsistentEdges, 1u) << "the strip stays unchanged";
  EXPECT_EQ(result.reversedFaces, 0u);
  EXPECT_EQ(result.imported.report.inconsistentEdges, 1u);
}

TEST(MeshRepair, reversesFacesThatDisagreeWithTheirPatch) {
  TriangleMesh mesh = ball();
  for (std::size_t f = 0; f < mesh.triangles.size(); f += 3) std::swap(mesh.triangles[f][0], mesh.triangles[f][1]);
  const std::size_t wrong = (mesh.triangles.size() + 2) / 3;
  const RepairedMesh result = repaired(cleaned(mesh));
  EXPECT_EQ(result.reversedFaces, wrong);
  EXPECT_EQ(result.reversedPatches, 0u);
  EXPECT_EQ(result.imported.report.inconsistentEdges, 0u);
  EXPECT_TRUE(result.imported.report.closed());
  EXPECT_DOUBLE_EQ(result.imported.report.volume, signedVolume(ball()));
}

TEST(MeshRepair, reversesInwardBodies) {
  const RepairedMesh result = repaired(cleaned(joined(ball({0, 0, 0}, 2), support::reversed(ball({5, 0, 0})))));
  EXPECT_EQ(result.reversedPatches, 1u);
  EXPECT_EQ(result.reversedFaces, 0u);
  EXPECT_NEAR(result.imported.report.volume, 9 * signedVolume(ball()), 1e-9);
}

TEST(MeshRepair, keepsCavities) {
  const TriangleMesh hollow = joined(ball({0, 0, 0}, 3), support::reversed(ball({0, 0, 0}, 2)));
  const RepairedMesh same = repaired(cleaned(hollow));
  EXPECT_EQ(same.reversedPatches, 0u);
  EXPECT_EQ(same.imported.mesh.triangles, hollow.triangles);
  const RepairedMesh nested = repaired(cleaned(joined(hollow, support::reversed(ball()))));
  EXPECT_EQ(nested.reversedPatches, 1u) << "a body in a cavity is oriented outward";
  EXPECT_NEAR(nested.imported.report.volume, (27 - 8 + 1) * signedVolume(ball()), 1e-9);
}

void expectUnchanged(const TriangleMesh& mesh, const char* what) {
  const RepairedMesh result = repaired(cleaned(mesh));
  EXPECT_EQ(result.reversedPatches, 0u) << what;
  EXPECT_EQ(result.reversedFaces, 0u) << what;
  EXPECT_EQ(result.imported.mesh.triangles, cleaned(mesh).mesh.triangles) << what;
}

TEST(MeshRepair, keepsCavitiesThatTouch) {
  const TriangleMesh outer = moved(boxOfTwo(), {0, 0, 0}, 2), one = boxBetween({-1, -1, -1}, {0, 0, 1});
  const TriangleMesh inAnEdge = joined(one, boxBetween({0, 0, -1}, {1, 1, 1}));
  expectUnchanged(joined(outer, support::reversed(inAnEdge)), "the cavities touch along an edge");
  const TriangleMesh inAWall = joined(one, boxBetween({0, -1, -1}, {1, 0, 1}));
  expectUnchanged(joined(outer, support::reversed(inAWall)), "the cavities share a wall");
  for (const TriangleMesh& pair : {inAnEdge, inAWall}) {
    const RepairedMesh outside = repaired(cleaned(joined(outer, moved(support::reversed(pair), {4, 0, 0}))));
    EXPECT_GT(outside.reversedPatches, 1u);
    EXPECT_EQ(outside.imported.mesh.triangles, cleaned(joined(outer, moved(pair, {4, 0, 0}))).mesh.triangles);
  }
}

/// Returns the mesh of `boxBetween`, except that its side at x = high.x is divided along the other diagonal.
TriangleMesh boxWithOtherDiagonal(const Vector3& low, const Vector3& high) {
  TriangleMesh mesh = boxBetween(low, high);
  std::vector<std::array<std::uint32_t, 3>*> side;
  for (auto& triangle : mesh.triangles)
    if (std::ranges::all_of(triangle, [&](std::uint32_t v) { return mesh.vertices[v].x() == high.x(); }))
      side.push_back(&triangle);
  auto &one = *side.at(0), &other = *side.at(1);
  while (std::ranges::count(other, one[0]) > 0) std::ranges::rotate(one, one.begin() + 1);
  while (std::ranges::count(one, other[0]) > 0) std::ranges::rotate(other, other.begin() + 1);
  one[2] = other[0];
  other[2] = one[0];
  return mesh;
}

TEST(MeshRepair, reversesBodiesWithDifferentlyDividedSharedWallsIndependently) {
  const TriangleMesh left = boxWithOtherDiagonal({-1, -1, -1}, {0, 1, 1}), right = boxBetween({0, -1, -1}, {3, 1, 1});
  ASSERT_NEAR(signedVolume(left), 4, 1e-12);
  const auto welded = [](const TriangleMesh& one, const TriangleMesh& other) {
    return cleaned(joined(joined(one, other), boxBetween({5, 0, 0}, {9, 4, 4})));  // keeps the volume positive
  };
  ASSERT_EQ(inspect(welded(left, right).mesh).nonManifoldEdges, 4u);
  for (const bool leftReversed : {false, true})
    for (const bool rightReversed : {false, true}) {
      const RepairedMesh result = repaired(
          welded(leftReversed ? support::reversed(left) : left, rightReversed ? support::reversed(right) : right));
      EXPECT_EQ(result.reversedPatches, 2u * leftReversed + 2u * rightReversed);
      for (const Vector3& x : {Vector3(-0.1, 0.3, 0.2), Vector3(0.1, 0.3, 0.2), Vector3(2, 0, 0)})
        EXPECT_NEAR(windingNumber(result.imported.mesh, x), 1, 1e-9) << leftReversed << rightReversed << x.transpose();
      for (const Vector3& x : {Vector3(-0.1, 1.1, 0.2), Vector3(3.1, 0.3, 0.2)})
        EXPECT_NEAR(windingNumber(result.imported.mesh, x), 0, 1e-9) << leftReversed << rightReversed << x.transpose();
    }
}

/// Two or three of a cube's eight subcubes have all combinations of orientations, beside a box oriented outward.
TEST(MeshRepair, reversesTouchingCubesIndependently) {
  const auto lowest = [](int at) { return Vector3(at & 1, at >> 1 & 1, at >> 2); };
  for (const std::vector<int>& all :
       {std::vector{0, 1}, std::vector{0, 3}, std::vector{0, 1, 2}, std::vector{0, 4, 2}, std::vector{0, 1, 6}})
    for (unsigned inwards = 0; inwards < 1u << all.size(); ++inwards) {
      TriangleMesh mesh = boxBetween({5, 0, 0}, {9, 4, 4});
      for (std::size_t i = 0; i < all.size(); ++i) {
        const TriangleMesh cube = boxBetween(lowest(all[i]), lowest(all[i]) + Vector3(1, 1, 1));
        mesh = joined(mesh, inwards >> i & 1 ? reversed(cube) : cube);
      }
      const RepairedMesh result = repaired(cleaned(mesh));
      for (const int at : all)
        EXPECT_NEAR(windingNumber(result.imported.mesh, lowest(at) + Vector3(0.5, 0.4, 0.3)), 1, 1e-9)
            << all.size() << " " << inwards << " " << at;
    }
}

TEST(MeshRepair, keepsCavitiesWithAHole) {
  const TriangleMesh outer = moved(boxOfTwo(), {0, 0, 0}, 2);
  TriangleMesh lacking = boxOfTwo();
  for (std::size_t lack = 0; lack < 2; ++lack) {  // removes one triangle, then the other triangle of that side
    lacking.triangles.pop_back();
    expectUnchanged(joined(outer, support::reversed(lacking)), "an open cavity within a box");
  }
  expectUnchanged(joined(moved(openBox(), {0, 0, -2}, 2), support::reversed(moved(openBox(), {0, 0, -1.5}, 1.5))),
                  "the inner wall of a cup");
}

TEST(MeshRepair, keepsCavitiesThatOverlapEachOther) {
  const TriangleMesh hollow =
      joined(joined(moved(boxOfTwo(), {0, 0, 0}, 5), support::reversed(moved(boxOfTwo(), {0, 0, 0}, 2))),
             support::reversed(moved(boxOfTwo(), {2.5, 2.5, 2.5}, 2)));
  const RepairedMesh result = repaired(cleaned(hollow));
  EXPECT_EQ(result.reversedPatches, 0u);
  EXPECT_EQ(result.imported.mesh.triangles, cleaned(hollow).mesh.triangles);
}

TEST(MeshRepair, keepsPocketsThatEndInASide) {
  const TriangleMesh block = boxBetween({0, 0, 0}, {10, 10, 10});
  expectUnchanged(joined(block, support::reversed(boxBetween({1, 1, 9.5}, {9, 9, 10}))),
                  "most of the pocket's area lies in the side");
}

TEST(MeshRepair, reversesBothSurfacesOfAnInwardHollowBody) {
  const TriangleMesh shell = joined(ball({0, 0, 0}, 2), support::reversed(ball())), beside = ball({20, 0, 0}, 9);
  const RepairedMesh result = repaired(cleaned(joined(beside, support::reversed(shell))));
  EXPECT_EQ(result.reversedPatches, 2u);
  EXPECT_EQ(result.imported.mesh.triangles, joined(beside, shell).triangles);
}

TEST(MeshRepair, reversesABodyAmongTouchingBodies) {
  TriangleMesh cubes;
  std::size_t middle = 0;
  for (int i = 0; i < 27; ++i) {
    const Vector3 low(i % 3, i / 3 % 3, i / 9);
    if (i == 13) middle = cubes.triangles.size();
    cubes = joined(cubes, boxBetween(low, low + Vector3(1, 1, 1)));
  }
  // The middle cube touches six other cubes, whose faces are divided along the other diagonals.
  TriangleMesh inner = boxBetween({1, 1, 1}, {2, 2, 2});
  for (Vector3& x : inner.vertices) x.x() = 3 - x.x();  // mirroring orients it inward
  std::copy(inner.triangles.begin(), inner.triangles.end(),
            cubes.triangles.begin() + static_cast<std::ptrdiff_t>(middle));
  for (auto t = cubes.triangles.begin() + static_cast<std::ptrdiff_t>(middle), end = t + 12; t != end; ++t)
    for (std::uint32_t& v : *t) v += 8 * 13;
  std::copy(inner.vertices.begin(), inner.vertices.end(), cubes.vertices.begin() + 8 * 13);
  const Vector3 center(1.5, 1.4, 1.3);
  ASSERT_NEAR(windingNumber(cubes, center), -1, 1e-9);
  EXPECT_NEAR(windingNumber(repaired(cleaned(cubes)).imported.mesh, center), 1, 1e-9);
}

TEST(MeshRepair, reversesBodiesThatProtrudeFromAnother) {
  const TriangleMesh outer = boxOfTwo(), through = boxBetween({0, -0.9, -0.9}, {1.6, 0.9, 0.9});
  for (std::size_t largest = 0; largest < through.triangles.size(); ++largest) {
    TriangleMesh body = through;
    std::ranges::rotate(body.triangles, body.triangles.begin() + static_cast<std::ptrdiff_t>(largest));
    const RepairedMesh result = repaired(cleaned(joined(outer, support::reversed(body))));
    EXPECT_EQ(result.reversedPatches, 1u) << largest;
    EXPECT_EQ(result.imported.mesh.triangles, joined(outer, body).triangles) << largest;
  }
  expectUnchanged(joined(outer, support::reversed(boxBetween({-0.9, -0.9, -0.9}, {1.1, 0.9, 0.9}))),
                  "nine tenths of the body lie within");
}

TEST(MeshRepair, keepsOneSidedSurfacesWhateverTheirVolume) {
  const TriangleMesh box = boxBetween({-9, -9, -9}, {-5, -5, -5}), strip = moebiusStrip(24);
  const MeshReport report = inspect(strip);
  ASSERT_GT(std::abs(report.volume), 0.01 * report.box.volume())
      << "the volume of a two-sided surface would be reliable";
  for (const TriangleMesh& body : {strip, support::reversed(strip)}) {
    const RepairedMesh result = repaired(cleaned(joined(box, body)));
    EXPECT_EQ(result.reversedPatches, 0u);
    EXPECT_EQ(result.imported.mesh.triangles, joined(box, body).triangles);
  }
}

TEST(MeshRepair, reversesOpenBodies) {
  const TriangleMesh open = support::openAbove(ball(), 0.7);
  const RepairedMesh result = repaired(cleaned(joined(ball({5, 0, 0}, 2), support::reversed(open))));
  EXPECT_EQ(result.reversedPatches, 1u);
  EXPECT_GT(result.imported.report.boundaryEdges, 10u);
  EXPECT_EQ(repaired(result.imported).reversedPatches, 0u);
}

Vector3 middleOf(const TriangleMesh& mesh, std::size_t face) {
  const auto& [a, b, c] = mesh.triangles[face];
  return (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3;
}

TEST(MeshRepair, keepsTheReportOfCleaning) {
  TriangleMesh mesh = boxOfTwo();
  mesh.triangles.push_back(mesh.triangles[3]);
  mesh.triangles.push_back({0, 0, 1});
  const RepairedMesh result = repaired(cleaned(support::reversed(mesh)));
  EXPECT_EQ(result.imported.report.duplicateFaces, 1u);
  EXPECT_EQ(result.imported.report.degenerateFaces, 1u);
  EXPECT_EQ(result.imported.report.duplicatePosition, middleOf(mesh, 3));
  EXPECT_EQ(result.imported.report.degeneratePosition, middleOf(mesh, 13));
  EXPECT_TRUE(result.imported.report.reversed);
}

TEST(MeshExport, isReadBackUnchanged) {
  const support::TemporaryDirectory folder;
  const TriangleMesh mesh = moved(boxOfTwo(), {0.125, -3, 1e-3});
  const std::vector<Vector3> normals(mesh.vertices.size(), Vector3(0.6, 0, -0.8));
  const std::vector<std::array<std::uint8_t, 3>> colors(mesh.vertices.size(), {255, 0, 128});
  for (const VertexData& data :
       {VertexData{}, VertexData{.normals = normals}, VertexData{.colors = colors}, VertexData{normals, colors}})
    for (const char* name : {"box.obj", "box.PLY", "box.stl", "box.glb"}) {
      const std::filesystem::path file = folder.path() / name;
      saveMesh(mesh, file, data);
      const ImportedMesh again = importMesh(file);
      EXPECT_EQ(again.report.faces, 12u);
      EXPECT_TRUE(again.report.closed());
      EXPECT_EQ(again.report.box.min().y(), -4) << name;
      EXPECT_NEAR(signedVolume(again.mesh), signedVolume(mesh), isSinglePrecisionMesh(file) ? 1e-6 : 1e-15) << name;
      if (isSinglePrecisionMesh(file)) continue;
      EXPECT_EQ(again.mesh.vertices, mesh.vertices) << name;
      EXPECT_EQ(again.mesh.triangles, mesh.triangles) << name;
    }
}

/// Another reader than ours must find the normals and colours.
TEST(MeshExport, writesNormalsAndColours) {
  const support::TemporaryDirectory folder;
  const TriangleMesh mesh = boxOfTwo();
  std::vector<Vector3> normals;
  std::vector<std::array<std::uint8_t, 3>> colors;
  for (const Vector3& x : mesh.vertices) {
    normals.push_back(x.normalized());
    colors.push_back({static_cast<std::uint8_t>(x.x() > 0 ? 255 : 0), 51, 102});
  }
  for (const char* name : {"box.obj", "box.ply", "box.glb"}) {
    const std::filesystem::path file = folder.path() / name;
    saveMesh(mesh, file, {normals, colors});
    Assimp::Importer importer;
    const aiScene* const scene = importer.ReadFile(file.string(), 0);
    ASSERT_NE(scene, nullptr) << name << ": " << importer.GetErrorString();
    const aiMesh& read = *scene->mMeshes[0];
    ASSERT_TRUE(read.HasNormals() && read.HasVertexColors(0)) << name;
    EXPECT_EQ(read.mNumFaces, mesh.triangles.size());
    for (unsigned i = 0; i < read.mNumVertices; ++i) {
      const aiVector3D &x = read.mVertices[i], &normal = read.mNormals[i];
      EXPECT_LT((Vector3(normal.x, normal.y, normal.z) - Vector3(x.x, x.y, x.z).normalized()).norm(), 1e-6) << name;
      const aiColor4D& color = read.mColors[0][i];
      EXPECT_NEAR(color.r, x.x > 0 ? 1 : 0, 1e-6) << name;
      // GLB holds linear light: the sRGB values 51/255 and 102/255 are 0.033105 and 0.132868 there.
      const bool isLinear = file.extension() == ".glb";
      EXPECT_NEAR(color.g, isLinear ? 0.033105 : 0.2, isLinear ? 1e-5 : 1e-6) << name;
      EXPECT_NEAR(color.b, isLinear ? 0.132868 : 0.4, isLinear ? 1e-5 : 1e-6) << name;
    }
  }
}

TEST(MeshExport, refusesWhatSinglePrecisionCannotHold) {
  const support::TemporaryDirectory folder;
  TriangleMesh far = boxOfTwo();
  far.vertices[3].x() = 1e39;
  for (const char* name : {"far.stl", "far.glb"}) {
    EXPECT_THROW(saveMesh(far, folder.path() / name), Error);
    EXPECT_THROW(saveMesh({}, folder.path() / name), Error);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / name));
  }
}

TEST(MeshExport, refusesVerticesThatSinglePrecisionCannotTellApart) {
  const support::TemporaryDirectory folder;
  const TriangleMesh mesh = moved(boxOfTwo(), Vector3::Constant(1e9));
  saveMesh(mesh, folder.path() / "far.ply");
  for (const char* name : {"far.stl", "far.glb"}) {
    EXPECT_THROW(saveMesh(mesh, folder.path() / name), Error);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / name));
  }
}

/// A line feed or a carriage return at the beginning of the binary data must not be taken for a part of the header.
TEST(MeshExport, isReadBackWhateverByteThePlyDataBeginWith) {
  const support::TemporaryDirectory folder;
  const std::filesystem::path file = folder.path() / "box.ply";
  for (std::uint64_t byte = 0; byte < 256; ++byte) {
    TriangleMesh mesh = boxOfTwo();
    double& first = mesh.vertices[0].x();
    first = std::bit_cast<double>((std::bit_cast<std::uint64_t>(first) & ~std::uint64_t{255}) | byte);
    saveMesh(mesh, file);
    const ImportedMesh again = importMesh(file);
    EXPECT_EQ(again.mesh.vertices, mesh.vertices) << byte;
    EXPECT_EQ(again.mesh.triangles, mesh.triangles) << byte;
  }
}

TEST(MeshExport, writesDoublesExactly) {
  const support::TemporaryDirectory folder;
  TriangleMesh mesh = boxOfTwo();
  mesh.vertices[0].x() = -1.0000000000000002;
  saveMesh(mesh, folder.path() / "a.obj");
  std::ifstream text(folder.path() / "a.obj");
  std::string word;
  double x = 0;
  text >> word >> x;
  EXPECT_EQ(word, "v");
  EXPECT_EQ(x, -1.0000000000000002);
}

TEST(MeshExport, refusesOtherFormats) {
  const support::TemporaryDirectory folder;
  const std::filesystem::path file = folder.path() / "a.fbx";
  EXPECT_THROW(saveMesh(boxOfTwo(), file), Error);
  EXPECT_THROW(checkMeshWritable(file), Error);
  EXPECT_THROW(checkMeshWritable(folder.path() / "none" / "a.obj"), Error);
  EXPECT_FALSE(std::filesystem::exists(file));
}

}  // namespace mesh_defects_test
}  // namespace hpsdf
