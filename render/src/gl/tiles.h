#pragma once
// Tiles of large views, and the check for OpenGL errors.

#include <epoxy/gl.h>

#include <algorithm>
#include <string>
#include <vector>

#include "hpsdf/error.h"

namespace hpsdf::render {

/// Greatest width and height of a tile in pixels, small enough for the render targets of any device.
constexpr int kTile = 2048;

/// A part of a view that is drawn in one piece.
struct Tile {
  int left, top, width, height;
};

/// The tiles that cover a part of a view.
inline std::vector<Tile> tiles(const Tile& part) {
  std::vector<Tile> result;
  for (int y = 0; y < part.height; y += kTile)
    for (int x = 0; x < part.width; x += kTile)
      result.push_back(
          {part.left + x, part.top + y, std::min(kTile, part.width - x), std::min(kTile, part.height - y)});
  return result;
}

/// Throws `Error` where OpenGL reports an error since the last call. `what` completes "the OpenGL device fails to".
inline void checkGl(const char* what) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  throw Error(std::string("the OpenGL device fails to ") + what + " (error " + std::to_string(error) +
              "): render a smaller picture, or with --cpu");
}

}  // namespace hpsdf::render
