#pragma once
// From a field to a finished picture: view, buffers, colours, legend, caption.

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
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// Draws the view with its legend or colour bar to the right and its caption below. The legend contains all degrees or
/// depths of the field, so that colours keep their meaning from slice to slice.
///
/// In a picture of a surface nearer things hide farther ones: surface, section, plane and boxes are resolved in the
/// buffers, lines are drawn over them. A clipping plane cuts everything except bodies.
///
/// Throws `Error` before memory is taken for a size or sample count out of range (16 to 16384 pixels; 1 to 8; no more
/// than 64 Mi samples in all), and for colours that do not suit such a view or whose reference data is missing, limits
/// that make no scale, a plane that misses the domain, and arrows out of range.
Image draw(Renderer& renderer, const Field& field, const SlicePicture& picture, const ReferenceData& reference = {});
Image draw(Renderer& renderer, const Field& field, const SurfacePicture& picture, const ReferenceData& reference = {});

using View = std::variant<SliceView, SurfaceView>;

/// A finished picture with the view that it shows.
struct Drawn {
  Image image;
  View view;
  ViewBuffers buffers;  ///< samples × samples for each pixel of the view
  int samples = 1;
  bool seen = false;  ///< true if any pixel shows the field
  Legend legend = {};
  std::vector<std::string> details = {};  ///< details of the caption, the most important first
  ScaleOptions scale = {};  ///< scale with the limits and levels that were chosen: gives another picture these colours
  std::array<int, 2> corner = {0, 0};  ///< upper left corner of the view in the picture, pixels
};
/// Draws as `draw` does, and keeps the data behind the picture.
Drawn drawSlice(Renderer& renderer, const Field& field, const SlicePicture& picture,
                const ReferenceData& reference = {});
Drawn drawSurface(Renderer& renderer, const Field& field, const SurfacePicture& picture,
                  const ReferenceData& reference = {});

/// The content of the middle sample of a picture's pixel.
struct Pick {
  /// World units. A position that rounding has moved across a face is moved back into the cell, by at most 1e-5 of the
  /// domain.
  Vector3 position;
  std::uint32_t cell;  ///< `Cell::id`
  int degree, depth;
  double value;  ///< f as the renderer computed it; on a surface the offset, up to rounding
};

/// Returns what lies behind lines and arrows at a pixel; nothing where the pixel shows no part of the field, but
/// paper, backdrop, legend or bodies. Throws `Error` for a pixel outside of the picture.
std::optional<Pick> pickAt(const Field& field, const Drawn& drawn, int x, int y);

/// The quantity at each pixel of a view's buffers; NaN where the pixel does not show the field. Throws `Error` where
/// the reference data that the quantity needs is missing.
std::vector<float> quantityAt(const Field& field, const View& view, const ViewBuffers& buffers, ColorBy quantity,
                              const ReferenceData& reference);

/// True if the surface f = offset meets the walls of the domain, where tracing cuts it off. The signs of f − offset at
/// 40 × 40 points of each wall decide, so that a piece smaller than the points' spacing may be missed.
bool meetsWalls(const Field& field, double offset);

/// Size in pixels of the view within a picture, without legend and caption. `draw` asks the renderer for
/// `samples` times as many pixels along each axis.
struct ViewSize {
  int width = 0;
  int height = 0;
};
ViewSize viewSize(const SurfacePicture& picture);

/// The view that `draw` colours. Its pixels are square at `viewSize`.
SliceView sliceView(const Field& field, const SlicePicture& picture);

/// The same plane, framed for `width` × `height` square pixels, for files of raw values.
SliceView sliceView(const Field& field, const SlicePicture& picture, int width, int height);

}  // namespace hpsdf::render
