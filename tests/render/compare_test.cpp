#include "hpsdf/render/compare.h"

#include <gtest/gtest.h>

namespace hpsdf::render {
namespace compare_test {

const Color kGrey = {100, 100, 100};

Image grey() { return Image(50, 20, kGrey); }  // 1000 pixels, of which 0.2 % (two) may differ

/// Returns the grey picture with `count` pixels of another colour.
Image withSpots(int count, Color color) {
  Image image = grey();
  for (int n = 0; n < count; ++n) image.pixels[std::size_t(n) * 37] = color;
  return image;
}

std::string problemWith(const Image& actual, double budget = kPixelBudget) {
  return problem(compare(grey(), actual), budget);
}

TEST(Comparison, findsNoDifferenceOfAPictureToItself) {
  const Comparison same = compare(grey(), grey());
  EXPECT_EQ(same.compared, 1000u);
  EXPECT_EQ(same.differing, 0u);
  EXPECT_EQ(same.largest, 0);
  EXPECT_EQ(problem(same, 0), "");
}

TEST(Comparison, toleratesADifferenceOfThreeButNotOfFour) {
  EXPECT_EQ(problemWith(Image(50, 20, {103, 97, 100}), 0), "");
  EXPECT_NE(problemWith(Image(50, 20, {100, 100, 104})), "");
  EXPECT_NE(problemWith(Image(50, 20, {96, 100, 100})), "");
  EXPECT_NE(problemWith(Image(50, 20, {100, 96, 100})), "");
}

TEST(Comparison, allowsAShareOfThePixels) {
  EXPECT_EQ(problemWith(withSpots(2, {255, 0, 0})), "");
  EXPECT_EQ(problemWith(withSpots(3, {255, 0, 0})), "3 of 1000 pixels differ by more than 3/255, at most by 155");
  EXPECT_EQ(problemWith(withSpots(3, {255, 0, 0}), 0.003), "");
  EXPECT_NE(problemWith(withSpots(1, {255, 0, 0}), 0), "");
}

TEST(Comparison, rejectsAnotherSizeWhateverTheBudget) {
  EXPECT_EQ(problemWith(Image(20, 50, kGrey), 1), "the sizes differ: 50x20 and 20x50");
  EXPECT_NE(problemWith(Image(), 1), "");
}

TEST(DifferencePicture, distinguishesToleratedDifferences) {
  Image actual = grey();
  actual.at(1, 2) = {100, 101, 100};
  actual.at(3, 4) = {100, 100, 103};
  actual.at(5, 6) = {96, 100, 100};
  actual.at(7, 8) = {255, 100, 100};
  const Image difference = differencePicture(grey(), actual);
  const int none = difference.at(0, 0)[0], least = difference.at(1, 2)[0], free = difference.at(3, 4)[0],
            beyond = difference.at(5, 6)[0], far = difference.at(7, 8)[0];
  EXPECT_EQ(none, 0);
  EXPECT_LT(none, least);
  EXPECT_LT(least, free);
  EXPECT_LT(2 * free, beyond) << "a pixel that counts is seen at once";
  EXPECT_LT(beyond, far);
  EXPECT_EQ(differencePicture(Image(1, 1, {0, 0, 0}), Image(1, 1, {255, 0, 0})).at(0, 0), (Color{255, 255, 255}));
}

TEST(WorstPixels, areSortedAndApart) {
  Image actual = grey();
  actual.at(2, 3) = {100, 100, 140};
  actual.at(3, 3) = {100, 100, 139};  // next to a listed pixel, so not listed
  actual.at(40, 10) = {0, 100, 100};
  actual.at(20, 19) = {101, 100, 100};
  const auto worst = worstPixels(grey(), actual, 10);
  ASSERT_EQ(worst.size(), 3u);
  EXPECT_EQ(worst[0].x, 40);
  EXPECT_EQ(worst[0].y, 10);
  EXPECT_EQ(worst[0].difference, 100);
  EXPECT_EQ(worst[0].baseline, kGrey);
  EXPECT_EQ(worst[0].actual, (Color{0, 100, 100}));
  EXPECT_EQ(worst[1].x, 2);
  EXPECT_EQ(worst[2].difference, 1);
  EXPECT_EQ(worstPixels(grey(), actual, 1).size(), 1u);
  EXPECT_TRUE(worstPixels(grey(), grey(), 10).empty());
}

}  // namespace compare_test
}  // namespace hpsdf::render
