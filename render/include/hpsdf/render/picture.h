#pragma once
// From a field to a finished picture: view, buffers, colours, legend, caption.

#include <optional>
#include <string>
#include <variant>

#include "hpsdf/field.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/renderer.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

enum class SliceColor : std::uint8_t { degree, depth, distance };
enum class SurfaceColor : std::uint8_t { normal, degree, depth };

struct AxisPlane {
  int axis = 2;
  double offset = 0;  ///< world units
};
struct FreePlane {
  Vector3 point;
  Vector3 normal;
};

struct SlicePicture {
  std::variant<AxisPlane, FreePlane> plane = AxisPlane{};
  SliceColor color = SliceColor::degree;
  int width = 1280;  ///< of the whole picture, legend included
  int height = 720;
  int samples = 1;  ///< an axis and pixel, 1 to 8
};

struct SurfacePicture {
  OrbitCamera camera;
  double offset = 0;
  SurfaceColor color = SurfaceColor::normal;
  int width = 1280;
  int height = 720;
  int samples = 1;
};

/// Draws the view beside its legend or colour bar and above its caption. Levels in the legend are those that occur in
/// the whole field, so that colours keep their meaning from slice to slice.
/// Throws `Error` for a size or sample count out of range (16 to 16384 pixels; 1 to 8; no more than 64 Mi samples in
/// all), before memory is taken.
Image draw(Renderer& renderer, const Field& field, const SlicePicture& picture);
Image draw(Renderer& renderer, const Field& field, const SurfacePicture& picture);

/// The same picture, and whether any of its pixels shows the surface.
struct DrawnSurface {
  Image image;
  bool seen = false;
};
DrawnSurface drawSurface(Renderer& renderer, const Field& field, const SurfacePicture& picture);

/// Whether the surface f = offset meets the walls of the domain, where tracing cuts it off. Judged by the sign at
/// 40 × 40 points of each wall: a piece that is smaller than their distance may pass for none.
bool meetsWalls(const Field& field, double offset);

/// Size in pixels of the view within a picture of this size, without legend and caption. `draw` asks the renderer for
/// `samples` times as much, so that buffers can be compared with those behind a picture.
struct ViewSize {
  int width = 0;
  int height = 0;
};
ViewSize viewSize(int pictureWidth, int pictureHeight);

/// The slice's view in the picture: what `draw` colours. Its pixels are square at `viewSize`.
SliceView sliceView(const Field& field, const SlicePicture& picture);

/// The same plane framed for `width` × `height` square samples instead: for raw values.
SliceView sliceView(const Field& field, const SlicePicture& picture, int width, int height);

}  // namespace hpsdf::render
