#pragma once
// The settings of a picture of a field, and the legend of its colours, as plain data without drawing functions.

#include <array>
#include <cstdint>
#include <memory>
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
#include "hpsdf/render/color_maps.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/shown_cells.h"
#include "hpsdf/render/view.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::render {

/// The quantity that the colours of a view show.
enum class ColorBy : std::uint8_t {
  normal,    ///< lighting of a surface without a colour scale; not for slices
  degree,    ///< polynomial degree of the cell
  depth,     ///< octree depth of the cell
  distance,  ///< value of the field f; not for surfaces
  // The following enumerators are quantities: numbers that are never negative. A colour scale from dark to light shows
  // them.
  valueJump,     ///< greatest jump of f at the cell's faces; needs `ReferenceData::jumps`
  gradientJump,  ///< greatest jump of ∇f at the cell's faces; needs `ReferenceData::jumps`
  slope,         ///< error of the slope, ||∇f| − 1|, at the point
  error,         ///< |f − exact distance| at the point; needs `ReferenceData::exact`
  difference,    ///< |f − another field| at the point; needs `ReferenceData::other`
  cellError,     ///< estimated RMS error in the cell: √(squared L2 error / volume), without weights
};
constexpr bool isQuantity(ColorBy color) { return color >= ColorBy::valueJump; }

/// The texts of a colour mode.
struct ColorMode {
  ColorBy color;
  std::string name;                      ///< the mode's name in commands, such as "value-jump"
  std::string explanation = {};          ///< words for the mode in help texts that list the quantities
  std::vector<std::string> titles = {};  ///< titles of the legend, from the longest to the shortest
};

/// Returns all colour modes, in the order of `ColorBy`.
std::span<const ColorMode> colorModes();

/// A mesh that approximates a surface of the field, such as its contour. Pictures of the surface show the mesh's edges,
/// slices the line in which the plane cuts the mesh.
struct ShownMesh {
  const TriangleMesh* mesh = nullptr;  ///< triangles face outward; nullptr for no mesh
  double tolerance = 0;                ///< greatest distance between the mesh and the surface, world units
};

/// A solid whose outline a slice shows, such as an operand of a Boolean operation. The outline is solid where the
/// field's surface lies within two pixels of it, and dashed elsewhere.
struct OutlinedSolid {
  std::string name;  ///< for the legend
  /// Signed distance, negative inside. Its values may be lower bounds: no value is farther from 0 than the surface is.
  std::shared_ptr<const DistanceFunction> distance;
};

/// The data, besides the field, from which some quantities are computed. The objects must exist while a picture is
/// drawn.
struct ReferenceData {
  const Jumps* jumps = nullptr;
  const DistanceFunction* exact = nullptr;  ///< the exact signed distance
  const Field* other = nullptr;             ///< the field to compare with, which is continued outside of its domain
  /// The defects of the mesh, in the field's units. Pictures of the field's surface mark these defects.
  const MeshDefects* defects = nullptr;
  ShownMesh mesh = {};                           ///< drawn as lines
  std::span<const OutlinedSolid> outlined = {};  ///< solids whose outlines slices show
};

/// The range of values that the colours represent. Pictures of different views or fields are comparable if they use the
/// same scale.
struct ScaleOptions {
  /// The lowest and the highest value of the colour scale; above 0 on a logarithmic scale. If absent, the limits are
  /// chosen from the values in the picture, or from all cells if the quantity is constant in each cell. The choice
  /// ignores a few outliers, except for distances.
  std::optional<std::array<double, 2>> limits = {};
  bool logarithmic = true;
  /// Colours each cell by the greatest value that the picture shows of it, in place of each point by its own.
  bool perCell = false;
  /// Degrees or depths that the legend contains in addition to those of the field; 0 to 255, in ascending order. Films
  /// and pictures side by side thus have one legend.
  std::vector<int> levels = {};
  /// The name of the colour map (`colorMaps`) for a quantity or for distances; empty for the default one. Levels have
  /// colours of their own (`levelColor`).
  std::string map = {};
};

struct AxisPlane {
  int axis = 2;
  double offset = 0;  ///< position of the plane along the axis, world units
};
struct FreePlane {
  Vector3 point;
  Vector3 normal;
};

