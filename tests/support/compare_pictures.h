#pragma once

#include <algorithm>
#include <cstdlib>
#include <string>

#include "hpsdf/render/image.h"

namespace hpsdf::support {

/// What is wrong with a picture against its baseline; empty where they agree: the same size, and all but a share of
/// `budget` of the pixels within 3/255 a channel.
inline std::string pictureProblem(const render::Image& baseline, const render::Image& actual, double budget) {
  if (baseline.width != actual.width || baseline.height != actual.height)
    return "the sizes differ: " + std::to_string(baseline.width) + "x" + std::to_string(baseline.height) + " and " +
           std::to_string(actual.width) + "x" + std::to_string(actual.height);
  std::size_t different = 0;
  int largest = 0;
  for (std::size_t n = 0; n < baseline.pixels.size(); ++n) {
    int difference = 0;
    for (int channel = 0; channel < 3; ++channel)
      difference = std::max(difference, std::abs(int(baseline.pixels[n][channel]) - int(actual.pixels[n][channel])));
    different += difference > 3;
    largest = std::max(largest, difference);
  }
  if (double(different) <= budget * double(baseline.pixels.size())) return {};
  return std::to_string(different) + " of " + std::to_string(baseline.pixels.size()) +
         " pixels differ by more than 3/255, at most by " + std::to_string(largest);
}

}  // namespace hpsdf::support
