#pragma once
// What both renderers do with buffers and the numbers of a view.

#include <cmath>
#include <optional>

#include "hpsdf/error.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

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

inline void checkClip(const std::optional<ClipPlane>& clip) {
  if (clip && !std::isfinite(clip->offset))
    throw Error("a clipping plane's offset is not finite: give a finite number");
}

inline void checkOffset(double offset) {
  if (!std::isfinite(offset)) throw Error("the surface's offset is not finite: give a distance in world units");
}

}  // namespace hpsdf::render
