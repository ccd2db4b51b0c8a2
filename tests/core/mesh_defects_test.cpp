// What a solid's surface would not have, where it is, and what turning faces mends.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
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
namespace {

using support::boxBetween;
using support::boxOfTwo;
using support::joined;
using support::moved;
using support::openBox;
using support::turned;
using testing::ElementsAre;

MeshDefects defectsOf(const TriangleMesh& mesh) { return findDefects(mesh, findCrossings(mesh)); }

TriangleMesh ball(const Vector3& center = Vector3::Zero(), double radius = 1) {
  return moved(shapes::mesh("builtin:sphere,subdivisions=3"), center, radius);
}

/// A strip with half a twist, of so many pieces, around z.
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
    return std::uint32_t(i < pieces ? 2 * i + side : 1 - side);  // the end meets the beginning upside down
  };
  for (int i = 0; i < pieces; ++i) {
    mesh.triangles.push_back({corner(i, 0), corner(i + 1, 0), corner(i + 1, 1)});
    mesh.triangles.push_back({corner(i, 0), corner(i + 1, 1), corner(i, 1)});
  }
  return mesh;
}

TEST(MeshDefects, AClosedSurfaceHasNone) {
  for (const TriangleMesh& mesh : {boxOfTwo(), joined(ball(), ball({3, 0, 0}))}) {
    const MeshDefects defects = defectsOf(mesh);
    EXPECT_TRUE(defects.found.empty());
    EXPECT_TRUE(defects.orientable);
  }
}

