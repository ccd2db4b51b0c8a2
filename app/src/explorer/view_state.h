#pragma once
// The state of the explorer. Equal states and equal fields give equal frames.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "hpsdf/render/picture.h"
#include "session/backend.h"
#include "session/session.h"

namespace hpsdf::app {

/// The parts of the explorer's frame that surround its picture, the overlay that tells keys and mouse actions, and the
/// sections of the two columns. A part is open or closed, a section unfolded or folded to its heading.
enum class Panel : std::uint8_t {
  bar,
  left,
  right,
  readout,
  keys,
  questions,  // sections of the left column
  shown,
  colors,
  camera,
  build,
  legend,  // sections of the right column
  histograms,
  worst,
  statistics
};
constexpr std::array kPanelNames = {"bar",    "left",   "right", "readout", "keys",       "questions", "shown",
                                    "colors", "camera", "build", "legend",  "histograms", "worst",     "statistics"};
constexpr std::size_t kPanels = kPanelNames.size();
constexpr bool isSection(Panel panel) { return panel >= Panel::questions; }
constexpr Panel columnOf(Panel section) { return section < Panel::legend ? Panel::left : Panel::right; }

/// The quantity that the picture's colours show, and the colour scale.
struct Coloring {
  render::ColorBy by;
  render::ScaleOptions scale = {};
  std::string other = {};  ///< file of the field to compare with, for `ColorBy::difference`
  std::string mesh = {};   ///< surface of the field, for `ColorBy::error`; if empty, the surface that the field names
};

/// Returns the default tolerance of contours as a percentage.
std::string defaultContourTolerance();

constexpr double kLeastScale = 1, kGreatestScale = 4;  ///< range of `ViewState::scale`

struct ViewState {
  bool slice = false;  ///< true shows a slice of the field, false the surface in space

  int axis = 2;                            ///< index of the axis perpendicular to the plane
  std::optional<double> planeOffset;       ///< position on the axis, world units; by default `defaultOffset`
  std::optional<render::FreePlane> plane;  ///< if set, used instead of `axis` and `planeOffset`
  bool planeInSpace = false;               ///< also draws the plane in the picture of the surface
  double zoom = 1;                         ///< magnification of the slice; 1 shows the whole section
  /// Expression of which the slice outlines the operands, "own" for the one from which the field was built, or empty.
  std::string operands;
  std::optional<Vector3> sliceTarget;  ///< centre of the slice's picture; by default the centre of the section

  render::OrbitCamera camera;
  bool guessesUp = false;    ///< each new field sets `camera.up` to a guess; `scriptOf` writes only the axis
  double surfaceOffset = 0;  ///< value of the level set that is drawn, world units
  std::optional<render::ClipPlane> clip;
  bool cracks = false;       ///< marks pixels where a ray meets a jump of the field
  std::string defects = {};  ///< mesh whose defects are marked, "own" for the field's own mesh, or empty
  bool surface = true;       ///< draws the surface
  bool shadows = true;       ///< folds are darker and the solid throws a shadow, in pictures at rest
  bool edges = false;        ///< draws feature edges and outlines
  render::ShownCells cells;
  bool triangles = false;                                      ///< draws the triangles of the surface's contour
  std::string trianglesTolerance = defaultContourTolerance();  ///< as text, such as "0.002" or "0.1%"
  bool trianglesSimplified = false;                            ///< merges vertices of the contour
  int arrows = 0;                                              ///< spacing of gradient arrows in points; 0 for none

  std::string beside;  ///< file of another field, drawn beside the current one with the same settings, or empty

  Coloring surfaceColors{.by = render::ColorBy::normal};
  Coloring sliceColors{.by = render::ColorBy::degree};
  JumpKind worstBy = JumpKind::value;  ///< kind of jump by which the list of interfaces is sorted
  bool worstOnSurface = false;         ///< the list has only interfaces at the surface
  int worstPage = 0;                   ///< page of the list of interfaces, from 0
  std::optional<Vector3> mark;         ///< point that is marked in the picture, world units

  /// The parts that are open and the sections that are unfolded. At first the sections are folded in which a view is
  /// set up with numbers, and those that list figures.
  std::array<bool, kPanels> open = {true, true,  true,  true, false, true,  true,
                                    true, false, false, true, true,  false, false};
  std::array<double, 2> scroll = {0, 0};  ///< scroll positions of the left and the right column, points
  int width = 1280;                       ///< size of the whole frame, pixels
  int height = 720;
  double scale = 1;  ///< pixels per point, the unit of text, widgets and their distances
  int samples = 1;   ///< samples per pixel along each axis
  Backend backend;

  bool isOpen(Panel panel) const { return open[static_cast<std::size_t>(panel)]; }
  /// True if the content of a section is drawn, provided that the frame has room for its column.
  bool isUnfolded(Panel section) const { return isOpen(columnOf(section)) && isOpen(section); }
  const Coloring& colors() const { return slice ? sliceColors : surfaceColors; }
};

/// Converts the explorer's state into the renderer's settings, without the picture's size and number of
/// samples.
render::SlicePicture slicePicture(const ViewState& view, const Field& field);
render::SurfacePicture surfacePicture(const ViewState& view, const Field& field);

/// Returns the choices for the contour whose triangles the explorer shows.
ContourChoice contourChoice(const ViewState& view, const Field& field);

/// Returns a script that sets every part of the explorer's state. Each line of the script ends in a newline.
std::string scriptOf(const ViewState& view);

/// Compares two states by comparing their scripts. A script made by `scriptOf` contains every part of a state.
inline bool operator==(const ViewState& a, const ViewState& b) { return scriptOf(a) == scriptOf(b); }

/// Returns the choice of a renderer as an argument of the command `show`, for instance "cpu=true" or
/// "gl=software".
std::string backendText(const Backend& backend);

/// Returns a word as it must be spelled in a script, in quotes if necessary.
std::string scriptWord(const std::string& word);
/// Returns a word as it must be spelled in a script. Returns "none" for an empty word.
std::string wordOrNone(const std::string& word);

}  // namespace hpsdf::app
