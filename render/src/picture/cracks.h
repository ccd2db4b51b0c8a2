#pragma once
// Marks on a traced surface where it is torn because the field jumps over the offset between two cells.

#include <cstddef>

#include "coloring/color_view.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Magenta differs from every colour that a surface may have, for every kind of colour vision.
constexpr Color kCrackColor = {255, 0, 255};

/// Figures of the cracks that a view shows.
struct Cracks {
  std::size_t pixels = 0;  ///< number of the picture's pixels with a crack in any sample
  double widest = 0;       ///< greatest |f − offset| at a crack, world units
};
Cracks cracksOf(const ViewBuffers& buffers, double offset, int samples);

/// Paints the cracks over the view in the picture's upper left corner, a pixel wider on every side, so that a single
/// pixel is visible.
void markCracks(Image& picture, const ViewBuffers& buffers, const Sampling& sampling);

}  // namespace hpsdf::render
