#pragma once
// Lines that are painted over the finished view of a slice: outlines of solids, and the section of a mesh.

#include <span>
#include <vector>

#include "hpsdf/render/image.h"
#include "hpsdf/render/picture_settings.h"
#include "hpsdf/render/vector_picture.h"
#include "hpsdf/render/view.h"
#include "picture/legend.h"

namespace hpsdf::render {

/// A straight line in a picture, in pixels from the upper left corner.
struct FlatLine {
  Eigen::Vector2d from, to;
};

/// Returns the curve in which a plane meets the surface of a solid, within `part` of a view of width × height pixels:
/// short lines between the pixels beside which the sign of the distance changes (marching squares).
std::vector<FlatLine> outlineOf(const DistanceFunction& distance, const SliceView& view, const PixelRect& part,
                                int width, int height);

/// Returns the lines in which a plane cuts the triangles of a mesh, in a view of width × height pixels.
std::vector<FlatLine> sectionOf(const TriangleMesh& mesh, const SliceView& view, int width, int height);

/// Returns the colours of outlines, which can be told apart with every kind of colour vision.
std::span<const Color> outlineColors();

/// Returns the colour of the outline with this index. After the last of `outlineColors`, the first one follows again.
Color outlineColor(std::size_t index);

/// Returns the names and colours of the lines that `paintSliceLines` paints.
std::vector<Legend::Line> lineLegend(const ReferenceData& reference);

/// Adds rows with these names and colours at the top of the panel, and takes their room from the panel.
void addLineLegend(Overlay& overlay, Frame& frame, const std::vector<Legend::Line>& lines);

/// Paints the outlines of `reference.outlined` and the section of `reference.mesh` over the view of width × height
/// pixels in the upper left corner of the picture. `part` is the part of the view that shows the domain.
void paintSliceLines(Image& picture, const Field& field, const SliceView& view, const PixelRect& part, int width,
                     int height, const ReferenceData& reference, double lineWidth);

/// Returns the lines that `paintSliceLines` paints as shapes of a vector picture.
std::vector<VectorShape> sliceLineShapes(const Field& field, const SliceView& view, const PixelRect& part, int width,
                                         int height, const ReferenceData& reference, double lineWidth);

}  // namespace hpsdf::render
