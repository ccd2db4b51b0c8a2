#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/triangle_mesh.h"
#include "support/made_meshes.h"

namespace hpsdf {
namespace mesh_cleanup_test {

using support::joined;
using support::reversed;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using Triangle = std::array<std::uint32_t, 3>;

TriangleMesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, "tetrahedron"};
}

TriangleMesh cube(double halfSize = 1, const Vector3& center = Vector3::Zero()) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back(center + halfSize * Vector3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  mesh.name = "cube";
  return mesh;
}

/// Returns the mesh with three separate vertices for each triangle, as in an STL file.
TriangleMesh separated(const TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const Triangle& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t v : t) soup.vertices.push_back(mesh.vertices[v]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

std::string errorOf(const TriangleMesh& mesh) {
  try {
    cleaned(mesh);
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

TEST(MeshCleanup, leavesACleanMeshAsItIs) {
  const TriangleMesh mesh = cube();
  const auto [clean, report] = cleaned(mesh);
  EXPECT_EQ(clean.vertices, mesh.vertices);
  EXPECT_EQ(clean.triangles, mesh.triangles);
  EXPECT_EQ(clean.name, "cube");
  EXPECT_EQ(report.vertices, 8u);
  EXPECT_EQ(report.faces, 12u);
  EXPECT_EQ(report.components, 1u);
  EXPECT_EQ(report.weldedVertices + report.unreferencedVertices + report.degenerateFaces + report.flippedFaces +
                report.duplicateFaces,
            0u);
  EXPECT_FALSE(report.reversed);
  EXPECT_TRUE(report.closed());
  EXPECT_DOUBLE_EQ(report.volume, 8);
  EXPECT_DOUBLE_EQ(report.area, 24);
  EXPECT_EQ(report.box.min(), Vector3(-1, -1, -1));
  EXPECT_EQ(report.box.max(), Vector3(1, 1, 1));
}

TEST(MeshCleanup, weldsEqualPositionsInOrderOfFirstUse) {
  const auto [clean, report] = cleaned(separated(tetrahedron()));
  EXPECT_EQ(report.vertices, 4u);
  EXPECT_EQ(report.weldedVertices, 8u);
  EXPECT_EQ(report.unreferencedVertices, 0u);
  EXPECT_TRUE(report.closed());
  const std::vector<Vector3> expected = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}};
  EXPECT_EQ(clean.vertices, expected);
  const std::vector<Triangle> faces = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {2, 1, 3}};
  EXPECT_EQ(clean.triangles, faces);
}

TEST(MeshCleanup, weldsNegativeZeroWithZeroAndNothingElse) {
  TriangleMesh mesh = separated(tetrahedron());
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 2)
    for (double& x : mesh.vertices[i])
      if (x == 0) x = -0.0;
  EXPECT_EQ(cleaned(mesh).report.vertices, 4u);
  for (const Vector3& v : cleaned(mesh).mesh.vertices)
    for (const double x : v) EXPECT_FALSE(std::signbit(x));

  mesh.vertices[0].x() = std::numeric_limits<double>::denorm_min();  // minimally different from vertex 0's copies
  EXPECT_EQ(cleaned(mesh).report.vertices, 5u);
}

TEST(MeshCleanup, dropsFacesWithEqualCornersAndUnusedVertices) {
  TriangleMesh mesh = tetrahedron();
  mesh.vertices.insert(mesh.vertices.begin(), {7, 7, 7});  // No triangle uses this vertex.
  for (Triangle& t : mesh.triangles)
    for (std::uint32_t& v : t) ++v;
  mesh.vertices.push_back({1, 0, 0});  // This vertex is welded with vertex 2.
  mesh.vertices.push_back({9, 9, 9});  // Only a collapsed triangle uses this vertex.
  mesh.triangles.push_back({1, 2, 5});
  mesh.triangles.push_back({6, 6, 1});
  const auto [clean, report] = cleaned(mesh);
  EXPECT_EQ(clean.vertices, tetrahedron().vertices);
  EXPECT_EQ(clean.triangles, tetrahedron().triangles);
  EXPECT_EQ(report.degenerateFaces, 2u);
  EXPECT_EQ(report.weldedVertices, 1u);
  EXPECT_EQ(report.unreferencedVertices, 2u);
  EXPECT_TRUE(report.closed());
}

