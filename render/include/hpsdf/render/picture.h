#pragma once
// Draws finished pictures of a field, with colours, a legend and a caption.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/picture_settings.h"
#include "hpsdf/render/renderer.h"
#include "hpsdf/render/shown_cells.h"
#include "hpsdf/render/vector_picture.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Draws a picture: the view, its legend or colour bar to the right, and its caption below. The legend contains all
/// degrees or depths of the field, so that colours keep their meaning from slice to slice. In a picture of a surface,
/// nearer objects hide farther ones, and a clipping plane cuts everything except bodies.
///
/// Throws `Error`, before memory is allocated, if the picture's size is out of range: 16 to 16384 pixels per side, 1 to
/// 8 samples per pixel along each axis, at most 64 Mi samples in all. Throws `Error` if the colours do not suit the
/// kind of view, if the colours' reference data is missing, if the limits of the scale are invalid, if a plane misses
/// the domain, and if the spacing of arrows is out of range.
Image draw(Renderer& renderer, const Field& field, const SlicePicture& picture, const ReferenceData& reference = {});
Image draw(Renderer& renderer, const Field& field, const SurfacePicture& picture, const ReferenceData& reference = {});

using View = std::variant<SliceView, SurfaceView>;

/// A finished picture with the view that it shows.
struct Drawn {
  Image image;
  View view;
  ViewBuffers buffers;  ///< the rendered data, samples × samples entries per pixel of the view
  int samples = 1;
  bool seen = false;  ///< true if any pixel shows the field
  Legend legend = {};
  std::vector<std::string> details = {};  ///< details of the caption, the most important first
  ScaleOptions scale = {};                ///< the chosen colour scale; pictures with equal scales have equal colours
  std::array<int, 2> corner = {0, 0};     ///< upper left corner of the view in the picture, pixels
  VectorPicture vectors = {};             ///< the same picture as shapes, if `PictureForm::vectors` asks for them
};
/// Draws a picture as `draw` does. Returns it together with the data from which it was drawn.
Drawn drawSlice(Renderer& renderer, const Field& field, const SlicePicture& picture,
                const ReferenceData& reference = {});
Drawn drawSurface(Renderer& renderer, const Field& field, const SurfacePicture& picture,
                  const ReferenceData& reference = {});

/// The point and the cell of the field that a pixel shows at its middle sample.
struct Pick {
  /// The position in world units. A position that rounding has moved across a face of its cell is moved back into the
  /// cell, by at most 1e-5 of the domain's extent along each axis.
  Vector3 position;
  std::uint32_t cell;  ///< `Cell::id`
  int degree, depth;
  double value;  ///< value of the field as the renderer computed it
};

/// Returns the part of the field that a pixel shows, ignoring lines and arrows drawn over it. Returns std::nullopt for
/// a pixel that shows the background, the legend, the caption or a body. Throws `Error` if the pixel is outside of the
/// picture.
std::optional<Pick> pickAt(const Field& field, const Drawn& drawn, int x, int y);

/// Returns the value of `quantity` at each pixel of a view's buffers, or NaN for a pixel that does not show
/// the field. Throws `Error` if the reference data that the quantity needs is missing.
std::vector<float> quantityAt(const Field& field, const View& view, const ViewBuffers& buffers, ColorBy quantity,
                              const ReferenceData& reference);

/// Returns true if the surface f = offset reaches the sides of the domain, at which the rendering cuts the
/// surface off. Tests the signs of f − offset at 40 × 40 points of each side. A part of the surface that is
/// smaller than the spacing of these points may be missed.
bool meetsWalls(const Field& field, double offset);

/// The size in pixels of the view within a picture, without legend and caption. `draw` requests `samples`
/// times as many pixels along each axis from the renderer.
struct ViewSize {
  int width = 0;
  int height = 0;
};
ViewSize viewSize(const SurfacePicture& picture);

/// Returns the view of the plane that `draw` renders. It has square pixels at the size of the view in the picture.
SliceView sliceView(const Field& field, const SlicePicture& picture);

/// Returns a view of the picture's plane, framed for `width` × `height` square pixels, for an export of field values.
SliceView sliceView(const Field& field, const SlicePicture& picture, int width, int height);

}  // namespace hpsdf::render
