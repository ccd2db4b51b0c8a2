#include "picture/cracks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace hpsdf::render {
namespace {

/// Returns 1 for each sample that is at most `radius` samples away from a crack along both axes, else 0.
std::vector<std::uint8_t> dilated(const ViewBuffers& buffers, int radius) {
  const int width = buffers.width, height = buffers.height;
  std::vector<std::uint8_t> result(buffers.crack.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!buffers.crack[std::size_t(y) * width + x]) continue;
      const int first = std::max(0, x - radius), last = std::min(width - 1, x + radius);
      for (int v = std::max(0, y - radius); v <= std::min(height - 1, y + radius); ++v)
        std::fill_n(&result[std::size_t(v) * width + first], last - first + 1, std::uint8_t{1});
    }
  return result;
}

/// Calls f(x, y, count) for every pixel with at least one marked sample. `count` is the number of its marked
/// samples.
template <typename F>
void forEachMarked(const std::vector<std::uint8_t>& marks, int width, int height, int samples, F&& f) {
  for (int y = 0; y < height / samples; ++y)
    for (int x = 0; x < width / samples; ++x) {
      int count = 0;
      for (int v = y * samples; v < (y + 1) * samples; ++v)
        for (int u = x * samples; u < (x + 1) * samples; ++u) count += marks[std::size_t(v) * width + u];
      if (count > 0) f(x, y, count);
    }
}

}  // namespace

Cracks cracksOf(const ViewBuffers& buffers, double offset, int samples) {
  Cracks cracks;
  forEachMarked(buffers.crack, buffers.width, buffers.height, samples, [&](int, int, int) { ++cracks.pixels; });
  for (std::size_t i = 0; i < buffers.crack.size(); ++i)
    if (buffers.crack[i]) cracks.widest = std::max(cracks.widest, std::abs(buffers.value[i] - offset));
  return cracks;
}

void markCracks(Image& picture, const ViewBuffers& buffers, const Sampling& sampling) {
  const int radius = static_cast<int>(std::lround(std::max(1.0, sampling.lineWidth) * sampling.samples));
  const LinearColor color = decodeSrgb(kCrackColor);
  const float share = 1.0F / float(sampling.samples * sampling.samples);
  forEachMarked(dilated(buffers, radius), buffers.width, buffers.height, sampling.samples,
                [&](int x, int y, int count) { mixInto(picture.at(x, y), color, share * float(count)); });
}

}  // namespace hpsdf::render
