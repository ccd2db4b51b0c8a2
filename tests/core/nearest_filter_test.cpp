// Tests the choice of the triangles of an exact leaf that can be nearest, against distances in double precision.
#include "field/query/nearest_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "hpsdf/exact_distance.h"

namespace hpsdf {
namespace nearest_filter_test {

using query::keepNearest;

/// Small triangles in a cube, each with its own vertices, and a list of all of them.
struct Example {
  std::vector<Vector3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<ExactDistance> distances;  ///< to each triangle alone
  std::vector<std::uint32_t> runs;
  std::vector<std::uint8_t> octants;  ///< without room at the end, so that a read beyond it is found

  Example(std::uint32_t count, std::mt19937& random) {
    std::uniform_real_distribution<double> anywhere(-1, 1);
    const auto point = [&] { return Vector3(anywhere(random), anywhere(random), anywhere(random)); };
    for (std::uint32_t i = 0; i < count; ++i) {
      const Vector3 centre = Vector3(10, 20, 30) + point();
      TriangleMesh one;
      for (int k = 0; k < 3; ++k) one.vertices.push_back((centre + 0.2 * point()).cast<float>().cast<double>());
      one.triangles.push_back({0, 1, 2});
      distances.emplace_back(one);
      triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
      vertices.insert(vertices.end(), one.vertices.begin(), one.vertices.end());
      octants.push_back(static_cast<std::uint8_t>(random()));
    }
    for (std::uint32_t first = 0; first < count;) {
      const std::uint32_t length = std::min(count - first, 1 + static_cast<std::uint32_t>(random()) % 16);
      runs.push_back(triangle_run::packed(first, length));
      first += length;
    }
    runs.back() |= triangle_run::kLast;
  }

  /// Returns the triangles that are kept, in the order of the list.
  template <typename V>
  std::vector<std::uint32_t> kept(const Vector3& x, int octant, double radius) const {
    std::vector<V> converted;
    for (const Vector3& vertex : vertices) converted.push_back(vertex.cast<typename V::Scalar>());
    query::ListPart rest{runs.data(), octants};
    float nearest = std::numeric_limits<float>::infinity();
    std::vector<std::uint32_t> result;
    while (rest.run != nullptr) {
      std::array<std::uint32_t, mesh::TriangleChunk::kSize + query::kFilterWidth> part;
      const std::uint32_t count = keepNearest(query::CornerSource<V>{triangles, converted, x}, rest, octant,
                                              static_cast<float>(radius), part.data(), nearest);
      result.insert(result.end(), part.begin(), part.begin() + count);
    }
    return result;
  }

  double distance(std::uint32_t triangle, const Vector3& x) const {
    return (distances[triangle].closestPoint(x).point - x).norm();
  }
};

TEST(NearestFilter, keepsAllThatCanBeNearestAndFewMore) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(-1, 1);
  std::size_t keptCount = 0, neededCount = 0;
  for (const std::uint32_t count : {1, 2, 3, 4, 5, 15, 16, 17, 63, 64, 65, 127, 128, 129, 300}) {
    const Example example(count, random);
    for (int octant = 0; octant < 8; ++octant) {
      const Vector3 x = Vector3(10, 20, 30) + Vector3(anywhere(random), anywhere(random), anywhere(random));
      const double radius = octant < 4 ? 0 : 0.05;
      double nearest = std::numeric_limits<double>::infinity();
      std::vector<std::uint32_t> inOctant, needed;
      for (std::uint32_t i = 0; i < count; ++i)
        if (example.octants[i] >> octant & 1) inOctant.push_back(i);
      for (const std::uint32_t i : inOctant) nearest = std::min(nearest, example.distance(i, x));
      for (const std::uint32_t i : inOctant)
        if (example.distance(i, x) <= nearest + 2 * radius) needed.push_back(i);
      const auto kept = example.kept<Eigen::Vector3f>(x, octant, radius);
      EXPECT_TRUE(std::ranges::includes(inOctant, kept)) << count << " triangles, octant " << octant;
      EXPECT_TRUE(std::ranges::includes(kept, needed)) << count << " triangles, octant " << octant;
      EXPECT_EQ(kept, example.kept<Eigen::Vector3d>(x, octant, radius));
      if (count > 16 && count <= 128) {  // a longer list is filtered in parts, whose first one does not know the others
        keptCount += kept.size();
        neededCount += needed.size();
      }
    }
  }
  EXPECT_LE(keptCount, neededCount + neededCount / 10);
}

TEST(NearestFilter, readsNothingBehindTheLastVertex) {
  const std::vector<Eigen::Vector3f> vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 5}};
  const std::vector<std::array<std::uint32_t, 3>> triangles = {{1, 2, 3}};
  mesh::TriangleChunk chunk;
  std::array<std::uint32_t, 1 + query::kFilterWidth> list = {0};
  loadCorners(query::CornerSource<Eigen::Vector3f>{triangles, vertices, Vector3(1, 1, 1)}, list.data(), 1, chunk);
  EXPECT_EQ(chunk.corners[2][0][0], -1);
  EXPECT_EQ(chunk.corners[2][1][0], -1);
  EXPECT_EQ(chunk.corners[2][2][0], 4);
}

}  // namespace nearest_filter_test
}  // namespace hpsdf
