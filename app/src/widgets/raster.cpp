#include "widgets/raster.h"

#include <algorithm>
#include <array>
#include <cmath>

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
  const bool oneTexel = a->uv.x == b->uv.x && a->uv.x == c->uv.x && a->uv.y == b->uv.y && a->uv.y == c->uv.y;
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

}  // namespace

void paint(render::Image& image, const ImDrawData& data, const Coverage& texture) {
  for (int n = 0; n < data.CmdListsCount; ++n) {
    const ImDrawList& list = *data.CmdLists[n];
    for (const ImDrawCmd& command : list.CmdBuffer) {
      const Clip clip{std::max(0, int(command.ClipRect.x)), std::max(0, int(command.ClipRect.y)),
                      std::min(image.width, int(command.ClipRect.z)), std::min(image.height, int(command.ClipRect.w))};
      const ImDrawVert* vertices = list.VtxBuffer.Data + command.VtxOffset;
      const ImDrawIdx* indices = list.IdxBuffer.Data + command.IdxOffset;
      for (unsigned i = 0; i + 2 < command.ElemCount; i += 3)
        paintTriangle(image, texture, clip, vertices + indices[i], vertices + indices[i + 1],
                      vertices + indices[i + 2]);
    }
  }
}

}  // namespace hpsdf::app
