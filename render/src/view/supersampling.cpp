#include "view/supersampling.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "view/view_buffers.h"

namespace hpsdf::render {
namespace {

constexpr float kNeighboursCosine = 0.9F;  // between the normals of neighbouring pixels of an even piece
constexpr double kGreatestBend = 1;        // second difference of the distances of an even piece, in pixels
constexpr double kNarrowCrack = 0.05;      // jump of f at a crack that an even piece may have, in pixels

/// The weights of the values at −1, 0 and 1 in the value at t of the parabola through them.
std::array<float, 3> parabolaWeights(float t) { return {0.5F * t * (t - 1), 1 - t * t, 0.5F * t * (t + 1)}; }

/// The pixels of a view, each with one ray.
class Pixels {
 public:
  Pixels(const SurfaceView& view, const ViewBuffers& buffers, bool showsCells)
      : view_(view), buffers_(buffers), showsCells_(showsCells) {}

  /// Returns true if the rays of a pixel and of its neighbours tell all samples of the pixel.
  bool isEven(int x, int y) const {
    if (x < 1 || y < 1 || x + 1 >= buffers_.width || y + 1 >= buffers_.height) return false;
    const std::size_t i = at(x, y);
    for (int row = y - 1; row <= y + 1; ++row)
      for (int column = x - 1; column <= x + 1; ++column)
        if (!continues(i, at(column, row))) return false;
    if (!buffers_.hit(i)) return true;
    const double most = kGreatestBend * pixelSize(view_.camera, buffers_.distance[i], buffers_.height);
    const auto rows = std::size_t(buffers_.width);
    return bend(i, 1) <= most && bend(i, rows) <= most && bend(i, rows - 1) <= 2 * most &&
           bend(i, rows + 1) <= 2 * most;
  }

  /// Sets sample i of a finer view to what an even pixel shows at (x + right, y + down), where `right` and `down` lie
  /// between −½ and ½.
  void interpolate(int x, int y, float right, float down, std::size_t i, ViewBuffers& samples) const {
    const std::size_t middle = at(x, y);
    if (!buffers_.hit(middle)) return;
    const std::array<float, 3> across = parabolaWeights(right), along = parabolaWeights(down);
    samples.cell[i] = buffers_.cell[middle];
    samples.degree[i] = buffers_.degree[middle];
    samples.depth[i] = buffers_.depth[middle];
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    float value = 0, distance = 0;
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) {
        const std::size_t j = at(x + column - 1, y + row - 1);
        const float weight = across[column] * along[row];
        normal += weight * buffers_.normal[j];
        value += weight * buffers_.value[j];
        distance += weight * (buffers_.distance[j] - buffers_.distance[middle]);
      }
    samples.normal[i] = normal.normalized();
    samples.value[i] = value;
    samples.distance[i] = buffers_.distance[middle] + distance;
  }

 private:
  std::size_t at(int x, int y) const { return std::size_t(y) * buffers_.width + x; }

  /// Returns true if pixel j shows the surface turned nearly as in pixel i and no wide crack or, if cells count, the
  /// same cell and no crack at all. Also returns true if both show nothing.
  bool continues(std::size_t i, std::size_t j) const {
    if (buffers_.hit(i) != buffers_.hit(j)) return false;
    if (!buffers_.hit(i)) return true;
    if (showsCells_ && buffers_.cell[i] != buffers_.cell[j]) return false;
    if (buffers_.crack[j] != 0 && (showsCells_ || isWide(j))) return false;
    return buffers_.normal[i].dot(buffers_.normal[j]) >= kNeighboursCosine;
  }

  /// Returns true if the crack in pixel j is wide enough to be seen.
  bool isWide(std::size_t j) const {
    const double pixel = pixelSize(view_.camera, buffers_.distance[j], buffers_.height);
    return std::abs(buffers_.value[j] - view_.offset) > kNarrowCrack * pixel;
  }

  /// The second difference of the distances in pixel i and the pixels `step` before and behind it.
  double bend(std::size_t i, std::size_t step) const {
    return std::abs(double(buffers_.distance[i - step]) + buffers_.distance[i + step] - 2.0 * buffers_.distance[i]);
  }

  const SurfaceView& view_;
  const ViewBuffers& buffers_;
  bool showsCells_;
};

}  // namespace

ViewBuffers supersampledSurface(Renderer& renderer, const SurfaceView& view, int width, int height, int samples,
                                bool showsCells) {
  const ViewBuffers coarse = renderer.surface(view, width, height);
  if (samples == 1) return coarse;
  const Pixels pixels(view, coarse, showsCells);
  const auto forEachSample = [&](int x, int y, const auto& visit) {
    for (int row = 0; row < samples; ++row)
      for (int column = 0; column < samples; ++column)
        visit(std::size_t(y * samples + row) * width * samples + std::size_t(x * samples + column), column, row);
  };
  std::vector<std::uint8_t> traced(coarse.cell.size() * samples * samples);
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x)
      if (!pixels.isEven(x, y)) forEachSample(x, y, [&](std::size_t i, int, int) { traced[i] = 1; });
  });
  ViewBuffers result = renderer.surface(view, width * samples, height * samples, traced);
  const auto fromMiddle = [&](int n) { return (float(n) + 0.5F) / float(samples) - 0.5F; };
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x)
      forEachSample(x, y, [&](std::size_t i, int column, int row) {
        if (traced[i] == 0) pixels.interpolate(x, y, fromMiddle(column), fromMiddle(row), i, result);
      });
  });
  return result;
}

}  // namespace hpsdf::render