TEST(MeshCleanup, dropsCollinearFaces) {
  TriangleMesh mesh = cube();
  mesh.vertices.push_back({-1, -1, 0.3});  // The vertex lies on edge 0-4, which already has two triangles.
  mesh.triangles.push_back({0, 4, 8});
  // The second collinear triangle lies in no coordinate plane, and its middle corner is rounded.
  mesh = joined(mesh, {{{5, 0, 0}, {5.1, 0.7, 0.3}, {5 + (5.1 - 5) / 2, 0.35, 0.15}}, {{0, 1, 2}}, ""});
  const auto [clean, report] = cleaned(mesh);
  EXPECT_EQ(report.degenerateFaces, 2u);
  EXPECT_EQ(report.flippedFaces, 0u);
  EXPECT_EQ(report.faces, 12u);
  EXPECT_EQ(report.vertices, 8u);
  EXPECT_TRUE(report.closed());
}

TEST(MeshCleanup, keepsThinTrianglesThatHaveAnArea) {
  TriangleMesh mesh = tetrahedron();
  mesh.vertices.push_back({0.5, -1e-12, 0});
  mesh.triangles.push_back({0, 1, 4});
  EXPECT_EQ(cleaned(mesh).report.faces, 5u);
  EXPECT_EQ(cleaned(mesh).report.degenerateFaces, 0u);
}

TEST(MeshCleanup, flipsACollinearFaceThatConnectsItsNeighbours) {
  // Vertex 8 lies on the cube's edge 0-4. The triangles of x = -1 use it, those of y = -1 do not, and a collinear
  // triangle connects the two sides. Dropping that triangle would open the mesh.
  TriangleMesh mesh = cube();
  mesh.vertices.push_back({-1, -1, 0.3});
  mesh.triangles[0] = {0, 8, 6};
  mesh.triangles.push_back({8, 4, 6});
  mesh.triangles.push_back({0, 4, 8});
  ASSERT_TRUE(inspect(mesh).closed());
  const auto [clean, report] = cleaned(mesh);
  EXPECT_EQ(report.flippedFaces, 1u);
  EXPECT_EQ(report.degenerateFaces, 0u);
  EXPECT_EQ(report.faces, 14u);
  EXPECT_EQ(report.vertices, 9u);
  EXPECT_TRUE(report.closed());
  EXPECT_DOUBLE_EQ(report.volume, 8);
  EXPECT_DOUBLE_EQ(report.area, 24);
  for (const auto& [a, b, c] : clean.triangles) {
    const Vector3& origin = clean.vertices[a];
    EXPECT_GT((clean.vertices[b] - origin).cross(clean.vertices[c] - origin).norm(), 0.1);
  }
}

TEST(MeshCleanup, flipsChainsOfCollinearFaces) {
  TriangleMesh mesh = cube();
  mesh.vertices.push_back({-1, -1, -0.5});  // vertex 8
  mesh.vertices.push_back({-1, -1, 0});     // vertex 9
  mesh.vertices.push_back({-1, -1, 0.5});   // vertex 10
  mesh.triangles[0] = {0, 8, 6};
  mesh.triangles.push_back({8, 9, 6});
  mesh.triangles.push_back({9, 10, 6});
  mesh.triangles.push_back({10, 4, 6});
  mesh.triangles.push_back({0, 9, 8});  // This triangle can be flipped only after triangle (0, 4, 9).
  mesh.triangles.push_back({9, 4, 10});
  mesh.triangles.push_back({0, 4, 9});
  ASSERT_TRUE(inspect(mesh).closed());
  const auto report = cleaned(mesh).report;
  EXPECT_EQ(report.flippedFaces, 3u);
  EXPECT_EQ(report.faces, 18u);
  EXPECT_TRUE(report.closed());
  EXPECT_DOUBLE_EQ(report.area, 24);
}

TEST(MeshCleanup, dropsFacesWithTheSameCornersInAnyOrientation) {
  TriangleMesh mesh = tetrahedron();
  mesh.triangles.push_back({2, 1, 0});  // the first triangle with rotated corners
  mesh.triangles.push_back({1, 0, 3});  // the second triangle, reversed
  const auto [clean, report] = cleaned(mesh);
  EXPECT_EQ(clean.triangles, tetrahedron().triangles);
  EXPECT_EQ(report.duplicateFaces, 2u);
  EXPECT_TRUE(report.closed());
}

