#include "widgets/raster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

namespace hpsdf::app {
namespace {

struct Clip {
  int x0, y0, x1, y1;  ///< pixel range; x1 and y1 are excluded
};

using Channels = std::array<float, 4>;  ///< red, green, blue, alpha; 0 to 255

Channels channelsOf(ImU32 color) {
  return {float(color >> IM_COL32_R_SHIFT & 0xff), float(color >> IM_COL32_G_SHIFT & 0xff),
          float(color >> IM_COL32_B_SHIFT & 0xff), float(color >> IM_COL32_A_SHIFT & 0xff)};
}

float coverageAt(const Coverage& texture, float u, float v) {
  const float x = u * float(texture.width) - 0.5F, y = v * float(texture.height) - 0.5F;
  const float left = std::floor(x), top = std::floor(y);
  const auto at = [&](float column, float row) {
    const int i = std::clamp(int(column), 0, texture.width - 1), j = std::clamp(int(row), 0, texture.height - 1);
    return float(texture.texels[std::size_t(j) * texture.width + i]);
  };
  const float dx = x - left, dy = y - top;
  const float upper = at(left, top) * (1 - dx) + at(left + 1, top) * dx;
  const float lower = at(left, top + 1) * (1 - dx) + at(left + 1, top + 1) * dx;
  return (upper * (1 - dy) + lower * dy) / 255;
}

void blend(render::Color& pixel, const Channels& color, float coverage) {
  const float alpha = color[3] / 255 * coverage;
  for (int channel = 0; channel < 3; ++channel)
    pixel[channel] =
        static_cast<std::uint8_t>(float(pixel[channel]) + (color[channel] - float(pixel[channel])) * alpha + 0.5F);
}

/// Returns twice the signed area of the triangle (a, b, p).
float edge(const ImVec2& a, const ImVec2& b, const ImVec2& p) {
  return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

/// Tells whether pixels whose centres lie exactly on the edge from a to b belong to the triangle (top-left rule). Two
/// triangles traverse their shared edge in opposite directions, so the pixels belong to exactly one of them.
bool coversItsEdge(const ImVec2& a, const ImVec2& b) { return a.y == b.y ? a.x > b.x : a.y > b.y; }

bool haveOneTexel(const ImDrawVert& a, const ImDrawVert& b, const ImDrawVert& c) {
  return a.uv.x == b.uv.x && a.uv.x == c.uv.x && a.uv.y == b.uv.y && a.uv.y == c.uv.y;
}

void paintTriangle(render::Image& image, const Coverage& texture, const Clip& clip, const ImDrawVert* a,
                   const ImDrawVert* b, const ImDrawVert* c) {
  float area = edge(a->pos, b->pos, c->pos);
  if (area == 0 || !std::isfinite(area)) return;
  if (area < 0) {
    std::swap(b, c);
    area = -area;
  }
  const auto [left, right] = std::minmax({a->pos.x, b->pos.x, c->pos.x});
  const auto [top, bottom] = std::minmax({a->pos.y, b->pos.y, c->pos.y});
  const int x0 = std::max(clip.x0, int(std::floor(left))), x1 = std::min(clip.x1, int(std::ceil(right)));
  const int y0 = std::max(clip.y0, int(std::floor(top))), y1 = std::min(clip.y1, int(std::ceil(bottom)));
  const bool oneTexel = haveOneTexel(*a, *b, *c);
  const float constantCoverage = oneTexel ? coverageAt(texture, a->uv.x, a->uv.y) : 0;
  const Channels colorA = channelsOf(a->col), colorB = channelsOf(b->col), colorC = channelsOf(c->col);
  const bool oneColor = a->col == b->col && a->col == c->col;
  const std::array edges = {coversItsEdge(b->pos, c->pos), coversItsEdge(c->pos, a->pos),
                            coversItsEdge(a->pos, b->pos)};
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const ImVec2 p(float(x) + 0.5F, float(y) + 0.5F);
      const std::array weights = {edge(b->pos, c->pos, p), edge(c->pos, a->pos, p), edge(a->pos, b->pos, p)};
      const auto inside = [&](int i) { return weights[i] > 0 || (weights[i] == 0 && edges[i]); };
      if (!inside(0) || !inside(1) || !inside(2)) continue;
      const float wa = weights[0] / area, wb = weights[1] / area, wc = weights[2] / area;
      const float coverage = oneTexel ? constantCoverage
                                      : coverageAt(texture, wa * a->uv.x + wb * b->uv.x + wc * c->uv.x,
                                                   wa * a->uv.y + wb * b->uv.y + wc * c->uv.y);
      Channels color = colorA;
      if (!oneColor)
        for (int channel = 0; channel < 4; ++channel)
          color[channel] = wa * colorA[channel] + wb * colorB[channel] + wc * colorC[channel];
      blend(image.at(x, y), color, coverage);
    }
}

/// Returns the corners of a list of triangles in pixels. Corners of glyphs, which have a texture, are moved to whole
/// pixels; a little more than one half is added, because rounding errors must not move the corners of one glyph
/// differently.
std::vector<ImDrawVert> cornersInPixels(const ImDrawList& list, const ImDrawCmd& command, float scale) {
  const ImDrawVert* vertices = list.VtxBuffer.Data + command.VtxOffset;
  const ImDrawIdx* indices = list.IdxBuffer.Data + command.IdxOffset;
  std::vector<ImDrawVert> corners(command.ElemCount);
  for (unsigned i = 0; i < command.ElemCount; ++i) {
    corners[i] = vertices[indices[i]];
    corners[i].pos = {corners[i].pos.x * scale, corners[i].pos.y * scale};
  }
  if (scale == 1) return corners;
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    if (haveOneTexel(corners[i], corners[i + 1], corners[i + 2])) continue;
    for (std::size_t k = i; k < i + 3; ++k)
      corners[k].pos = {std::floor(corners[k].pos.x + 0.51F), std::floor(corners[k].pos.y + 0.51F)};
  }
  return corners;
}

/// True if the two triangles with these six corners are the halves of an upright rectangle of one opaque colour.
bool isPlainRectangle(std::span<const ImDrawVert, 6> corners, const Coverage& texture) {
  const ImDrawVert &a = corners[0], &b = corners[1], &c = corners[2], &d = corners[5];
  const auto areSame = [](const ImDrawVert& p, const ImDrawVert& q) {
    return p.pos.x == q.pos.x && p.pos.y == q.pos.y;
  };
  const bool isUpright = areSame(a, corners[3]) && areSame(c, corners[4]) && a.pos.y == b.pos.y && b.pos.x == c.pos.x &&
                         c.pos.y == d.pos.y && d.pos.x == a.pos.x && a.pos.x < c.pos.x && a.pos.y < c.pos.y;
  const bool isPlain = a.col == b.col && a.col == c.col && a.col == d.col && haveOneTexel(a, b, c) &&
                       haveOneTexel(a, c, d) && (a.col >> IM_COL32_A_SHIFT & 0xff) == 255;
  return isUpright && isPlain && coverageAt(texture, a.uv.x, a.uv.y) == 1;
}

/// Fills the pixels whose centres lie in the rectangle, which is faster than painting its two triangles.
void fillRectangle(render::Image& image, const Clip& clip, const ImDrawVert& low, const ImDrawVert& high) {
  const auto first = [](float edge) { return int(std::ceil(edge - 0.5F)); };
  const int x0 = std::max(clip.x0, first(low.pos.x)), x1 = std::min(clip.x1, first(high.pos.x));
  const int y0 = std::max(clip.y0, first(low.pos.y)), y1 = std::min(clip.y1, first(high.pos.y));
  const Channels channels = channelsOf(low.col);
  const render::Color color = {std::uint8_t(channels[0]), std::uint8_t(channels[1]), std::uint8_t(channels[2])};
  for (int y = y0; y < y1 && x0 < x1; ++y) std::fill_n(&image.at(x0, y), x1 - x0, color);
}

}  // namespace

void paint(render::Image& image, const ImDrawData& data, const Coverage& texture, double scale) {
  const auto pixel = [&](float coordinate) { return int(std::lround(coordinate * scale)); };
  for (int n = 0; n < data.CmdListsCount; ++n) {
    const ImDrawList& list = *data.CmdLists[n];
    for (const ImDrawCmd& command : list.CmdBuffer) {
      const Clip clip{std::max(0, pixel(command.ClipRect.x)), std::max(0, pixel(command.ClipRect.y)),
                      std::min(image.width, pixel(command.ClipRect.z)),
                      std::min(image.height, pixel(command.ClipRect.w))};
      const std::vector<ImDrawVert> corners = cornersInPixels(list, command, float(scale));
      for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
        if (i + 6 <= corners.size() && isPlainRectangle(std::span<const ImDrawVert, 6>(&corners[i], 6), texture)) {
          fillRectangle(image, clip, corners[i], corners[i + 2]);
          i += 3;
          continue;
        }
        paintTriangle(image, texture, clip, &corners[i], &corners[i + 1], &corners[i + 2]);
      }
    }
  }
}

}  // namespace hpsdf::app
