#pragma once
// A picture against its baseline.

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "hpsdf/render/image.h"

namespace hpsdf::render {

/// A channel may differ by so much of 255 for free: low bits of another processor, rounded.
constexpr int kFreeDifference = 3;
/// Share of the pixels that may differ more, at cell edges and silhouettes, where a low bit decides between two cells.
constexpr double kPixelBudget = 0.002;

struct Comparison {
  std::array<int, 2> baselineSize = {};  ///< width and height
  std::array<int, 2> actualSize = {};
  std::size_t compared = 0;   ///< pixels; none where the sizes differ
  std::size_t differing = 0;  ///< pixels with a channel beyond what is free
  int largest = 0;            ///< difference of a channel

  bool sameSize() const { return baselineSize == actualSize; }
};
Comparison compare(const Image& baseline, const Image& actual);

/// What is wrong, in one line; empty where the sizes are the same and at most a share of `budget` of the pixels
/// differs.
std::string problem(const Comparison& comparison, double budget);

/// Where two pictures of one size differ: black where they do not, dark where it is free, from mid grey to white with
/// the difference where it is not.
Image differencePicture(const Image& baseline, const Image& actual);

struct PixelDifference {
  int x;
  int y;  ///< from the top
  Color baseline;
  Color actual;
  int difference;  ///< of the worst channel
};
/// The worst first, at most `count` of them; of those that lie near each other only the worst. Pictures of one size.
std::vector<PixelDifference> worstPixels(const Image& baseline, const Image& actual, std::size_t count);

}  // namespace hpsdf::render