TEST(MeshCleanup, keepsBothFacesOfASharedWall) {
  TriangleMesh cubes = joined(cube(), cube(1, {2, 0, 0}));
  for (const Vector3& center : {Vector3(0, 2, 0), Vector3(2, 2, 0), Vector3(0, 0, 2)})
    cubes = joined(cubes, cube(1, center));
  const auto [clean, report] = cleaned(cubes);
  EXPECT_EQ(clean.triangles.size(), 5 * 12u);
  EXPECT_EQ(report.duplicateFaces, 0u);
  EXPECT_EQ(report.boundaryEdges, 0u);
  EXPECT_EQ(report.unbalancedEdges, 0u);
  EXPECT_DOUBLE_EQ(report.volume, 5 * 8);

  const auto [again, twice] = cleaned(joined(cubes, cubes));
  EXPECT_EQ(again.triangles, clean.triangles);
  EXPECT_EQ(twice.duplicateFaces, 5 * 12u);
}

TEST(MeshCleanup, keepsAllFacesThatNestedBodiesShare) {
  const TriangleMesh low = support::boxBetween({0, 0, 0}, {1, 1, 1}), high = support::boxBetween({0, 0, 0}, {1, 1, 2});
  const auto [clean, report] = cleaned(joined(low, high));
  EXPECT_EQ(clean.triangles.size(), 24u) << "both bodies keep their bottom";
  EXPECT_EQ(report.duplicateFaces, 0u);
  EXPECT_EQ(report.unbalancedEdges, 0u);
  EXPECT_EQ(cleaned(joined(joined(low, high), low)).report.unbalancedEdges, 0u) << "one body occurs twice";
  for (int axis = 0; axis < 3; ++axis) {
    TriangleMesh side = low;
    std::erase_if(side.triangles, [&](const Triangle& t) {
      return std::ranges::any_of(t, [&](std::uint32_t v) { return low.vertices[v][axis] != 0; });
    });
    ASSERT_EQ(side.triangles.size(), 2u);
    const MeshReport once = cleaned(joined(joined(low, high), side)).report;
    EXPECT_EQ(once.unbalancedEdges, 0u) << "one body has a side twice " << axis;
    EXPECT_EQ(once.duplicateFaces, 2u) << axis;
  }
  for (std::size_t n = 0; n < 24; ++n) {
    TriangleMesh stray = joined(low, high);
    stray.triangles.push_back(stray.triangles[n]);
    EXPECT_EQ(cleaned(stray).report.unbalancedEdges, 0u) << n;
    EXPECT_EQ(cleaned(stray).report.duplicateFaces, 1u) << n;
  }
}

TEST(MeshCleanup, keepsTheFirstSideOfASurfaceModelledWithBothSides) {
  for (const TriangleMesh& one : {cube(), reversed(cube())}) {
    const auto [clean, report] = cleaned(joined(one, reversed(one)));
    EXPECT_EQ(clean.triangles, cube().triangles);
    EXPECT_EQ(report.duplicateFaces, 12u);
    EXPECT_TRUE(report.closed());
  }
  // The lid has triangles for both of its sides; without the lid, the edges around it would be boundary edges.
  TriangleMesh lid = cube(), box = cube();
  lid.triangles.erase(lid.triangles.begin(), lid.triangles.begin() + 10);
  box.triangles.resize(10);
  const auto [closed, report] = cleaned(joined(joined(box, lid), reversed(lid)));
  EXPECT_EQ(closed.triangles, cube().triangles);
  EXPECT_TRUE(report.closed());
}

TEST(MeshCleanup, dropsTheDuplicateOfOneOfTwoTouchingBodies) {
  const TriangleMesh both = joined(cube(), cube(1, {2, 0, 0}));
  EXPECT_EQ(cleaned(joined(both, cube())).mesh.triangles, cleaned(both).mesh.triangles);
}

TEST(MeshCleanup, keepsTheMoreFrequentOrientation) {
  EXPECT_EQ(cleaned(joined(joined(reversed(cube()), cube()), cube())).mesh.triangles, cube().triangles);
  EXPECT_FALSE(cleaned(joined(joined(reversed(cube()), cube()), cube())).report.reversed);
}

TEST(MeshCleanup, doesNotDependOnTheSize) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.9, 1.1);
  for (const double size : {1e-30, 1e-6, 1.0, 1e6, 1e30}) {
    TriangleMesh mesh = cube(size);
    for (Vector3& v : mesh.vertices) v *= uniform(random);
    const auto [clean, report] = cleaned(mesh);
    EXPECT_EQ(report.faces, 12u) << size;
    EXPECT_EQ(report.degenerateFaces, 0u) << size;
    EXPECT_TRUE(report.closed()) << size;
    EXPECT_NEAR(report.volume / std::pow(size, 3), 8, 4) << size;
  }
}

