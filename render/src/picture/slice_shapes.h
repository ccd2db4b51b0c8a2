#pragma once
// A slice as shapes of a vector picture: its cells, their outlines, the field's surface and iso-lines.

#include <functional>
#include <vector>

#include "coloring/color_view.h"
#include "hpsdf/field.h"
#include "hpsdf/render/vector_picture.h"
#include "image/colormap.h"
#include "image/pixel_rect.h"

namespace hpsdf::render {

/// The content of a slice: its cells and colours, and where they lie in the picture.
struct SliceContent {
  const Field& field;
  const SliceView& view;
  const ViewBuffers& buffers;
  Sampling sampling;
  PixelRect section;                                       ///< the part of the view that shows the domain, pixels
  std::function<LinearColor(const Cell&)> cellColor = {};  ///< colour of a cell; empty if colours vary within cells
  Image ground = {};                                       ///< the view in colours alone, without lines
  const DistanceScale* distances = nullptr;                ///< the iso-lines of a slice of distances, without cells
  const ColorMap* map = nullptr;                           ///< the colour map of distances
};

/// Returns the layers of a slice, from the bottom to the top. Cells of one colour are areas whose borders are exact. If
/// colours vary within cells, the colours are a picture of pixels.
std::vector<VectorLayer> sliceLayers(const SliceContent& slice);

/// Returns the part of an image within a rectangle.
Image croppedTo(const PixelRect& part, const Image& image);

}  // namespace hpsdf::render
