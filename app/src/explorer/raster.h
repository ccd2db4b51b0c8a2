#pragma once
// Panels as pixels: triangles of Dear ImGui painted into a picture on the CPU, so that they look the same on every
// machine, with any renderer or none.

#include <imgui.h>

#include <cstdint>
#include <vector>

#include "hpsdf/render/image.h"

namespace hpsdf::app {

/// The one texture of the panels: glyphs, lines and a white spot, as coverage.
struct Coverage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> texels;
};

/// Blends the triangles over the picture in their order, as a graphics card does: a pixel belongs to the triangle that
/// holds its centre, colours and texture (bilinear) are interpolated.
void paint(render::Image& image, const ImDrawData& data, const Coverage& texture);

}  // namespace hpsdf::app
