#pragma once
// Converts the buffers of a view to the colours of the view's pixels. The conversion reads only the
// buffers, so that views from OpenGL and from the reference renderer are coloured alike.

#include <functional>
#include <optional>
#include <vector>

#include "coloring/surface_shader.h"
#include "hpsdf/render/picture_settings.h"
#include "hpsdf/render/view.h"
#include "image/colormap.h"

namespace hpsdf::render {

/// The sampling of a view. The view's buffers hold samples × samples points for each pixel of the picture. The colours
/// of these points are averaged in linear light.
struct Sampling {
  int samples = 1;
  double lineWidth = 1;             ///< width of thin lines, pixels of the finished picture
  double sampleSize = 1;            ///< distance between neighbouring samples of a slice, world units
  std::optional<Color> paper = {};  ///< replaces the colour of the paper, and the backdrop of surfaces
};

/// A function that returns the colour of a sample, given the sample's index in the buffers.
using SampleColor = std::function<LinearColor(std::size_t)>;

/// Returns a function that colours samples by degree or depth. The function is empty for `ColorBy::normal`.
/// The buffers must outlive the function.
SampleColor levelColors(const ViewBuffers& buffers, ColorBy color);
/// Returns a function that colours each sample by its value of a quantity.
SampleColor quantityColors(std::vector<float> quantity, ColorScale scale);

/// Returns a function that colours samples by distance with a diverging colour map. The buffers must outlive the
/// function.
SampleColor distanceColors(const ViewBuffers& buffers, const DistanceScale& scale, const ColorMap& map);

/// Colours the samples of a slice without any lines.
Image colorGround(const ViewBuffers& buffers, const SampleColor& color, const Sampling& sampling);

/// Colours the samples of a slice. Draws thin outlines of the cells over the colours, and the field's surface
/// as a white line.
Image colorCellSlice(const ViewBuffers& buffers, const SampleColor& color, const Sampling& sampling);

/// Colours the distances of a slice with a diverging colour map. Draws iso-lines over the colours, and a
/// bold line at distance zero.
Image colorDistanceSlice(const ViewBuffers& buffers, const DistanceScale& scale, const ColorMap& map,
                         const Sampling& sampling);

/// Colours a view of a surface in front of the backdrop. The surface and boxes have soft shading and the colours of
/// `look`. Sections and planes are unlit and show the outlines of cells. On a plane, the surface f = offset is drawn as
/// a line. `lines` holds the share of each sample, 0 to 1, that lines along edges cover, or is empty.
Image colorSurface(const ViewBuffers& buffers, const Camera& camera, const SurfaceLook& look, const Sampling& sampling,
                   double offset = 0, const std::vector<float>& lines = {});

/// The background colour of a picture: around the domain in a slice, and behind the legend and the caption.
Color paperColor();

/// The backdrop behind a surface, a soft gradient. `fromTop` is 0 at the top of the view, 1 at the bottom.
LinearColor backdropColor(double fromTop);

/// A picture in the paper colour, with the backdrop of surfaces in its upper `viewHeight` rows.
Image backdropPicture(int width, int height, int viewHeight);

/// Copies the pixels of `view` into the upper left corner of the picture.
void pasteView(Image& picture, const Image& view);

}  // namespace hpsdf::render
