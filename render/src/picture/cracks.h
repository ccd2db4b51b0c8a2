#pragma once
// Where the traced surface is torn: the field jumps over the offset between two cells.

#include <cstddef>

#include "hpsdf/render/image.h"
#include "hpsdf/render/view.h"
#include "picture/color_view.h"

namespace hpsdf::render {

/// Told by every eye from all that a surface may be coloured with.
constexpr Color kCrackColor = {255, 0, 255};

/// The cracks that a view shows.
struct Cracks {
  std::size_t pixels = 0;  ///< of the picture, with a crack in any of their samples
  double widest = 0;       ///< |f − offset| at most, world units
};
Cracks cracksOf(const ViewBuffers& buffers, double offset, int samples);

/// Paints the cracks of a view over the upper left corner of the picture, where the view lies; a pixel wider on every
/// side, so that a single one shows.
void markCracks(Image& picture, const ViewBuffers& buffers, const Sampling& sampling);

}  // namespace hpsdf::render
