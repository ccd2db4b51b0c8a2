#pragma once
// From a field to a finished picture: view, buffers, colours, legend, caption.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "hpsdf/distance_function.h"
#include "hpsdf/field.h"
#include "hpsdf/jumps.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/render/bodies.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/renderer.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// What the colours of a view mean.
enum class ColorBy : std::uint8_t {
  normal,    ///< nothing: a lit surface; not for slices
  degree,    ///< of the cell
  depth,     ///< of the cell
  distance,  ///< f; not for surfaces
  // quantities: not negative, on a scale from dark to light
  valueJump,     ///< greatest jump of f at the cell's faces; needs `ReferenceData::jumps`
  gradientJump,  ///< the same of the gradient
  slope,         ///< how far |∇f| is from 1 at the point
  error,         ///< |f − Φ| at the point; needs `ReferenceData::exact`
  difference,    ///< |f − g| at the point; needs `ReferenceData::other`
  cellError,     ///< estimated RMS error of the cell: √(ε_e / its volume), without nearness
};
constexpr bool isQuantity(ColorBy color) { return color >= ColorBy::valueJump; }

/// What some quantities are known by. What is referred to must live while a picture is drawn.
struct ReferenceData {
  const Jumps* jumps = nullptr;
  const DistanceFunction* exact = nullptr;
  const Field* other = nullptr;  ///< g; outside its domain its continuation counts
  /// Of the mesh, in the field's units: marked on a surface, as in a picture of the mesh alone (mesh_picture.h).
  const MeshDefects* defects = nullptr;
};

/// What colours stand for, so that pictures of several views or fields can be compared.
struct ScaleOptions {
  /// Of a quantity: the values of the darkest and the lightest colour, ascending; above 0 on a logarithmic scale.
  /// Without them they are chosen from the values, a few outliers left out: of all cells where the quantity is a
  /// cell's, else of the points shown. Of distances: the lowest and the highest for which colours and iso-lines are
  /// chosen.
  std::optional<std::array<double, 2>> limits = {};
  bool logarithmic = true;
  /// Of degrees and depths: the legend has these besides the field's own, 0 to 255, ascending.
  std::vector<int> levels = {};
};

struct AxisPlane {
  int axis = 2;
  double offset = 0;  ///< world units
};
struct FreePlane {
  Vector3 point;
  Vector3 normal;
};

using Plane = std::variant<AxisPlane, FreePlane>;

struct SlicePicture {
  Plane plane = AxisPlane{};
  ColorBy color = ColorBy::degree;
  int width = 1280;  ///< of the whole picture, legend included
  int height = 720;
  int samples = 1;  ///< an axis and pixel, 1 to 8
  ScaleOptions scale = {};
  bool bare = false;                   ///< the view alone, as large as the picture: no legend, no caption
  double zoom = 1;                     ///< 1 shows the whole section with the domain; above 0
  std::optional<Vector3> target = {};  ///< what is in the middle, moved into the plane; the section's middle
  int arrows = 0;                      ///< pixels between arrows along the gradient, 4 to 1000; 0 for none
};

enum class CellStyle : std::uint8_t {
  none,
  lines,  ///< their edges; those of cells that are small in the picture fade
  boxes,  ///< solids of 0.8 of their extent
};

/// Which of the octree's leaves stand in a picture, and how.
struct ShownCells {
  CellStyle style = CellStyle::none;
  std::vector<int> degrees = {};  ///< ascending; all when empty
  std::vector<int> depths = {};   ///< likewise
};

/// Bodies about a field's surface. Their colours are their own, whatever those of the field mean; a clipping plane
/// leaves them whole. What is referred to must live while a picture is drawn.
struct ShownBodies {
  BodyRenderer* renderer = nullptr;  ///< of their meshes; nullptr for no bodies
  std::span<const Body> bodies = {};
  std::string note = {};  ///< what the caption says of them, e.g. "t = 2.5 s"
};

/// A caption of one's own.
struct Caption {
  std::string name = {};
  std::vector<std::string> details = {};  ///< those that fit are taken, the most important first
};

struct SurfacePicture {
  OrbitCamera camera;
  double offset = 0;
  ColorBy color = ColorBy::normal;
  int width = 1280;
  int height = 720;
  int samples = 1;
  ScaleOptions scale = {};
  std::optional<ClipPlane> clip = {};  ///< the section is coloured like the surface, its cells outlined
  bool cracks = false;  ///< mark where the field jumps over the offset between two cells (`ViewBuffers::crack`)
  bool bare = false;
  bool surface = true;              ///< whether the surface, and its section, are drawn
  std::optional<Plane> plane = {};  ///< the domain's section with it is coloured likewise
  ShownCells cells = {};
  int arrows = 0;  ///< as in slices
  ShownBodies bodies = {};
  /// In place of what is known of the field, which is but a part of what is shown: as caption, and, where the colours
  /// mean nothing, beside the view, which takes that room.
  std::optional<Caption> caption = {};
};

