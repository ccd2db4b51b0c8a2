#pragma once
// Comparison of a picture with its baseline, the accepted picture of a test.

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "hpsdf/render/image.h"

namespace hpsdf::render {

/// The tolerated difference of a colour channel, out of 255, because processors round differently.
constexpr int kFreeDifference = 3;
/// The tolerated fraction of pixels that differ by more than `kFreeDifference`. At cell edges and silhouettes, a
/// rounding error may decide which cell a pixel shows.
constexpr double kPixelBudget = 0.002;

struct Comparison {
  std::array<int, 2> baselineSize = {};  ///< width and height
  std::array<int, 2> actualSize = {};    ///< width and height
  std::size_t compared = 0;              ///< number of pixels compared; 0 where the sizes differ
  std::size_t differing = 0;             ///< number of pixels with a channel that differs by more than kFreeDifference
  int largest = 0;                       ///< largest difference of a channel

  bool sameSize() const { return baselineSize == actualSize; }
};
Comparison compare(const Image& baseline, const Image& actual);

/// Returns a line that says why a comparison fails. Returns an empty string if both pictures have the same size and at
/// most the fraction `budget` of the pixels differs.
std::string problem(const Comparison& comparison, double budget);

/// Returns a picture of the differences between two pictures of the same size. A pixel is black if the two
/// pictures are equal there, dark grey if their difference is tolerated, and mid grey to white if it is
/// not.
Image differencePicture(const Image& baseline, const Image& actual);

struct PixelDifference {
  int x;
  int y;  ///< row, counted from the top
  Color baseline;
  Color actual;
  int difference;  ///< difference of the channel that differs most
};
/// Returns at most `count` of the pixels that differ most, the greatest difference first. From a group of neighbouring
/// pixels, only the one with the greatest difference is listed. Both pictures must have the same size.
std::vector<PixelDifference> worstPixels(const Image& baseline, const Image& actual, std::size_t count);

}  // namespace hpsdf::render
