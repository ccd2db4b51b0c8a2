#pragma once

#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Buffers of a view in which no pixel shows anything. `surface` adds the buffers that slices lack.
inline ViewBuffers emptyBuffers(int width, int height, bool surface) {
  const std::size_t pixels = std::size_t(width) * height;
  ViewBuffers buffers;
  buffers.width = width;
  buffers.height = height;
  buffers.cell.assign(pixels, kNoCell);
  buffers.degree.assign(pixels, 0);
  buffers.depth.assign(pixels, 0);
  buffers.value.assign(pixels, 0);
  if (surface) {
    buffers.normal.assign(pixels, Eigen::Vector3f::Zero());
    buffers.distance.assign(pixels, 0);
    buffers.crack.assign(pixels, 0);
  }
  return buffers;
}

}  // namespace hpsdf::render
