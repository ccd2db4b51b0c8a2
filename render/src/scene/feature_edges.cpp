#include "scene/feature_edges.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace hpsdf::render {
namespace {

constexpr float kLeastCosine = 0.866F;  // of the angle between normals that are not yet an edge, 30°
constexpr double kLeastRise = 3;        // height of a step between two surfaces, in samples

class Samples {
 public:
  Samples(const SurfaceView& view, const ViewBuffers& buffers) : view_(view), buffers_(buffers) {}

  /// Returns true if an edge lies between two samples of one row or column.
  bool edgeBetween(int x0, int y0, int x1, int y1) const {
    const std::size_t a = index(x0, y0), b = index(x1, y1);
    if (buffers_.covered(a) != buffers_.covered(b)) return true;
    if (!buffers_.covered(a)) return false;
    const Eigen::Vector3f &na = buffers_.normal[a], &nb = buffers_.normal[b];
    if (na.dot(nb) < kLeastCosine) return true;
    const Vector3 step = pointAt(view_, buffers_, x1, y1) - pointAt(view_, buffers_, x0, y0);
    const double sample =
        pixelSize(view_.camera, std::min(buffers_.distance[a], buffers_.distance[b]), buffers_.height);
    const double least = kLeastRise * sample * std::max(std::abs(x1 - x0), std::abs(y1 - y0));
    return std::abs(step.dot(na.cast<double>())) > least && std::abs(step.dot(nb.cast<double>())) > least;
  }

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * buffers_.width + x; }

  const SurfaceView& view_;
  const ViewBuffers& buffers_;
};

}  // namespace

std::vector<float> featureEdges(const SurfaceView& view, const ViewBuffers& buffers, double lineWidth) {
  const int reach = std::max(1, static_cast<int>(std::lround(lineWidth)));
  const Samples samples(view, buffers);
  std::vector<float> edges(buffers.cell.size(), 0);
  tbb::parallel_for(0, buffers.height, [&](int y) {
    for (int x = 0; x < buffers.width; ++x)
      for (int k = 1; k <= reach; ++k) {
        const bool isEdge = (x + k < buffers.width && samples.edgeBetween(x, y, x + k, y)) ||
                            (y + k < buffers.height && samples.edgeBetween(x, y, x, y + k));
        if (!isEdge) continue;
        edges[std::size_t(y) * buffers.width + x] = 1;
        break;
      }
  });
  return edges;
}

}  // namespace hpsdf::render
