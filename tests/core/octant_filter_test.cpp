// Tests the filter of an exact leaf's triangles by octant against a loop.
#include "field/query/octant_filter.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

namespace hpsdf {
namespace octant_filter_test {

TEST(OctantFilter, keepsWhatALoopKeeps) {
  std::mt19937 random(5);
  for (std::uint32_t count = 0; count <= 70; ++count) {
    for (int octant = 0; octant < 8; ++octant) {
      std::vector<std::uint8_t> octants(count);  // without room at the end, so that a read beyond it is found
      for (std::uint8_t& byte : octants) byte = static_cast<std::uint8_t>(random());
      std::vector<std::uint32_t> triangles(count + query::kFilterWidth);
      std::iota(triangles.begin(), triangles.end(), 1000u);
      std::vector<std::uint32_t> expected;
      for (std::uint32_t i = 0; i < count; ++i)
        if (octants[i] >> octant & 1) expected.push_back(1000 + i);
      triangles.resize(query::keepInOctant(octants.data(), octant, triangles.data(), count));
      EXPECT_EQ(triangles, expected) << count << " triangles, octant " << octant;
    }
  }
}

}  // namespace octant_filter_test
}  // namespace hpsdf
