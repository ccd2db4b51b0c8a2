#pragma once
// A plot of a field along a straight line, which makes jumps of the field between cells visible.

#include <span>

#include "hpsdf/detail/line.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/picture_settings.h"
#include "hpsdf/render/vector_picture.h"

namespace hpsdf::render {

/// A finished plot.
struct DrawnLine {
  Image image;
  VectorPicture vectors;  ///< the same plot as shapes, if the form asks for them
};

/// Plots a field f along a line, in charts from top to bottom: f and the exact signed distance; the error, which is f
/// minus the exact distance; |∇f| and the slope of f along the line; and coloured bands with the cells' degrees and
/// depths. Thin vertical lines mark the borders of cells. `exact` holds the exact distance at each sample of the line.
/// If `exact` is empty, the jumps of f at cell borders are drawn instead of the error. A small picture omits the lower
/// charts. Throws `Error` if the width or height is not 16 to 16384 pixels, also after it is multiplied by the form's
/// pixel ratio.
DrawnLine drawLine(const Field& field, const Line& line, std::span<const double> exact, int width, int height,
                   const PictureForm& form = {});

}  // namespace hpsdf::render
