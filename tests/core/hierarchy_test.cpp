// The layout of the hierarchy of triangles, its size, and the frames of triangles that a search computes in SIMD.

#include "bvh/hierarchy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <span>
#include <vector>

#include "bvh/search.h"
#include "hpsdf/shapes.h"

namespace hpsdf {
namespace hierarchy_test {

using bvh::Hierarchy;
using bvh::kBlockBit;
using bvh::kEmpty;
using bvh::kWidth;
using bvh::Nearest;
using bvh::TriangleFrame;

Vector3 inCube(std::mt19937_64& random) {
  std::uniform_real_distribution<double> coordinate(-1, 1);
  const double x = coordinate(random), y = coordinate(random);
  return {x, y, coordinate(random)};
}

/// Triangles of all sizes, some of them without area or collapsed to an edge or a point.
TriangleMesh soup(std::uint32_t count) {
  std::mt19937_64 random(31);
  TriangleMesh mesh;
  for (std::uint32_t t = 0; t < count; ++t) {
    const Vector3 a = inCube(random), b = a + (t % 3 == 0 ? 0.5 : 0.05) * inCube(random);
    const Vector3 c = t % 11 == 0   ? Vector3((a + b) / 2)
                      : t % 13 == 0 ? a
                      : t % 5 == 0  ? Vector3(a + 1e-8 * inCube(random))
                                    : Vector3(a + 0.1 * inCube(random));
    mesh.vertices.insert(mesh.vertices.end(), {a, t % 29 == 0 ? a : b, c});
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  return mesh;
}

Hierarchy hierarchyOf(const TriangleMesh& mesh) { return Hierarchy(mesh, boundingBox(mesh)); }

/// Counts how often each block is a child of a node that can be reached from the root.
std::vector<int> visitsOf(const Hierarchy& hierarchy) {
  std::vector<int> visits(hierarchy.blocks().size());
  std::vector<std::uint32_t> stack = {0};
  while (!stack.empty()) {
    const bvh::Node& node = hierarchy.nodes()[stack.back()];
    stack.pop_back();
    for (const std::uint32_t child : node.child) {
      if (child == kEmpty) continue;
      if ((child & kBlockBit) != 0)
        ++visits.at(child & ~kBlockBit);
      else
        stack.push_back(child);
    }
  }
  return visits;
}

TEST(Hierarchy, holdsEachTriangleOnceInFullBlocks) {
  for (const std::uint32_t count : {1u, 3u, 4u, 5u, 8u, 9u, 31u, 32u, 33u, 34u, 35u, 257u, 5000u}) {
    const TriangleMesh mesh = soup(count);
    const Hierarchy hierarchy = hierarchyOf(mesh);
    ASSERT_EQ(hierarchy.blocks().size(), (count + kWidth - 1) / kWidth);
    EXPECT_THAT(visitsOf(hierarchy), testing::Each(1)) << count;
    std::vector<std::uint32_t> numbers(hierarchy.numbers().begin(), hierarchy.numbers().end());
    for (std::uint32_t slot = 0; slot < count; ++slot)
      for (int k = 0; k < 3; ++k)
        EXPECT_EQ(hierarchy.corners(slot)[k], mesh.vertices[mesh.triangles[numbers[slot]][k]]);
    std::ranges::sort(numbers);
    std::vector<std::uint32_t> all(count);
    std::iota(all.begin(), all.end(), 0U);
    EXPECT_EQ(numbers, all);
  }
}

/// The size that the comment of `Hierarchy` tells.
TEST(Hierarchy, takesAtMost110BytesATriangle) {
  for (const TriangleMesh& mesh :
       {shapes::mesh("sphere,subdivisions=5"), shapes::mesh("torus,segments=150,sides=70")}) {
    const Hierarchy hierarchy = hierarchyOf(mesh);
    EXPECT_LT(double(hierarchy.bytes()) / double(mesh.triangles.size()), 110);
    EXPECT_GT(double(hierarchy.bytes()) / double(mesh.triangles.size()), 100);
  }
}

void expectFrame(const Nearest& nearest, const Hierarchy& hierarchy, const Vector3& x) {
  const TriangleFrame frame = hierarchy.frame(nearest.slot);
  const bvh::FramePoint point = locate(frame, x);
  EXPECT_EQ(nearest.normal, frame.normal);
  EXPECT_EQ(nearest.length, frame.length);
  EXPECT_EQ(nearest.firstCorner, frame.firstCorner);
  EXPECT_EQ(nearest.point.height, point.height);
  EXPECT_EQ(nearest.point.side, point.side);
  EXPECT_EQ(nearest.point.inside, point.inside);
}

/// A search makes the frames of four triangles at a time, on every instruction set with the same bits as `makeFrame`.
TEST(Hierarchy, searchesWithTheFramesOfMakeFrame) {
  for (const TriangleMesh& mesh : {soup(700), shapes::mesh("sphere,subdivisions=4")}) {
    const Hierarchy hierarchy = hierarchyOf(mesh);
    std::mt19937_64 random(32);
    std::vector<Vector3> points(160);
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      for (int round = 0; round < 20; ++round) {
        for (std::size_t i = 0; i < points.size(); ++i) {
          const std::uint32_t slot = static_cast<std::uint32_t>(random() % mesh.triangles.size());
          points[i] = hierarchy.corners(slot)[i % 3] + (i % 4 == 0 ? 0.5 : 0.01) * inCube(random);
        }
        for (std::size_t first = 0; first < points.size(); first += bvh::kPacket) {
          std::array<Nearest, bvh::kPacket> nearest{};
          bvh::nearestTriangles(hierarchy, std::span(points).subspan(first, bvh::kPacket), nearest);
          for (std::size_t i = 0; i < nearest.size(); ++i) {
            expectFrame(nearest[i], hierarchy, points[first + i]);
            EXPECT_EQ(bvh::nearestTriangle(hierarchy, points[first + i]).slot, nearest[i].slot);
          }
        }
      }
      hwy::SetSupportedTargetsForTest(0);
    }
  }
}

/// Points to which single precision cannot tell triangles apart are compared with all of them.
TEST(Hierarchy, searchesFarAndNotFinitePoints) {
  const TriangleMesh mesh = soup(300);
  const Hierarchy hierarchy = hierarchyOf(mesh);
  for (const Vector3& x : {Vector3(1e18, 2, 3), Vector3(0, -1e30, 1e30), Vector3(5, 5, 5)})
    expectFrame(bvh::nearestTriangle(hierarchy, x), hierarchy, x);
  EXPECT_EQ(bvh::nearestTriangle(hierarchy, Vector3(NAN, 0, 0)).slot, 0u);
}

}  // namespace hierarchy_test
}  // namespace hpsdf