TEST(MeshCleanup, reversesTheWholeMeshWhenItsVolumeIsNegative) {
  const auto [clean, report] = cleaned(reversed(cube()));
  EXPECT_TRUE(report.reversed);
  EXPECT_EQ(clean.triangles, cube().triangles);
  EXPECT_DOUBLE_EQ(report.volume, 8);
  EXPECT_DOUBLE_EQ(signedVolume(clean), 8);
}

TEST(MeshCleanup, reversesACavityOnlyWithTheWholeMesh) {
  const TriangleMesh hollow = joined(cube(1), reversed(cube(0.5)));
  const auto [clean, report] = cleaned(hollow);
  EXPECT_FALSE(report.reversed);
  EXPECT_EQ(clean.triangles, hollow.triangles);
  EXPECT_EQ(report.components, 2u);
  EXPECT_DOUBLE_EQ(report.volume, 7);

  const auto [again, mended] = cleaned(reversed(hollow));
  EXPECT_TRUE(mended.reversed);
  EXPECT_EQ(again.triangles, hollow.triangles);
  EXPECT_DOUBLE_EQ(mended.volume, 7);
}

TEST(MeshCleanup, reversesAnOpenMeshOnlyWhenItsVolumeTellsItsOrientation) {
  TriangleMesh lidless = cube();
  lidless.triangles.resize(10);
  EXPECT_FALSE(cleaned(lidless).report.reversed);
  EXPECT_TRUE(cleaned(reversed(lidless)).report.reversed);

  // The volume of two slightly folded triangles has a sign without meaning.
  for (const double fold : {-1e-3, 1e-3}) {
    const TriangleMesh sheet = {{{0, 0, 0}, {1, 0, 0}, {1, 1, fold}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, ""};
    EXPECT_FALSE(cleaned(sheet).report.reversed);
    EXPECT_FALSE(cleaned(reversed(sheet)).report.reversed);
  }
}

TEST(MeshCleanup, reversesAMeshFarFromTheOrigin) {
  EXPECT_NEAR(cleaned(cube(1, {1e8, -1e8, 1e8})).report.volume, 8, 1e-12);
  EXPECT_TRUE(cleaned(reversed(cube(1, {1e8, -1e8, 1e8}))).report.reversed);
}

TEST(MeshCleanup, refusesMeshesThatAreNoSurface) {
  TriangleMesh mesh = tetrahedron();
  mesh.triangles[2][1] = 4;
  EXPECT_THAT(errorOf(mesh), AllOf(HasSubstr("tetrahedron: face 3 refers to vertex 5"), HasSubstr("only 4")));
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200}) {
    mesh = tetrahedron();
    mesh.vertices[1].z() = bad;
    EXPECT_THAT(errorOf(mesh), HasSubstr("tetrahedron: vertex 2 has a coordinate that is not a finite number"));
  }
  EXPECT_THAT(errorOf({{{0, 0, 0}}, {}, "dust"}), HasSubstr("dust: no faces"));
  EXPECT_THAT(errorOf({}), HasSubstr("mesh: no faces"));
  EXPECT_THAT(errorOf({{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}, {{0, 1, 2}, {0, 0, 1}}, "line"}),
              AllOf(HasSubstr("line: no face with an area (2 faces are degenerate)"), Not(HasSubstr("\n"))));
}

TEST(MeshReport, countsEdgesOfEachKind) {
  TriangleMesh open = tetrahedron();
  open.triangles.pop_back();
  MeshReport report = inspect(open);
  EXPECT_EQ(report.boundaryEdges, 3u);
  EXPECT_EQ(report.components, 1u);
  EXPECT_FALSE(report.closed());

  TriangleMesh flipped = tetrahedron();
  std::swap(flipped.triangles[0][0], flipped.triangles[0][1]);
  report = inspect(flipped);
  EXPECT_EQ(report.boundaryEdges, 0u);
  EXPECT_EQ(report.inconsistentEdges, 3u);
  EXPECT_FALSE(report.closed());

  const TriangleMesh fan = {
      {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, -1, 0}}, {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}}, ""};
  report = inspect(fan);
  EXPECT_EQ(report.nonManifoldEdges, 1u);
  EXPECT_EQ(report.boundaryEdges, 6u);
  EXPECT_EQ(report.inconsistentEdges, 0u);
  EXPECT_EQ(report.components, 1u);
}

