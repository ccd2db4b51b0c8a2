#pragma once
// Paints the triangles of Dear ImGui into a picture on the CPU, so that panels have the same pixels on every machine
// and with every renderer.

#include <imgui.h>

#include <cstdint>
#include <vector>

#include "hpsdf/render/image.h"

namespace hpsdf::app {

/// The only texture of the panels: Dear ImGui's font atlas. It holds the coverage (0 to 255) of glyphs, lines and a
/// white spot.
struct Coverage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> texels;
};

/// Blends the triangles of `data` over the picture, one after the other and by the rules of graphics cards. A triangle
/// covers the pixels whose centres it contains. Colours and texture coordinates are interpolated, and the texture is
/// sampled bilinearly. The coordinates of `data` are multiplied by `scale`. Triangles with a texture, which are glyphs,
/// are then moved to whole pixels, so that text is crisp at every scale.
void paint(render::Image& image, const ImDrawData& data, const Coverage& texture, double scale = 1);

}  // namespace hpsdf::app
