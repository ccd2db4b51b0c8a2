#include "hpsdf/render/compare.h"

#include <algorithm>
#include <cassert>
#include <cstdlib>

namespace hpsdf::render {
namespace {

/// Two differing pixels count as neighbours if they are less than this many pixels apart along both axes. Only one of
/// several neighbours is listed, so that a single edge cannot fill the list of differing pixels.
constexpr int kNeighbourhood = 16;

int difference(const Color& a, const Color& b) {
  int worst = 0;
  for (std::size_t channel = 0; channel < a.size(); ++channel)
    worst = std::max(worst, std::abs(int(a[channel]) - int(b[channel])));
  return worst;
}

std::string sizeText(const std::array<int, 2>& size) { return std::to_string(size[0]) + "x" + std::to_string(size[1]); }

}  // namespace

Comparison compare(const Image& baseline, const Image& actual) {
  Comparison result{.baselineSize = {baseline.width, baseline.height}, .actualSize = {actual.width, actual.height}};
  if (!result.sameSize()) return result;
  result.compared = baseline.pixels.size();
  for (std::size_t n = 0; n < baseline.pixels.size(); ++n) {
    const int here = difference(baseline.pixels[n], actual.pixels[n]);
    result.differing += here > kFreeDifference ? 1 : 0;
    result.largest = std::max(result.largest, here);
  }
  return result;
}

std::string problem(const Comparison& comparison, double budget) {
  if (!comparison.sameSize())
    return "the sizes differ: " + sizeText(comparison.baselineSize) + " and " + sizeText(comparison.actualSize);
  if (double(comparison.differing) <= budget * double(comparison.compared)) return {};
  return std::to_string(comparison.differing) + " of " + std::to_string(comparison.compared) +
         " pixels differ by more than " + std::to_string(kFreeDifference) + "/255, at most by " +
         std::to_string(comparison.largest);
}

Image differencePicture(const Image& baseline, const Image& actual) {
  assert(baseline.width == actual.width && baseline.height == actual.height);
  Image picture(baseline.width, baseline.height, Color{});
  for (std::size_t n = 0; n < baseline.pixels.size(); ++n) {
    const int here = difference(baseline.pixels[n], actual.pixels[n]);
    const int grey = here > kFreeDifference ? 96 + here * (255 - 96) / 255 : 12 * here;
    picture.pixels[n].fill(static_cast<std::uint8_t>(grey));
  }
  return picture;
}

std::vector<PixelDifference> worstPixels(const Image& baseline, const Image& actual, std::size_t count) {
  assert(baseline.width == actual.width && baseline.height == actual.height);
  std::vector<PixelDifference> all;
  for (int y = 0; y < baseline.height; ++y)
    for (int x = 0; x < baseline.width; ++x)
      if (const int here = difference(baseline.at(x, y), actual.at(x, y)); here > 0)
        all.push_back({x, y, baseline.at(x, y), actual.at(x, y), here});
  std::ranges::stable_sort(all, std::ranges::greater(), &PixelDifference::difference);
  std::vector<PixelDifference> worst;
  for (const PixelDifference& pixel : all) {
    if (worst.size() == count) break;
    const bool isNear = std::ranges::any_of(worst, [&](const PixelDifference& other) {
      return std::abs(pixel.x - other.x) < kNeighbourhood && std::abs(pixel.y - other.y) < kNeighbourhood;
    });
    if (!isNear) worst.push_back(pixel);
  }
  return worst;
}

}  // namespace hpsdf::render
