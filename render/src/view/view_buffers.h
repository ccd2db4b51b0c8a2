#pragma once

#include <tbb/parallel_invoke.h>

#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Buffers of a view in which no pixel shows anything. If `surface` is true, they include the buffers that views of
/// surfaces have and slices lack.
inline ViewBuffers emptyBuffers(int width, int height, bool surface) {
  const std::size_t pixels = std::size_t(width) * height;
  ViewBuffers buffers;
  buffers.width = width;
  buffers.height = height;
  // The buffers are filled in several threads, because most of the time is that of getting the memory.
  tbb::parallel_invoke(
      [&] {
        buffers.cell.assign(pixels, kNoCell);
        buffers.degree.assign(pixels, 0);
        buffers.depth.assign(pixels, 0);
        buffers.value.assign(pixels, 0);
      },
      [&] {
        if (surface) buffers.normal.assign(pixels, Eigen::Vector3f::Zero());
      },
      [&] {
        if (!surface) return;
        buffers.distance.assign(pixels, 0);
        buffers.crack.assign(pixels, 0);
      });
  return buffers;
}

/// The index of the middle sample of a pixel, in buffers that hold samples × samples for each pixel.
inline std::size_t middleSample(const ViewBuffers& buffers, int samples, int x, int y) {
  return std::size_t(y * samples + samples / 2) * buffers.width + std::size_t(x * samples + samples / 2);
}

/// Returns true if a pixel shows something that is nearer to the eye than `distance` by more than `tolerance`.
inline bool hides(const ViewBuffers& buffers, int samples, int x, int y, double distance, double tolerance) {
  const std::size_t i = middleSample(buffers, samples, x, y);
  return buffers.covered(i) && distance > double(buffers.distance[i]) + tolerance;
}

}  // namespace hpsdf::render
