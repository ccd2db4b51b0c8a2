#pragma once
// The state of the explorer. If two states are equal and the two fields are equal, the frames are equal.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "hpsdf/render/picture.h"
#include "session/backend.h"
#include "session/session.h"

namespace hpsdf::app {

/// The parts of the explorer's frame that surround its picture. Each part can be closed.
enum class Panel : std::uint8_t { bar, view, build, legend, histograms, statistics, worst, readout };
constexpr std::array kPanelNames = {"bar", "view", "build", "legend", "histograms", "statistics", "worst", "readout"};
constexpr std::size_t kPanels = kPanelNames.size();

/// The quantity that the picture's colours show, and the colour scale.
struct Coloring {
  render::ColorBy by;
  render::ScaleOptions scale = {};
  std::string other = {};  ///< file of the field to compare with, for `ColorBy::difference`
  std::string mesh = {};   ///< surface that the field was made from, for `ColorBy::error`; empty if the field names it
};

struct ViewState {
  bool slice = false;  ///< shows a plane from the front instead of the surface in space

  int axis = 2;                            ///< axis that the plane is perpendicular to
  std::optional<double> planeOffset;       ///< world units along the axis; by default 0 or the domain's middle
  std::optional<render::FreePlane> plane;  ///< used instead of axis and offset if set
  bool planeInSpace = false;               ///< draws the plane in the surface's picture
  double zoom = 1;                         ///< magnification of the slice; 1 shows the whole section
  std::optional<Vector3> sliceTarget;      ///< middle of the slice's picture; by default the section's middle

  render::OrbitCamera camera;
  double surfaceOffset = 0;  ///< value of the level set that is drawn, world units
  std::optional<render::ClipPlane> clip;
  bool cracks = false;       ///< marks cracks
  std::string defects = {};  ///< mesh whose defects are marked, "own" for the field's own mesh, or empty
  bool surface = true;       ///< draws the surface
  render::ShownCells cells;
  int arrows = 0;  ///< distance of gradient arrows in pixels; 0 for none

  std::string beside;  ///< file of another field, drawn beside the current one with the same settings, or empty

  Coloring surfaceColors{.by = render::ColorBy::normal};
  Coloring sliceColors{.by = render::ColorBy::degree};
  JumpKind worstBy = JumpKind::value;  ///< kind of jump by which the list of interfaces is sorted
  int worstPage = 0;                   ///< page of the list of interfaces, from 0

  std::array<bool, kPanels> open = {true, true, true, true, true, true, true, true};
  std::array<double, 2> scroll = {0, 0};  ///< scroll positions of the left and the right column, pixels
  int width = 1280;                       ///< size of the whole frame, pixels
  int height = 720;
  int samples = 1;  ///< samples per pixel along each axis
  Backend backend;

  bool isOpen(Panel panel) const { return open[static_cast<std::size_t>(panel)]; }
  const Coloring& colors() const { return slice ? sliceColors : surfaceColors; }
};

/// Converts the explorer's state into the renderer's settings, without the picture's size and number of
/// samples.
render::SlicePicture slicePicture(const ViewState& view, const Field& field);
render::SurfacePicture surfacePicture(const ViewState& view, const Field& field);

/// Returns a list of levels as text: "2,4", or "all" for an empty list.
std::string levelText(const std::vector<int>& levels);

/// Returns a script that sets every part of the state. Each line of the script ends in a newline.
std::string scriptOf(const ViewState& view);

/// Compares two states by the scripts that `scriptOf` makes of them. A script sets every part of a state.
inline bool operator==(const ViewState& a, const ViewState& b) { return scriptOf(a) == scriptOf(b); }

/// Returns the choice of a renderer as an argument of the command `show`, for instance "cpu=true" or
/// "gl=software".
std::string backendText(const Backend& backend);

/// Returns a word as it must be spelled in a script, in quotes if necessary.
std::string scriptWord(const std::string& word);
/// Returns a word as it must be spelled in a script. Returns "none" for an empty word.
std::string wordOrNone(const std::string& word);

}  // namespace hpsdf::app
