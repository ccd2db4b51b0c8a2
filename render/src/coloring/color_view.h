#pragma once
// From the buffers of a view to the colours of its pixels. Only the buffers are read, so that views from OpenGL
// and from the reference renderer are coloured alike.

#include <functional>
#include <span>
#include <vector>

#include "hpsdf/render/picture_settings.h"
#include "hpsdf/render/view.h"
#include "image/colormap.h"

namespace hpsdf::render {

/// The buffers hold samples × samples points for each pixel. Their colours are averaged in linear light.
struct Sampling {
  int samples = 1;
  double lineWidth = 1;   ///< width of thin lines, pixels of the finished picture
  double sampleSize = 1;  ///< distance between neighbouring samples of a slice, world units
};

/// The colour of a sample, by its index in the buffers.
using SampleColor = std::function<LinearColor(std::size_t)>;

/// Colours by degree or depth; empty for `ColorBy::normal`. The buffers must outlive the result.
SampleColor levelColors(const ViewBuffers& buffers, LevelMap map, ColorBy color);
/// Colours by the value of a quantity at each sample.
SampleColor quantityColors(std::vector<float> quantity, ColorScale scale);

/// Colours the samples of a slice, with thin outlines of the cells and the surface as a white line.
Image colorCellSlice(const ViewBuffers& buffers, const SampleColor& color, const Sampling& sampling);

/// Colours the distances of a slice with the diverging map, with iso-lines and a bold zero line.
Image colorDistanceSlice(const ViewBuffers& buffers, const DistanceScale& scale, const Sampling& sampling);

/// Colours a lit surface in front of the backdrop. If `color` is empty, surface and boxes have one material, else
/// the given colours with soft shading. Sections and planes are unlit, with the outlines of their cells; on a
/// plane the surface f = offset is a line. `lines` is empty, or holds for each sample how strongly the lines along
/// cells cover it (0 to 1). `bodies` are the materials of the bodies in the buffers.
Image colorSurface(const ViewBuffers& buffers, const Camera& camera, const SampleColor& color, const Sampling& sampling,
                   double offset = 0, const std::vector<float>& lines = {}, std::span<const LinearColor> bodies = {});

/// The colour outside of the domain in a slice, and behind legend and caption.
Color paperColor();

/// The backdrop of a surface, a soft gradient from the top (0) to the bottom (1) of the view.
LinearColor backdropColor(double fromTop);

/// A picture of paper with the backdrop of surfaces in its upper `viewHeight` rows.
Image backdropPicture(int width, int height, int viewHeight);

/// Copies the view into the picture's upper left corner.
void pasteView(Image& picture, const Image& view);

}  // namespace hpsdf::render
