#pragma once
// What all renderers do on the device, whatever they draw.

#include <epoxy/gl.h>

#include <algorithm>
#include <string>
#include <vector>

#include "hpsdf/error.h"

namespace hpsdf::render {

constexpr int kTile = 2048;  ///< pixels a side: larger views are drawn in tiles, so that any size fits the device

/// A part of a view that is drawn at once.
struct Tile {
  int left, top, width, height;
};

inline std::vector<Tile> tiles(const Tile& part) {
  std::vector<Tile> result;
  for (int y = 0; y < part.height; y += kTile)
    for (int x = 0; x < part.width; x += kTile)
      result.push_back(
          {part.left + x, part.top + y, std::min(kTile, part.width - x), std::min(kTile, part.height - y)});
  return result;
}

/// Throws `Error` where the device has failed since the last call.
inline void checkGl(const char* what) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  throw Error(std::string("the OpenGL device fails to ") + what + " (error " + std::to_string(error) +
              "): render a smaller picture, or with --cpu");
}

}  // namespace hpsdf::render