TEST(MeshReport, componentsShareEdgesNotOnlyCorners) {
  TriangleMesh two = joined(tetrahedron(), cube(1, {5, 0, 0}));
  EXPECT_EQ(inspect(two).components, 2u);
  EXPECT_EQ(inspect(two).vertices, 12u);

  // The second tetrahedron shares one corner with the first.
  TriangleMesh other = tetrahedron();
  for (Vector3& v : other.vertices) v = -v;
  const MeshReport report = cleaned(joined(tetrahedron(), reversed(other))).report;
  EXPECT_EQ(report.vertices, 7u);
  EXPECT_EQ(report.components, 2u);
  EXPECT_TRUE(report.closed());
}

TEST(MeshReport, anEmptyMeshIsNotClosed) {
  const MeshReport report = inspect({});
  EXPECT_EQ(report.faces, 0u);
  EXPECT_EQ(report.components, 0u);
  EXPECT_TRUE(report.box.isEmpty());
  EXPECT_FALSE(report.closed());
}

TEST(TriangleMesh, boxSurroundsTheTrianglesOnly) {
  TriangleMesh mesh = tetrahedron();
  mesh.vertices.push_back({100, 100, 100});
  EXPECT_EQ(boundingBox(mesh).max(), Vector3(1, 1, 1));
  EXPECT_EQ(boundingBox(mesh).min(), Vector3(0, 0, 0));
  EXPECT_TRUE(boundingBox({{{1, 2, 3}}, {}, ""}).isEmpty());
}

TEST(TriangleMesh, hasTheVolumeAndAreaOfASolid) {
  EXPECT_DOUBLE_EQ(signedVolume(tetrahedron()), 1.0 / 6);
  EXPECT_DOUBLE_EQ(signedVolume(reversed(tetrahedron())), -1.0 / 6);
  EXPECT_DOUBLE_EQ(surfaceArea(tetrahedron()), 1.5 + std::sqrt(3.0) / 2);
}

TEST(TriangleMesh, fingerprintIsStable) {
  // The expected value is XXH3 of counts, vertices and triangles as little-endian bytes, computed independently.
  EXPECT_EQ(fingerprint({}), 0xd0a66a65c7528968u);
  EXPECT_EQ(fingerprint(tetrahedron()), 0x83695951d65216dau);
  TriangleMesh mesh = tetrahedron();
  mesh.name = "another name";
  EXPECT_EQ(fingerprint(mesh), fingerprint(tetrahedron()));
  mesh.vertices[0].x() = -0.0;
  EXPECT_EQ(fingerprint(mesh), fingerprint(tetrahedron()));
  mesh.vertices[0].x() = std::numeric_limits<double>::denorm_min();
  EXPECT_NE(fingerprint(mesh), fingerprint(tetrahedron()));
  EXPECT_NE(fingerprint(reversed(tetrahedron())), fingerprint(tetrahedron()));
}

TEST(TriangleMesh, normalizedSpansExactlyTwo) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    const double size = std::pow(10, 8 * uniform(random));
    const Vector3 offset = 10 * size * Vector3(uniform(random), uniform(random), uniform(random));
    TriangleMesh mesh;
    for (int i = 0; i < 30; ++i)
      mesh.vertices.push_back(offset + size * Vector3(uniform(random), 0.9 * uniform(random), 0.3 * uniform(random)));
    for (std::uint32_t i = 0; i < 30; i += 3) mesh.triangles.push_back({i, i + 1, i + 2});
    const TriangleMesh result = normalized(mesh);
    const Box box = boundingBox(result);
    Eigen::Index longest = 0;
    boundingBox(mesh).sizes().maxCoeff(&longest);
    EXPECT_EQ(box.min()[longest], -1);
    EXPECT_EQ(box.max()[longest], 1);
    EXPECT_TRUE((box.min().array() >= -1).all() && (box.max().array() <= 1).all());
    EXPECT_TRUE((box.min() + box.max()).isZero(1e-15)) << (box.min() + box.max()).transpose();
    const double ratio = boundingBox(mesh).sizes()[longest] / 2;
    EXPECT_NEAR((result.vertices[0] - result.vertices[1]).norm() * ratio, (mesh.vertices[0] - mesh.vertices[1]).norm(),
                1e-13 * size);
  }
}

TEST(TriangleMesh, normalizedNeedsAnExtent) {
  EXPECT_THROW(normalized({}), Error);
  EXPECT_THROW(normalized({{{1, 1, 1}}, {{0, 0, 0}}, "dot"}), Error);
  EXPECT_THROW(normalized({{{1, 1, 1}}, {{0, 0, 1}}, "broken"}), Error);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(normalized({{{0, 0, 0}, {nan, nan, nan}, {nan, 0, 0}}, {{0, 1, 2}}, "nan"}), Error);
}

}  // namespace mesh_cleanup_test
}  // namespace hpsdf
