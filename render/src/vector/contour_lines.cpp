#include "vector/contour_lines.h"

#include <array>
#include <unordered_map>

#include "vector/paths.h"

namespace hpsdf::render {
namespace {

constexpr double kContourTolerance = 0.02;  // pixels

/// The points in which a level crosses the lines between neighbouring samples. Each has a number.
class LevelCrossings {
 public:
  LevelCrossings(const ViewBuffers& buffers, int samples, double level)
      : buffers_(buffers), samples_(samples), level_(level) {}

  double above(std::size_t i) const { return double(buffers_.value[i]) - level_; }

  /// Returns the number of the crossing between samples a and b, where a < b.
  int between(std::size_t a, std::size_t b) {
    const auto [found, isNew] = numbers_.try_emplace(2 * a + (b == a + 1 ? 0 : 1), int(points.size()));
    if (isNew) {
      const double t = above(a) / (above(a) - above(b));
      points.push_back((1 - t) * middle(a) + t * middle(b));
    }
    return found->second;
  }

  std::vector<Eigen::Vector2d> points;

 private:
  Eigen::Vector2d middle(std::size_t i) const {
    const auto width = std::size_t(buffers_.width);
    return Eigen::Vector2d(double(i % width) + 0.5, double(i / width) + 0.5) / samples_;
  }

  const ViewBuffers& buffers_;
  int samples_;
  double level_;
  std::unordered_map<std::size_t, int> numbers_;
};

}  // namespace

std::vector<Polyline> contourLines(const ViewBuffers& buffers, int samples, double level) {
  LevelCrossings crossings(buffers, samples, level);
  const auto width = std::size_t(buffers.width);
  std::vector<Link> links;
  for (int y = 0; y + 1 < buffers.height; ++y)
    for (int x = 0; x + 1 < buffers.width; ++x) {
      const std::size_t i = std::size_t(y) * width + std::size_t(x);
      const std::array<std::size_t, 5> round = {i, i + 1, i + 1 + width, i + width, i};
      if (!buffers.hit(i) || !buffers.hit(i + 1) || !buffers.hit(i + width) || !buffers.hit(i + width + 1)) continue;
      std::array<int, 4> ends{};
      std::size_t count = 0;
      for (std::size_t k = 0; k < 4; ++k)
        if ((crossings.above(round[k]) < 0) != (crossings.above(round[k + 1]) < 0))
          ends[count++] = crossings.between(std::min(round[k], round[k + 1]), std::max(round[k], round[k + 1]));
      for (std::size_t k = 1; k < count; k += 2) links.push_back({ends[k - 1], ends[k]});
    }
  std::vector<Polyline> lines = joinedLinks(links, crossings.points);
  for (Polyline& line : lines) line = simplified(line, kContourTolerance);
  return lines;
}

}  // namespace hpsdf::render