TEST(MeshDefects, RimsAreTold) {
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

TEST(MeshDefects, AFaceThatLooksTheWrongWayHasThreeEdges) {
  TriangleMesh mesh = boxOfTwo();
  std::swap(mesh.triangles[5][0], mesh.triangles[5][1]);
  const MeshDefects defects = defectsOf(mesh);
  EXPECT_THAT(defects.counts, ElementsAre(0, 0, 3, 0, 0));
  EXPECT_TRUE(defects.orientable);
  for (const Defect& defect : defects.found) EXPECT_TRUE(defect.faces[0] == 5 || defect.faces[1] == 5);
}

TEST(MeshDefects, BodiesThatTouchInAnEdgeOrACorner) {
  const MeshDefects edge = defectsOf(cleaned(joined(boxOfTwo(), moved(boxOfTwo(), {2, 2, 0}))).mesh);
  EXPECT_THAT(edge.counts, ElementsAre(0, 1, 0, 0, 0));
  EXPECT_EQ((edge.found[0].ends[0] + edge.found[0].ends[1]) / 2, Vector3(1, 1, 0));
  const MeshDefects corner = defectsOf(cleaned(joined(boxOfTwo(), moved(boxOfTwo(), {2, 2, 2}))).mesh);
  EXPECT_THAT(corner.counts, ElementsAre(0, 0, 0, 1, 0));
  EXPECT_EQ(corner.found[0].ends[0], Vector3(1, 1, 1));
}

TEST(MeshDefects, CrossingsAreOfOnePartOrOfTwo) {
  const MeshDefects two = defectsOf(joined(ball(), ball({1, 0, 0})));
  EXPECT_GT(two.count(DefectKind::crossing), 10u);
  EXPECT_EQ(two.count(DefectKind::crossing), two.found.size());
  EXPECT_EQ(two.crossingsWithinParts, 0u);
  TriangleMesh spike = ball();
  spike.vertices[0] *= -1.5;  // through the other side
  const MeshDefects one = defectsOf(spike);
  EXPECT_GT(one.count(DefectKind::crossing), 0u);
  EXPECT_EQ(one.crossingsWithinParts, one.count(DefectKind::crossing));
}

TEST(MeshDefects, AMoebiusStripIsOneSided) {
  const MeshDefects defects = defectsOf(moebiusStrip(24));
  EXPECT_FALSE(defects.orientable);
  EXPECT_EQ(defects.count(DefectKind::boundaryEdge), 48u);
  const RepairedMesh mended = repaired(cleaned(moebiusStrip(24)));
  EXPECT_EQ(mended.leftEdges, 1u) << "it stays as it is";
  EXPECT_EQ(mended.turnedFaces, 0u);
  EXPECT_EQ(mended.imported.report.inconsistentEdges, 1u);
}

TEST(MeshRepair, FacesTurnTheWayOfMost) {
  TriangleMesh mesh = ball();
  for (std::size_t f = 0; f < mesh.triangles.size(); f += 3) std::swap(mesh.triangles[f][0], mesh.triangles[f][1]);
  const std::size_t wrong = (mesh.triangles.size() + 2) / 3;
  const RepairedMesh mended = repaired(cleaned(mesh));
  EXPECT_EQ(mended.turnedFaces, wrong);
  EXPECT_EQ(mended.turnedPatches, 0u);
  EXPECT_EQ(mended.leftEdges, 0u);
  EXPECT_TRUE(mended.imported.report.closed());
  EXPECT_DOUBLE_EQ(mended.imported.report.volume, signedVolume(ball()));
}

TEST(MeshRepair, PartsThatLookInwardsTurn) {
  const RepairedMesh mended = repaired(cleaned(joined(ball({0, 0, 0}, 2), turned(ball({5, 0, 0})))));
  EXPECT_EQ(mended.turnedPatches, 1u);
  EXPECT_EQ(mended.turnedFaces, 0u);
  EXPECT_NEAR(mended.imported.report.volume, 9 * signedVolume(ball()), 1e-9);
}

TEST(MeshRepair, CavitiesStay) {
  const TriangleMesh hollow = joined(ball({0, 0, 0}, 3), turned(ball({0, 0, 0}, 2)));
  const RepairedMesh same = repaired(cleaned(hollow));
  EXPECT_EQ(same.turnedPatches, 0u);
  EXPECT_EQ(same.imported.mesh.triangles, hollow.triangles);
  const RepairedMesh nested = repaired(cleaned(joined(hollow, turned(ball()))));
  EXPECT_EQ(nested.turnedPatches, 1u) << "what lies in a cavity is a body again";
  EXPECT_NEAR(nested.imported.report.volume, (27 - 8 + 1) * signedVolume(ball()), 1e-9);
}

void expectUnchanged(const TriangleMesh& mesh, const char* what) {
  const RepairedMesh mended = repaired(cleaned(mesh));
  EXPECT_EQ(mended.turnedPatches, 0u) << what;
  EXPECT_EQ(mended.turnedFaces, 0u) << what;
  EXPECT_EQ(mended.imported.mesh.triangles, cleaned(mesh).mesh.triangles) << what;
}

TEST(MeshRepair, CavitiesThatTouchStay) {
  const TriangleMesh outer = moved(boxOfTwo(), {0, 0, 0}, 2), one = boxBetween({-1, -1, -1}, {0, 0, 1});
  const TriangleMesh inAnEdge = joined(one, boxBetween({0, 0, -1}, {1, 1, 1}));
  expectUnchanged(joined(outer, turned(inAnEdge)), "in an edge");
  const TriangleMesh inAWall = joined(one, boxBetween({0, -1, -1}, {1, 0, 1}));
  expectUnchanged(joined(outer, turned(inAWall)), "in a wall");
  for (const TriangleMesh& pair : {inAnEdge, inAWall}) {
    const RepairedMesh outside = repaired(cleaned(joined(outer, moved(turned(pair), {4, 0, 0}))));
    EXPECT_GT(outside.turnedPatches, 1u);
    EXPECT_EQ(outside.imported.mesh.triangles, cleaned(joined(outer, moved(pair, {4, 0, 0}))).mesh.triangles);
  }
}

/// Its side at x = high is cut along the other diagonal.
TriangleMesh boxCutOtherwise(const Vector3& low, const Vector3& high) {
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

TEST(MeshRepair, BodiesThatShareAWallCutOtherwiseAreTurnedEachByItself) {
  const TriangleMesh left = boxCutOtherwise({-1, -1, -1}, {0, 1, 1}), right = boxBetween({0, -1, -1}, {3, 1, 1});
  ASSERT_NEAR(signedVolume(left), 4, 1e-12);
  const auto welded = [](const TriangleMesh& one, const TriangleMesh& other) {
    return cleaned(joined(joined(one, other), boxBetween({5, 0, 0}, {9, 4, 4})));  // so that most looks outwards
  };
  ASSERT_EQ(inspect(welded(left, right).mesh).nonManifoldEdges, 4u);
  for (const bool leftTurned : {false, true})
    for (const bool rightTurned : {false, true}) {
      const RepairedMesh mended =
          repaired(welded(leftTurned ? turned(left) : left, rightTurned ? turned(right) : right));
      EXPECT_EQ(mended.turnedPatches, 2u * leftTurned + 2u * rightTurned);
      for (const Vector3& x : {Vector3(-0.1, 0.3, 0.2), Vector3(0.1, 0.3, 0.2), Vector3(2, 0, 0)})
        EXPECT_NEAR(windingNumber(mended.imported.mesh, x), 1, 1e-9) << leftTurned << rightTurned << x.transpose();
      for (const Vector3& x : {Vector3(-0.1, 1.1, 0.2), Vector3(3.1, 0.3, 0.2)})
        EXPECT_NEAR(windingNumber(mended.imported.mesh, x), 0, 1e-9) << leftTurned << rightTurned << x.transpose();
    }
}

/// Some of the cubes of a cube, all ways of turning them, beside a body that looks outwards.
TEST(MeshRepair, CubesThatTouchAreTurnedEachByItself) {
  const auto lowest = [](int at) { return Vector3(at & 1, at >> 1 & 1, at >> 2); };
  for (const std::vector<int>& all :
       {std::vector{0, 1}, std::vector{0, 3}, std::vector{0, 1, 2}, std::vector{0, 4, 2}, std::vector{0, 1, 6}})
    for (unsigned inwards = 0; inwards < 1u << all.size(); ++inwards) {
      TriangleMesh mesh = boxBetween({5, 0, 0}, {9, 4, 4});
      for (std::size_t i = 0; i < all.size(); ++i) {
        const TriangleMesh cube = boxBetween(lowest(all[i]), lowest(all[i]) + Vector3(1, 1, 1));
        mesh = joined(mesh, inwards >> i & 1 ? turned(cube) : cube);
      }
      const RepairedMesh mended = repaired(cleaned(mesh));
      for (const int at : all)
        EXPECT_NEAR(windingNumber(mended.imported.mesh, lowest(at) + Vector3(0.5, 0.4, 0.3)), 1, 1e-9)
            << all.size() << " " << inwards << " " << at;
    }
}

TEST(MeshRepair, CavitiesWithAHoleStay) {
  const TriangleMesh outer = moved(boxOfTwo(), {0, 0, 0}, 2);
  TriangleMesh lacking = boxOfTwo();
  for (std::size_t lack = 0; lack < 2; ++lack) {  // a triangle, a side
    lacking.triangles.pop_back();
    expectUnchanged(joined(outer, turned(lacking)), "within a box");
  }
  expectUnchanged(joined(moved(openBox(), {0, 0, -2}, 2), turned(moved(openBox(), {0, 0, -1.5}, 1.5))),
                  "the inner wall of a cup, up to its rim");
}

TEST(MeshRepair, CavitiesThatReachIntoEachOtherStay) {
  const TriangleMesh hollow = joined(joined(moved(boxOfTwo(), {0, 0, 0}, 5), turned(moved(boxOfTwo(), {0, 0, 0}, 2))),
                                     turned(moved(boxOfTwo(), {2.5, 2.5, 2.5}, 2)));
  const RepairedMesh mended = repaired(cleaned(hollow));
  EXPECT_EQ(mended.turnedPatches, 0u);
  EXPECT_EQ(mended.imported.mesh.triangles, cleaned(hollow).mesh.triangles);
}

TEST(MeshRepair, PocketsThatEndInASideStay) {
  const TriangleMesh block = boxBetween({0, 0, 0}, {10, 10, 10});
  expectUnchanged(joined(block, turned(boxBetween({1, 1, 9.5}, {9, 9, 10}))), "most of it in the side");
}

TEST(MeshRepair, AShellThatLooksInwardsKeepsItsCavity) {
  const TriangleMesh shell = joined(ball({0, 0, 0}, 2), turned(ball())), beside = ball({20, 0, 0}, 9);
  const RepairedMesh mended = repaired(cleaned(joined(beside, turned(shell))));
  EXPECT_EQ(mended.turnedPatches, 2u);
  EXPECT_EQ(mended.imported.mesh.triangles, joined(beside, shell).triangles);
}

TEST(MeshRepair, ABodyAmongBodiesIsNoCavityOfThem) {
  TriangleMesh cubes;
  std::size_t middle = 0;
  for (int i = 0; i < 27; ++i) {
    const Vector3 low(i % 3, i / 3 % 3, i / 9);
    if (i == 13) middle = cubes.triangles.size();
    cubes = joined(cubes, boxBetween(low, low + Vector3(1, 1, 1)));
  }
  // all cut otherwise than their neighbours, for the middle one alone touches the six
  TriangleMesh inner = boxBetween({1, 1, 1}, {2, 2, 2});
  for (Vector3& x : inner.vertices) x.x() = 3 - x.x();  // mirrored, and so inwards
  std::copy(inner.triangles.begin(), inner.triangles.end(),
            cubes.triangles.begin() + static_cast<std::ptrdiff_t>(middle));
  for (auto t = cubes.triangles.begin() + static_cast<std::ptrdiff_t>(middle), end = t + 12; t != end; ++t)
    for (std::uint32_t& v : *t) v += 8 * 13;
  std::copy(inner.vertices.begin(), inner.vertices.end(), cubes.vertices.begin() + 8 * 13);
  const Vector3 center(1.5, 1.4, 1.3);
  ASSERT_NEAR(windingNumber(cubes, center), -1, 1e-9);
  EXPECT_NEAR(windingNumber(repaired(cleaned(cubes)).imported.mesh, center), 1, 1e-9);
}

TEST(MeshRepair, WhatReachesOutOfAnotherIsNoCavity) {
  const TriangleMesh outer = boxOfTwo(), through = boxBetween({0, -0.9, -0.9}, {1.6, 0.9, 0.9});
  for (std::size_t largest = 0; largest < through.triangles.size(); ++largest) {
    TriangleMesh given = through;
    std::ranges::rotate(given.triangles, given.triangles.begin() + static_cast<std::ptrdiff_t>(largest));
    const RepairedMesh mended = repaired(cleaned(joined(outer, turned(given))));
    EXPECT_EQ(mended.turnedPatches, 1u) << largest;
    EXPECT_EQ(mended.imported.mesh.triangles, joined(outer, given).triangles) << largest;
  }
  expectUnchanged(joined(outer, turned(boxBetween({-0.9, -0.9, -0.9}, {1.1, 0.9, 0.9}))), "but for a tenth within");
}

TEST(MeshRepair, OneSidedSurfacesStayWhateverTheirVolume) {
  const TriangleMesh box = boxBetween({-9, -9, -9}, {-5, -5, -5}), strip = moebiusStrip(24);
  const MeshReport report = inspect(strip);
  ASSERT_GT(std::abs(report.volume), 0.01 * report.box.volume()) << "plain, were there two sides";
  for (const TriangleMesh& given : {strip, turned(strip)}) {
    const RepairedMesh mended = repaired(cleaned(joined(box, given)));
    EXPECT_EQ(mended.turnedPatches, 0u);
    EXPECT_EQ(mended.imported.mesh.triangles, joined(box, given).triangles);
  }
}

TEST(MeshRepair, OpenBodiesTurnAndKeepTheirHole) {
  const TriangleMesh open = support::openAbove(ball(), 0.7);
  const RepairedMesh mended = repaired(cleaned(joined(ball({5, 0, 0}, 2), turned(open))));
  EXPECT_EQ(mended.turnedPatches, 1u);
  EXPECT_GT(mended.imported.report.boundaryEdges, 10u);
  EXPECT_EQ(repaired(mended.imported).turnedPatches, 0u);
}

Vector3 middleOf(const TriangleMesh& mesh, std::size_t face) {
  const auto& [a, b, c] = mesh.triangles[face];
  return (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3;
}

TEST(MeshRepair, KeepsWhatCleaningDid) {
  TriangleMesh mesh = boxOfTwo();
  mesh.triangles.push_back(mesh.triangles[3]);
  mesh.triangles.push_back({0, 0, 1});
  const RepairedMesh mended = repaired(cleaned(turned(mesh)));
  EXPECT_EQ(mended.imported.report.duplicateFaces, 1u);
  EXPECT_EQ(mended.imported.report.degenerateFaces, 1u);
  EXPECT_EQ(mended.imported.report.duplicatePosition, middleOf(mesh, 3));
  EXPECT_EQ(mended.imported.report.degeneratePosition, middleOf(mesh, 13));
  EXPECT_TRUE(mended.imported.report.turned);
}

TEST(MeshExport, ComesBackAsItWas) {
  const support::TemporaryDirectory folder;
  const TriangleMesh mesh = moved(boxOfTwo(), {0.125, -3, 1e-3});
  for (const char* name : {"box.obj", "box.PLY"}) {
    const std::filesystem::path file = folder.path() / name;
    saveMesh(mesh, file);
    const ImportedMesh again = importMesh(file);
    EXPECT_EQ(again.report.faces, 12u);
    EXPECT_TRUE(again.report.closed());
    EXPECT_EQ(again.report.box.min().y(), -4) << name;
    EXPECT_NEAR(again.report.box.max().z(), 1 + 1e-3, 1e-7) << name;
    EXPECT_NEAR(again.report.volume, 8, 1e-6);  // the reader's floats
  }
}

/// assimp takes the byte of a line feed there for part of the header.
TEST(MeshExport, WhateverByteThePlysDataBeginWith) {
  const support::TemporaryDirectory folder;
  const std::filesystem::path file = folder.path() / "box.ply";
  for (std::uint64_t byte = 0; byte < 256; ++byte) {
    TriangleMesh mesh = boxOfTwo();
    double& first = mesh.vertices[0].x();
    first = std::bit_cast<double>((std::bit_cast<std::uint64_t>(first) & ~std::uint64_t{255}) | byte);
    saveMesh(mesh, file);
    std::ifstream stream(file);
    std::string line;
    std::getline(stream, line);
    std::getline(stream, line);
    EXPECT_EQ(line, byte == '\n' ? "format ascii 1.0" : "format binary_little_endian 1.0") << byte;
    const ImportedMesh again = importMesh(file);
    EXPECT_EQ(again.mesh.vertices, boxOfTwo().vertices) << byte << " is lost in the reader's floats";
    EXPECT_EQ(again.mesh.triangles, mesh.triangles) << byte;
  }
}

TEST(MeshExport, WritesDoublesToTheLastDigit) {
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

TEST(MeshExport, RefusesOtherFormats) {
  const support::TemporaryDirectory folder;
  const std::filesystem::path file = folder.path() / "a.fbx";
  EXPECT_THROW(saveMesh(boxOfTwo(), file), Error);
  EXPECT_THROW(checkMeshWritable(file), Error);
  EXPECT_THROW(checkMeshWritable(folder.path() / "none" / "a.obj"), Error);
  EXPECT_FALSE(std::filesystem::exists(file));
}

}  // namespace
}  // namespace hpsdf