/// Draws the view beside its legend or colour bar and above its caption. Levels in the legend are those that occur in
/// the whole field, so that colours keep their meaning from slice to slice.
/// Throws `Error` for a size or sample count out of range (16 to 16384 pixels; 1 to 8; no more than 64 Mi samples in
/// all), before memory is taken; for colours that are not for such a view or whose reference data is missing; for
/// limits that make no scale; for a plane that misses the domain; for arrows out of range.
///
/// What is in a surface's picture hides what lies behind it: surface, section, plane and boxes in the buffers, lines
/// over them. A clipping plane cuts all of it but bodies.
Image draw(Renderer& renderer, const Field& field, const SlicePicture& picture, const ReferenceData& reference = {});
Image draw(Renderer& renderer, const Field& field, const SurfacePicture& picture, const ReferenceData& reference = {});

/// What the colours of a picture mean: as it stands in the picture, or for a legend of one's own beside a bare one.
struct Legend {
  struct Level {
    int level;  ///< degree or depth
    Color color;
    double share;  ///< of the domain's volume
  };
  struct Mark {
    double place;  ///< on the bar, 0 at its low end, 1 at its high end
    std::string text;
  };
  std::string title = {};          ///< empty where colours mean nothing
  std::vector<Level> levels = {};  ///< ascending; of colours by degree or depth
  std::vector<Color> bar = {};     ///< from its low end to its high end; of all others
  std::vector<Mark> marks = {};
  struct Defects {
    std::string name;   ///< "boundary edges"
    std::string count;  ///< "1,234"; "≥1,234" where some were left out
    Color color;
  };
  std::vector<Defects> defects = {};  ///< of the mesh, where they are marked
};

/// A finished picture and the view in it.
struct Drawn {
  Image image;
  std::variant<SliceView, SurfaceView> view;
  ViewBuffers buffers;  ///< samples × samples for each pixel
  int samples = 1;
  bool seen = false;  ///< whether any pixel shows the field
  Legend legend = {};
  std::vector<std::string> details = {};  ///< what is shown, the most important first
  ScaleOptions scale = {};  ///< as drawn, with what was chosen: the same for another picture gives it the same colours
  std::array<int, 2> corner = {0, 0};  ///< of the view in the picture, pixels from the upper left
};
Drawn drawSlice(Renderer& renderer, const Field& field, const SlicePicture& picture,
                const ReferenceData& reference = {});
Drawn drawSurface(Renderer& renderer, const Field& field, const SurfacePicture& picture,
                  const ReferenceData& reference = {});

/// What a pixel of a picture shows, at its middle sample.
struct Pick {
  /// World units; within the cell: where rounding has left it across a face, it is moved back, by 1e-5 of the domain at
  /// most.
  Vector3 position;
  std::uint32_t cell;  ///< `Cell::id`
  int degree, depth;
  double value;  ///< f as the renderer has it; on a surface the offset but for rounding
};

/// Of lines and arrows, what lies behind them. Nothing where the pixel shows no part of the field: paper, backdrop,
/// legend, bodies. Throws `Error` for a pixel outside of the picture.
std::optional<Pick> pickAt(const Field& field, const Drawn& drawn, int x, int y);

/// The quantity at each pixel of a view's buffers; NaN where there is nothing. Throws as `draw` does.
std::vector<float> quantityAt(const Field& field, const SliceView& view, const ViewBuffers& buffers, ColorBy quantity,
                              const ReferenceData& reference);
std::vector<float> quantityAt(const Field& field, const SurfaceView& view, const ViewBuffers& buffers, ColorBy quantity,
                              const ReferenceData& reference);

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
/// The same of a picture that may be bare or have a caption of its own.
ViewSize viewSize(const SurfacePicture& picture);

/// The slice's view in the picture: what `draw` colours. Its pixels are square at `viewSize`.
SliceView sliceView(const Field& field, const SlicePicture& picture);

/// The same plane framed for `width` × `height` square samples instead: for raw values.
SliceView sliceView(const Field& field, const SlicePicture& picture, int width, int height);

}  // namespace hpsdf::render
