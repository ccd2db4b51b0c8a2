#pragma once
// Compares the view buffers of a renderer with the buffers of the double-precision CPU renderer (oracle).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hpsdf/render/view.h"

namespace hpsdf::render {

struct BufferTolerance {
  double value = 0;        ///< tolerance of the field's value, in world units
  double position = 0;     ///< tolerance of a hit's position across the surface, in world units
  double normalAngle = 0;  ///< tolerance of the normal, in radians
  double pixels = 1e-3;    ///< fraction of pixels, at edges only, whose hit, cell, degree or depth may differ
  double creases = 0;      ///< fraction of pixels, at creases of the surface only, whose normal may differ
};

/// Returns true if any of the eight pixels around (x, y) has another value in `buffer` than this pixel.
template <typename T>
bool atEdge(const ViewBuffers& buffers, const std::vector<T>& buffer, int x, int y) {
  const T here = buffer[std::size_t(y) * buffers.width + x];
  for (int v = std::max(0, y - 1); v <= std::min(buffers.height - 1, y + 1); ++v)
    for (int u = std::max(0, x - 1); u <= std::min(buffers.width - 1, x + 1); ++u)
      if (buffer[std::size_t(v) * buffers.width + u] != here) return true;
  return false;
}

/// Returns true if the normal of any of the eight pixels around (x, y) differs from that of this pixel by more than
/// `angle`.
inline bool atCrease(const ViewBuffers& buffers, int x, int y, double angle) {
  const Eigen::Vector3f here = buffers.normal[std::size_t(y) * buffers.width + x];
  for (int v = std::max(0, y - 1); v <= std::min(buffers.height - 1, y + 1); ++v)
    for (int u = std::max(0, x - 1); u <= std::min(buffers.width - 1, x + 1); ++u)
      if ((buffers.normal[std::size_t(v) * buffers.width + u] - here).norm() > angle) return true;
  return false;
}

/// Returns the starting point of a pixel's ray.
inline Vector3 rayStart(const Camera& camera, int width, int height, int x, int y) {
  if (camera.projection == Projection::perspective) return camera.eye;
  return camera.eye + camera.right * (2 * (x + 0.5) / width - 1) + camera.up * (1 - 2 * (y + 0.5) / height);
}

/// Returns the unit direction of a pixel's ray.
inline Vector3 rayDirection(const Camera& camera, int width, int height, int x, int y) {
  if (camera.projection == Projection::orthographic) return camera.forward;
  return (camera.forward + camera.right * (2 * (x + 0.5) / width - 1) + camera.up * (1 - 2 * (y + 0.5) / height))
      .normalized();
}

/// Returns the point where a pixel's ray hits the surface.
inline Vector3 hitPoint(const Camera& camera, const ViewBuffers& buffers, std::size_t pixel) {
  const int x = static_cast<int>(pixel % buffers.width), y = static_cast<int>(pixel / buffers.width);
  return rayStart(camera, buffers.width, buffers.height, x, y) +
         double(buffers.distance[pixel]) * rayDirection(camera, buffers.width, buffers.height, x, y);
}

/// Cells, degrees, depths and cracks must agree except for few pixels, each within one pixel of an edge. Where cells
/// agree, values must agree within the tolerances, and so must positions and normals if `camera` is given.
inline testing::AssertionResult agree(const ViewBuffers& expected, const ViewBuffers& actual,
                                      const BufferTolerance& tolerance, const Camera* camera = nullptr) {
  if (expected.width != actual.width || expected.height != actual.height)
    return testing::AssertionFailure() << "sizes differ";
  std::size_t differing = 0, differentNormals = 0;
  for (int y = 0; y < expected.height; ++y)
    for (int x = 0; x < expected.width; ++x) {
      const std::size_t i = std::size_t(y) * expected.width + x;
      const auto failure = [&] { return testing::AssertionFailure() << "pixel (" << x << ", " << y << "): "; };
      if (expected.cell[i] != actual.cell[i] || expected.degree[i] != actual.degree[i] ||
          expected.depth[i] != actual.depth[i]) {
        ++differing;
        if (!atEdge(expected, expected.cell, x, y) && !atEdge(actual, actual.cell, x, y))
          return failure() << "cell " << actual.cell[i] << " instead of " << expected.cell[i] << ", far from any edge";
        continue;
      }
      if (!expected.hit(i)) continue;
      if (!(std::abs(expected.value[i] - actual.value[i]) <= tolerance.value))
        return failure() << "value " << actual.value[i] << " instead of " << expected.value[i];
      if (camera == nullptr) continue;
      if (expected.crack[i] != actual.crack[i]) {
        ++differing;
        if (!atEdge(expected, expected.crack, x, y) && !atEdge(actual, actual.crack, x, y))
          return failure() << "crack " << int(actual.crack[i]) << ", far from where cracks end";
      }
      const Eigen::Vector3f normal = expected.normal[i];
      const double cosine =
          std::abs(rayDirection(*camera, expected.width, expected.height, x, y).dot(normal.cast<double>()));
      if (!(std::abs(expected.distance[i] - actual.distance[i]) * cosine <= tolerance.position))
        return failure() << "distance " << actual.distance[i] << " instead of " << expected.distance[i];
      if (!((normal - actual.normal[i]).norm() <= tolerance.normalAngle) &&
          (double(++differentNormals) > tolerance.creases * double(expected.cell.size()) ||
           !atCrease(expected, x, y, tolerance.normalAngle)))
        return failure() << "normal differs by " << (normal - actual.normal[i]).norm();
    }
  if (static_cast<double>(differing) > tolerance.pixels * static_cast<double>(expected.cell.size()))
    return testing::AssertionFailure() << differing << " of " << expected.cell.size() << " pixels differ";
  return testing::AssertionSuccess();
}

}  // namespace hpsdf::render
