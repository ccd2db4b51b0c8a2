#pragma once
// What the explorer shows: equal states draw equal pictures.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "hpsdf/render/picture.h"
#include "session/backend.h"
#include "session/session.h"

namespace hpsdf::app {

/// The parts of the explorer's frame around its picture; each may be closed.
enum class Panel : std::uint8_t { bar, view, build, legend, histograms, statistics, worst, readout };
constexpr std::array kPanelNames = {"bar", "view", "build", "legend", "histograms", "statistics", "worst", "readout"};
constexpr std::size_t kPanels = kPanelNames.size();

/// What colours mean.
struct Coloring {
  render::ColorBy by;
  render::ScaleOptions scale = {};
  std::string other = {};  ///< of difference: the other field's file
  std::string mesh = {};   ///< of error: what the field was made from; empty where that is known
};

struct ViewState {
  bool slice = false;  ///< the flat picture of a plane, rather than the surface in space

  int axis = 2;                            ///< of the plane
  std::optional<double> planeOffset;       ///< 0, or the middle of the domain, when not given
  std::optional<render::FreePlane> plane;  ///< instead of axis and offset
  bool planeInSpace = false;               ///< drawn beside the surface too
  double zoom = 1;
  std::optional<Vector3> sliceTarget;

  render::OrbitCamera camera;
  double surfaceOffset = 0;
  std::optional<render::ClipPlane> clip;
  bool cracks = false;
  std::string defects = {};  ///< the mesh whose defects are marked, or "own"; empty for none
  bool surface = true;       ///< drawn
  render::ShownCells cells;
  int arrows = 0;  ///< pixels apart; 0: none

  std::string beside;  ///< file of another field, seen beside the current one in the same way; or empty

  Coloring surfaceColors{.by = render::ColorBy::normal};
  Coloring sliceColors{.by = render::ColorBy::degree};
  JumpKind worstBy = JumpKind::value;  ///< of the list of interfaces
  int worstPage = 0;

  std::array<bool, kPanels> open = {true, true, true, true, true, true, true, true};
  std::array<double, 2> scroll = {0, 0};  ///< of the left and the right column, pixels
  int width = 1280;                       ///< of the whole frame, pixels
  int height = 720;
  int samples = 1;
  Backend backend;

  bool isOpen(Panel panel) const { return open[static_cast<std::size_t>(panel)]; }
  const Coloring& colors() const { return slice ? sliceColors : surfaceColors; }
};

/// What render draws of it; sizes and samples are not set.
render::SlicePicture slicePicture(const ViewState& view, const Field& field);
render::SurfacePicture surfacePicture(const ViewState& view, const Field& field);

/// "2,4"; "all" for none.
std::string levelText(const std::vector<int>& levels);

/// Script lines, each ending in a newline, that lead from any state to this one.
std::string scriptOf(const ViewState& view);

/// By their script lines, which hold everything.
inline bool operator==(const ViewState& a, const ViewState& b) { return scriptOf(a) == scriptOf(b); }

/// `show`'s word for it.
std::string backendText(const Backend& backend);

/// A word of a script, in quotes where it needs them.
std::string scriptWord(const std::string& word);
/// The same; none in the place of an empty one.
std::string wordOrNone(const std::string& word);

}  // namespace hpsdf::app
