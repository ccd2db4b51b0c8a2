#pragma once
// Marks for cracks in a picture: places on the surface where the field jumps over the offset between two cells.

#include <cstddef>

#include "coloring/color_view.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// The colour of cracks: a violet that differs from all colours of surfaces, also for colour-blind readers.
constexpr Color kCrackColor = {174, 114, 255};

/// The number of pixels with cracks in a view, and the greatest |f − offset| at a crack.
struct Cracks {
  std::size_t pixels = 0;  ///< number of the picture's pixels with a crack in any sample
  double widest = 0;       ///< greatest |f − offset| at a crack, world units
};
Cracks cracksOf(const ViewBuffers& buffers, double offset, int samples);

/// Paints the cracks over the view, which lies in the picture's upper left corner. Each crack is widened on every side
/// by the width of a thin line, at least one pixel, so that a crack of a single pixel is visible.
void markCracks(Image& picture, const ViewBuffers& buffers, const Sampling& sampling);

}  // namespace hpsdf::render
