#pragma once
// Comparison of a picture with its baseline.

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "hpsdf/render/image.h"

namespace hpsdf::render {

/// The tolerated difference of a channel, out of 255: processors differ in how they round the lowest bits.
constexpr int kFreeDifference = 3;
/// The tolerated share of pixels that differ by more: at cell edges and silhouettes the lowest bit may choose the
/// cell.
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

/// Describes in one line why the comparison fails; empty if the sizes are equal and at most a share of `budget` of the
/// pixels differ.
std::string problem(const Comparison& comparison, double budget);

/// Shows the differences between two pictures of the same size: black where the pixels are equal, dark grey where
/// their difference is tolerated, and from mid grey to white where it is not.
Image differencePicture(const Image& baseline, const Image& actual);

struct PixelDifference {
  int x;
  int y;  ///< row, counted from the top
  Color baseline;
  Color actual;
  int difference;  ///< difference of the channel that differs most
};
/// At most `count` of the pixels that differ most, the worst first. Of neighbouring pixels only the worst is
/// listed. Both pictures must have the same size.
std::vector<PixelDifference> worstPixels(const Image& baseline, const Image& actual, std::size_t count);

}  // namespace hpsdf::render
