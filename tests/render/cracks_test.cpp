#include "picture/cracks.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "view/view_buffers.h"

namespace hpsdf::render {
namespace cracks_test {

constexpr Color kGrey = {90, 90, 90};

/// Returns a view in which the given samples show cracks of the given height.
ViewBuffers torn(int width, int height, const std::set<std::pair<int, int>>& samples, float step) {
  ViewBuffers buffers = emptyBuffers(width, height, true);
  for (const auto& [x, y] : samples) {
    const std::size_t i = std::size_t(y) * width + x;
    buffers.cell[i] = 0;
    buffers.crack[i] = 1;
    buffers.value[i] = step;
  }
  return buffers;
}

TEST(CracksOfAView, areCountedInPixelsAndMeasuredFromTheOffset) {
  ViewBuffers buffers = torn(12, 9, {{0, 0}, {1, 2}, {2, 2}, {11, 8}}, 0.3F);
  buffers.value[0] = 0.02F;
  EXPECT_EQ(cracksOf(buffers, 0.1, 1).pixels, 4u);
  EXPECT_NEAR(cracksOf(buffers, 0.1, 1).widest, 0.2, 1e-7);
  EXPECT_EQ(cracksOf(buffers, 0.1, 3).pixels, 2u) << "three samples are one pixel's";
  const Cracks none = cracksOf(torn(12, 9, {}, 0), 0.1, 3);
  EXPECT_EQ(none.pixels, 0u);
  EXPECT_EQ(none.widest, 0);
}

TEST(MarkedCracks, areAPixelWiderOnEverySide) {
  Image picture(20, 12, kGrey);  // the view is only a part of it
  markCracks(picture, torn(16, 9, {{7, 4}, {0, 0}, {15, 8}}, 1), {1, 1, 1});
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 20; ++x) {
      const bool marked = (std::abs(x - 7) <= 1 && std::abs(y - 4) <= 1) || (x <= 1 && y <= 1) ||
                          (x >= 14 && x <= 15 && y >= 7 && y <= 8);
      EXPECT_EQ(picture.at(x, y), marked ? kCrackColor : kGrey) << x << ", " << y;
    }
}

TEST(MarkedCracks, ofASingleSampleFillAPixelAndFadeBesideIt) {
  Image picture(9, 9, kGrey);
  markCracks(picture, torn(27, 27, {{13, 13}}, 1), {3, 1, 1});
  EXPECT_EQ(picture.at(4, 4), kCrackColor);
  for (const auto& [x, y] : {std::pair(3, 4), {5, 4}, {4, 3}, {4, 5}}) {
    EXPECT_GT(picture.at(x, y)[2], 200) << x << ", " << y;
    EXPECT_LT(picture.at(x, y)[1], kCrackColor[1]) << x << ", " << y;
    EXPECT_NE(picture.at(x, y), kCrackColor) << x << ", " << y;
  }
  EXPECT_EQ(picture.at(2, 4), kGrey);
  EXPECT_EQ(picture.at(4, 6), kGrey);
}

TEST(MarkedCracks, areAsBroadAsThePicturesLines) {
  Image picture(30, 30, kGrey);
  markCracks(picture, torn(30, 30, {{15, 15}}, 1), {1, 3, 1});
  EXPECT_EQ(picture.at(18, 15), kCrackColor);
  EXPECT_EQ(picture.at(19, 15), kGrey);
}

}  // namespace cracks_test
}  // namespace hpsdf::render
