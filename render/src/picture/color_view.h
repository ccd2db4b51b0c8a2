#pragma once
// From the buffers of a view to the colours of its pixels. Reads nothing but the buffers, so that OpenGL and the oracle
// are coloured alike.

#include <functional>
#include <span>
#include <vector>

#include "hpsdf/render/picture.h"
#include "hpsdf/render/view.h"
#include "image/colormap.h"

namespace hpsdf::render {

/// The buffers hold samples × samples points a pixel; colours are averaged over them in linear light.
struct Sampling {
  int samples = 1;
  double lineWidth = 1;   ///< of thin lines, in pixels of the finished picture
  double sampleSize = 1;  ///< between neighbouring samples of a slice, world units
};

/// The colour of a sample of some buffers, by its index.
using SampleColor = std::function<LinearColor(std::size_t)>;

/// The colours of degrees or depths; empty for `ColorBy::normal`. Refers to both arguments.
SampleColor levelColors(const ViewBuffers& buffers, const LevelMap& map, ColorBy color);
/// Of a quantity. Refers to both arguments.
SampleColor quantityColors(const std::vector<float>& quantity, const ColorScale& scale);

/// Coloured samples under thin outlines of the cells, the surface as a white line.
Image colorCellSlice(const ViewBuffers& buffers, const SampleColor& color, const Sampling& sampling);

/// The diverging map under iso-lines, the zero line heavy.
Image colorDistanceSlice(const ViewBuffers& buffers, const DistanceScale& scale, const Sampling& sampling);

/// A lit surface before the backdrop: one material where `color` is empty, else that colour, softly shaded; boxes
/// likewise. Planes are flat, their cells outlined; where no clipping plane, with the surface f = offset as a line.
/// `lines`: of cells, how strongly each sample is covered; or empty. `bodies`: the materials of those that the buffers
/// show.
Image colorSurface(const ViewBuffers& buffers, const Camera& camera, const SampleColor& color, const Sampling& sampling,
                   double offset = 0, const std::vector<float>& lines = {}, std::span<const LinearColor> bodies = {});

/// What is drawn where a slice leaves the domain, and under legend and caption.
Color paperColor();

/// What a surface stands before: a soft gradient from the top, 0, to the bottom of the view, 1.
LinearColor backdropColor(double fromTop);

}  // namespace hpsdf::render
