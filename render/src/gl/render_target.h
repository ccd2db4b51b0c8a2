#pragma once
// Render targets, and the tiles in which large views are drawn.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <optional>
#include <type_traits>
#include <vector>

#include "gl/gl_objects.h"
#include "hpsdf/render/renderer.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Greatest width and height of a tile in pixels, small enough for the render targets of any device.
constexpr int kTile = 2048;

/// A rectangle of pixels of a view that is drawn in one piece.
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

/// Calls f(index, x, y) for each pixel of a tile, in several threads. `index` is the pixel's index within the
/// tile, and (x, y) its place in the view. Rows of a render target run downwards, as in a view.
template <typename F>
void forEachPixel(const Tile& tile, const F& f) {
  tbb::parallel_for(0, tile.height, [&](int y) {
    for (int x = 0; x < tile.width; ++x) f(std::size_t(y) * tile.width + x, tile.left + x, tile.top + y);
  });
}

/// A render target that holds one tile of a view at a time. Each pixel has integers, and either four floats or a depth.
class RenderTarget {
 public:
  /// Makes a target for each tile of `part`. `integers` is the OpenGL format of the integers, `other` is the format of
  /// the floats or depths. Throws `Error` if the device cannot draw into these formats.
  RenderTarget(const Tile& part, GLenum integers, GLenum other)
      : hasDepth_(other == GL_DEPTH_COMPONENT32F),
        width_(std::min(part.width, kTile)),
        height_(std::min(part.height, kTile)) {
    glTextureStorage2D(integers_.name(), 1, integers, width_, height_);
    glTextureStorage2D(other_.name(), 1, other, width_, height_);
    for (const GLuint texture : {integers_.name(), other_.name()}) {
      // Integer textures can only be read with nearest filtering, which is not the default.
      glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
      glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    }
    constexpr GLenum kColors[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    glNamedFramebufferTexture(framebuffer_.name(), kColors[0], integers_.name(), 0);
    glNamedFramebufferTexture(framebuffer_.name(), hasDepth_ ? GL_DEPTH_ATTACHMENT : kColors[1], other_.name(), 0);
    glNamedFramebufferDrawBuffers(framebuffer_.name(), hasDepth_ ? 1 : 2, kColors);
    if (glCheckNamedFramebufferStatus(framebuffer_.name(), GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      throw GlError("the OpenGL device cannot render into 32-bit buffers: update its driver");
  }

  int width() const { return width_; }
  int height() const { return height_; }

  void bindForDrawing() const { glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name()); }

  /// Clears the pixels of a tile: the integers to "no cell" or "no body", and the floats or depths to 0. Depth 0 means
  /// infinite distance.
  void clear(const Tile& tile) const {
    static_assert(kNoCell == kNoBody);
    constexpr GLuint kNothing[] = {kNoCell, 0, 0, 0};
    constexpr GLfloat kZero[] = {0, 0, 0, 0};
    glEnable(GL_SCISSOR_TEST);
    glScissor(0, 0, tile.width, tile.height);
    glClearNamedFramebufferuiv(framebuffer_.name(), GL_COLOR, 0, kNothing);
    glClearNamedFramebufferfv(framebuffer_.name(), hasDepth_ ? GL_DEPTH : GL_COLOR, hasDepth_ ? 0 : 1, kZero);
    glDisable(GL_SCISSOR_TEST);
  }

  /// Binds the integers and the floats as textures to the texture units 2 and 3.
  void bindForReading() const {
    glBindTextureUnit(2, integers_.name());
    glBindTextureUnit(3, other_.name());
  }

  /// Reads all pixels of a tile to the beginning of `out`: the integers or the floats, depending on the type of `out`.
  template <typename Channel, std::size_t channels>
  void read(const Tile& tile, std::vector<std::array<Channel, channels>>& out) const {
    constexpr bool kIntegers = std::is_integral_v<Channel>;
    out.resize(std::max(out.size(), std::size_t(tile.width) * tile.height));
    glNamedFramebufferReadBuffer(framebuffer_.name(), kIntegers ? GL_COLOR_ATTACHMENT0 : GL_COLOR_ATTACHMENT1);
    glReadPixels(0, 0, tile.width, tile.height,
                 !kIntegers      ? GL_RGBA
                 : channels == 2 ? GL_RG_INTEGER
                                 : GL_RGBA_INTEGER,
                 kIntegers ? GL_UNSIGNED_INT : GL_FLOAT, out.data());
  }

 private:
  bool hasDepth_;
  int width_, height_;
  GlTexture2D integers_, other_;
  GlFramebuffer framebuffer_;
};

/// Returns one render target with floats for all tiles of `part`: that of an earlier view if it is large enough,
/// since to allocate a target takes as long as to trace some hundred thousand rays. In place of one that is too small,
/// the new one is made somewhat larger than needed, because a surface that turns takes a little more room from time to
/// time.
inline const RenderTarget& keptTarget(std::optional<RenderTarget>& kept, const Tile& part) {
  const auto least = [](int pixels) { return std::min(pixels, kTile); };
  if (kept && kept->width() >= least(part.width) && kept->height() >= least(part.height)) return *kept;
  const auto grown = [](int pixels, int before) { return std::max(pixels + pixels / 8, before); };
  const Tile size = kept ? Tile{0, 0, grown(part.width, kept->width()), grown(part.height, kept->height())} : part;
  kept.reset();
  return kept.emplace(size, GLenum{GL_RGBA32UI}, GLenum{GL_RGBA32F});
}

}  // namespace hpsdf::render
