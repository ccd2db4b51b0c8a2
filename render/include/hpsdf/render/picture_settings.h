#pragma once
// The settings of a picture of a field, and the legend of its colours. These are plain data, without the
// functions that draw.

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
#include "hpsdf/render/shown_cells.h"
#include "hpsdf/render/view.h"

namespace hpsdf::render {

/// The quantity that the colours of a view stand for.
enum class ColorBy : std::uint8_t {
  normal,    ///< the light on a surface; not for slices
  degree,    ///< degree of the cell
  depth,     ///< depth of the cell
  distance,  ///< f; not for surfaces
  // The following enumerators are quantities: numbers that are never negative, shown on a colour scale from
  // dark to light.
  valueJump,     ///< greatest jump of f at the cell's faces; needs `ReferenceData::jumps`
  gradientJump,  ///< greatest jump of ∇f at the cell's faces; needs `ReferenceData::jumps`
  slope,         ///< ||∇f| − 1| at the point
  error,         ///< |f − Φ| at the point; needs `ReferenceData::exact`
  difference,    ///< |f − g| at the point; needs `ReferenceData::other`
  cellError,     ///< estimated RMS error of the cell, √(ε_e / its volume), without the nearness weight
};
constexpr bool isQuantity(ColorBy color) { return color >= ColorBy::valueJump; }

/// The data, besides the field, from which some quantities are computed. All objects must exist while a
/// picture is drawn.
struct ReferenceData {
  const Jumps* jumps = nullptr;
  const DistanceFunction* exact = nullptr;  ///< Φ
  const Field* other = nullptr;             ///< g; outside of its domain g is continued
  /// The defects of the mesh, in the field's units. They are marked on the field's surface in the same way as
  /// in a picture of the mesh alone (mesh_picture.h).
  const MeshDefects* defects = nullptr;
};

/// The range of values that the colours represent. Pictures of several views or fields can be compared if
/// they use the same scale.
struct ScaleOptions {
  /// For a quantity: the values of the darkest and the lightest colour, in ascending order, and above 0 on a
  /// logarithmic scale. For distances: the lowest and the highest value for which colours and iso-lines are
  /// chosen. If no limits are given, they are chosen from the values, except a few outliers. For a quantity
  /// of cells these are the values of all cells, else the values at the points shown.
  std::optional<std::array<double, 2>> limits = {};
  bool logarithmic = true;
  /// Degrees or depths that the legend contains in addition to those of the field; 0 to 255, in ascending
  /// order.
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
  int width = 1280;  ///< pixels of the whole picture, legend included
  int height = 720;  ///< pixels of the whole picture, caption included
  int samples = 1;   ///< samples per pixel along each axis, 1 to 8
  ScaleOptions scale = {};
  bool bare = false;                   ///< draws the view alone, as large as the picture, without legend and caption
  double zoom = 1;                     ///< 1 shows the whole section with the domain; above 0
  std::optional<Vector3> target = {};  ///< centre of the view, moved into the plane; the section's centre when absent
  int arrows = 0;                      ///< pixels between arrows along the gradient, 4 to 1000; 0 draws none
};

/// Bodies that a picture shows together with a field's surface. The bodies keep their own colours, and a
/// clipping plane does not cut them. The renderer and the bodies must exist while a picture is drawn.
struct ShownBodies {
  BodyRenderer* renderer = nullptr;  ///< holds the bodies' meshes; nullptr for no bodies
  std::span<const Body> bodies = {};
  std::string note = {};  ///< text about the bodies for the caption, e.g. "t = 2.5 s"
};

/// A caption that the caller writes.
struct Caption {
  std::string name = {};
  std::vector<std::string> details = {};  ///< the most important first; the caption has those that fit
};

struct SurfacePicture {
  OrbitCamera camera;
  double offset = 0;  ///< the surface is f = offset, world units
  ColorBy color = ColorBy::normal;
  int width = 1280;
  int height = 720;
  int samples = 1;  ///< samples per pixel along each axis, 1 to 8
  ScaleOptions scale = {};
  std::optional<ClipPlane> clip = {};  ///< the section is coloured like the surface, with the outlines of its cells
  bool cracks = false;                 ///< marks where f jumps across the offset at a face (`ViewBuffers::crack`)
  bool bare = false;                   ///< draws the view alone, without legend and caption
  bool surface = true;                 ///< draws the surface and its section
  std::optional<Plane> plane = {};     ///< the domain's section with this plane is drawn, in the picture's colours
  ShownCells cells = {};
  int arrows = 0;  ///< pixels between arrows along the gradient, 4 to 1000; 0 draws none
  ShownBodies bodies = {};
  /// Replaces the caption about the field. This is meant for pictures of which the field is only a part. With
  /// `ColorBy::normal` the panel of facts about the field is omitted too, and the view takes the panel's
  /// space.
  std::optional<Caption> caption = {};
};

/// The meaning of a picture's colours. It is what the picture's legend shows, or what a legend beside a
/// picture without one has to show.
struct Legend {
  struct Level {
    int level;  ///< degree or depth
    Color color;
    double share;  ///< fraction of the domain's volume
  };
  struct Mark {
    double t;  ///< position on the bar, 0 at its low end, 1 at its high end
    std::string text;
  };
  std::string title = {};          ///< empty where colours stand for no quantity
  std::vector<Level> levels = {};  ///< ascending; empty unless the colours stand for degrees or depths
  std::vector<Color> bar = {};     ///< colours from the low end to the high end; empty for degrees and depths
  std::vector<Mark> marks = {};
  struct Defects {
    std::string name;   ///< "boundary edges"
    std::string count;  ///< "1,234"; "≥1,234" where the search was cut short
    Color color;
  };
  std::vector<Defects> defects = {};  ///< kinds of defects of the mesh that are marked
};

}  // namespace hpsdf::render
