#include "explorer/view_state.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "hpsdf/output/contour.h"
#include "pictures/picture_arguments.h"

namespace hpsdf::app {
namespace {

constexpr int kMaxArrows = 1000;  // greatest distance between arrows in a picture, pixels

std::string planeLine(const ViewState& view) {
  std::string line = "plane ";
  if (view.plane)
    line += fmt::format("through={},{}", coordinatesText(view.plane->point), coordinatesText(view.plane->normal));
  else
    line += fmt::format("axis={} offset={}", "xyz"[view.axis],
                        view.planeOffset ? fmt::format("{}", *view.planeOffset) : "auto");
  return line + fmt::format(" in-space={} zoom={} target={} operands={}\n", view.planeInSpace, view.zoom,
                            view.sliceTarget ? coordinatesText(*view.sliceTarget) : "center",
                            wordOrNone(view.operands));
}

std::string surfaceLine(const ViewState& view) {
  std::string line = fmt::format("surface shown={} shadows={} edges={} offset={} cracks={} defects={} clip={}",
                                 view.surface, view.shadows, view.edges, view.surfaceOffset, view.cracks,
                                 wordOrNone(view.defects), view.clip ? std::string(1, "xyz"[view.clip->axis]) : "none");
  if (view.clip) line += fmt::format(" clip-offset={}", view.clip->offset);
  return line + "\n";
}

std::string colorLine(const Coloring& colors, const char* of) {
  const render::ScaleOptions& scale = colors.scale;
  return fmt::format("color {} of={} range={} scale={} per-cell={} map={} other={} mesh={}\n", colorName(colors.by), of,
                     scale.limits ? fmt::format("{},{}", (*scale.limits)[0], (*scale.limits)[1]) : "auto",
                     scale.logarithmic ? "log" : "linear", scale.perCell, scale.map.empty() ? "auto" : scale.map,
                     wordOrNone(colors.other), wordOrNone(colors.mesh));
}

std::string cellsLine(const render::ShownCells& cells) {
  return fmt::format("cells {} degrees={} depths={} at-surface={}\n", cellStyleName(cells.style),
                     levelText(cells.degrees), levelText(cells.depths), cells.atSurface);
}

std::string panelLine(const ViewState& view) {
  std::string line = "panel";
  for (std::size_t panel = 0; panel < kPanels; ++panel)
    line += fmt::format(" {}={}", kPanelNames[panel], view.open[panel]);
  return line + fmt::format(" left-scroll={} right-scroll={}\n", view.scroll[0], view.scroll[1]);
}

int arrowsInPixels(const ViewState& view) {
  return std::min(kMaxArrows, static_cast<int>(std::lround(view.arrows * view.scale)));
}

render::Plane planeOf(const ViewState& view, const Field& field) {
  if (view.plane) return *view.plane;
  return render::AxisPlane{view.axis, view.planeOffset.value_or(defaultOffset(shownBox(field), view.axis))};
}

}  // namespace

std::string defaultContourTolerance() { return fmt::format("{}%", 100 * kDefaultContourTolerance); }

ContourChoice contourChoice(const ViewState& view, const Field& field) {
  const std::string& text = view.trianglesTolerance;
  const bool isShare = text.ends_with('%');
  const double number = parseNumber(isShare ? text.substr(0, text.size() - 1) : text).value();
  const double tolerance = isShare ? number / 100 * field.domain().sizes().maxCoeff() : number;
  return {view.surfaceOffset, tolerance, view.trianglesSimplified};
}

render::SlicePicture slicePicture(const ViewState& view, const Field& field) {
  render::SlicePicture picture;
  picture.plane = planeOf(view, field);
  picture.zoom = view.zoom;
  picture.target = view.sliceTarget;
  picture.color = view.sliceColors.by;
  picture.scale = view.sliceColors.scale;
  picture.arrows = arrowsInPixels(view);
  return picture;
}

render::SurfacePicture surfacePicture(const ViewState& view, const Field& field) {
  render::SurfacePicture picture;
  picture.camera = view.camera;
  picture.offset = view.surfaceOffset;
  picture.clip = view.clip;
  picture.cracks = view.cracks;
  picture.surface = view.surface;
  picture.shadows = view.shadows;
  picture.edges = view.edges;
  if (view.planeInSpace) picture.plane = planeOf(view, field);
  picture.cells = view.cells;
  picture.arrows = arrowsInPixels(view);
  picture.color = view.surfaceColors.by;
  picture.scale = view.surfaceColors.scale;
  return picture;
}

std::string scriptOf(const ViewState& view) {
  return fmt::format("show {} size={}x{} scale={} samples={} {}\n", view.slice ? "slice" : "surface", view.width,
                     view.height, view.scale, view.samples, backendText(view.backend)) +
         cameraLine(view.camera) + surfaceLine(view) + planeLine(view) + cellsLine(view.cells) +
         fmt::format("triangles shown={} tolerance={} simplify={}\n", view.triangles, view.trianglesTolerance,
                     view.trianglesSimplified) +
         fmt::format("arrows {}\n", view.arrows) + colorLine(view.surfaceColors, "surface") +
         colorLine(view.sliceColors, "slice") + fmt::format("beside {}\n", wordOrNone(view.beside)) +
         fmt::format("worst by={} on={} page={} mark={}\n", view.worstBy == JumpKind::value ? "value" : "gradient",
                     view.worstOnSurface ? "surface" : "all", view.worstPage + 1,
                     view.mark ? coordinatesText(*view.mark) : "none") +
         panelLine(view);
}

std::string backendText(const Backend& backend) {
  if (backend.cpu) return "cpu=true";
  return std::string("gl=") + (backend.gl == render::GlChoice::software   ? "software"
                               : backend.gl == render::GlChoice::hardware ? "hardware"
                                                                          : "auto");
}

std::string wordOrNone(const std::string& word) { return word.empty() ? "none" : scriptWord(word); }

std::string scriptWord(const std::string& word) {
  if (!word.empty() && word.find_first_of(" \t\r;#=$\"\\") == std::string::npos) return word;
  std::string quoted = "\"";
  for (const char c : word) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (c == '$') quoted += '$';
    quoted += c;
  }
  return quoted + "\"";
}

}  // namespace hpsdf::app