using Plane = std::variant<AxisPlane, FreePlane>;

/// The form in which a picture is finished.
struct PictureForm {
  double pixelRatio = 1;     ///< pixels of the finished picture for each pixel of its size, above 0: enlarges all parts
  bool transparent = false;  ///< leaves out the paper and the backdrop
  bool vectors = false;      ///< also makes `Drawn::vectors`
};

struct SlicePicture {
  Plane plane = AxisPlane{};
  ColorBy color = ColorBy::degree;
  int width = 1280;  ///< pixels of the whole picture, legend included
  int height = 720;  ///< pixels of the whole picture, caption included
  int samples = 1;   ///< samples per pixel along each axis, 1 to 8
  ScaleOptions scale = {};
  bool bare = false;                   ///< draws the view alone, as large as the picture, without legend and caption
  double zoom = 1;                     ///< magnification, above 0; 1 shows the whole section of the domain
  std::optional<Vector3> target = {};  ///< centre of the view, projected onto the plane; default: the section's centre
  int arrows = 0;                      ///< spacing of gradient arrows in pixels, 4 to 1000; 0 draws none
  PictureForm form = {};
};

/// Bodies that a picture shows together with a field's surface. The bodies keep their own colours, and a
/// clipping plane does not cut them. The renderer and the bodies must exist while a picture is drawn.
struct ShownBodies {
  BodyRenderer* renderer = nullptr;  ///< holds the bodies' meshes; nullptr for no bodies
  std::span<const Body> bodies = {};
  std::string note = {};  ///< text about the bodies for the caption, e.g. "t = 2.5 s"
};

/// A caption written by the caller.
struct Caption {
  std::string name = {};
  std::vector<std::string> details = {};  ///< the most important first; details that do not fit are left out
};

struct SurfacePicture {
  OrbitCamera camera;
  double offset = 0;  ///< the picture shows the surface f = offset; world units
  ColorBy color = ColorBy::normal;
  int width = 1280;
  int height = 720;
  int samples = 1;  ///< samples per pixel along each axis, 1 to 8
  ScaleOptions scale = {};
  std::optional<ClipPlane> clip = {};  ///< cuts the solid open; the section shows the outlines of cells
  bool cracks = false;                 ///< marks the cracks of the surface (`ViewBuffers::crack`)
  bool bare = false;                   ///< draws the view alone, without legend and caption
  bool surface = true;                 ///< draws the surface, and the cut by the clipping plane
  /// Measures by the field how much light reaches the surface: folds are darker, the solid throws a soft shadow on
  /// itself and, if it is alone in the picture, on the ground below it.
  bool shadows = true;
  bool edges = false;  ///< draws lines where the surface bends by more than 30° or ends before something farther away
  std::optional<Plane> plane = {};  ///< draws the section of the domain with this plane
  ShownCells cells = {};
  int arrows = 0;  ///< spacing of gradient arrows in pixels, 4 to 1000; 0 draws none
  ShownBodies bodies = {};
  /// Replaces the caption about the field. With `ColorBy::normal`, the panel of facts about the field is omitted too,
  /// and the view becomes wider.
  std::optional<Caption> caption = {};
  PictureForm form = {};
};

/// The meaning of a picture's colours, as data. An application can draw this legend beside a picture that has none.
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
  std::string title = {};          ///< e.g. "polynomial degree"; empty if the picture has no colour scale
  std::vector<Level> levels = {};  ///< ascending; empty unless the colours stand for degrees or depths
  std::vector<Color> bar = {};     ///< colours from the low end to the high end; empty for degrees and depths
  std::vector<Mark> marks = {};
  struct Defects {
    std::string name;   ///< name of the kind, e.g. "boundary edges"
    std::string count;  ///< number as text: "1,234", or "≥1,234" if the search was cut short
    Color color;
  };
  std::vector<Defects> defects = {};  ///< the kinds of mesh defects that the picture marks
  struct Line {
    std::string name;  ///< e.g. the name of a solid
    Color color;
  };
  std::vector<Line> lines = {};  ///< the lines that a slice shows: outlines of solids, the section of a mesh
};

}  // namespace hpsdf::render
