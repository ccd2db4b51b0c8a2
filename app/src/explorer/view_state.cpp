#include "explorer/view_state.h"

#include <fmt/format.h>

#include "pictures.h"

namespace hpsdf::app {
namespace {

// {} of a double is the shortest text that reads as the same number
std::string textOf(const Vector3& v) { return fmt::format("{},{},{}", v.x(), v.y(), v.z()); }

std::string planeLine(const ViewState& view) {
  std::string line = "plane ";
  if (view.plane)
    line += fmt::format("through={},{}", textOf(view.plane->point), textOf(view.plane->normal));
  else
    line += fmt::format("axis={} offset={}", "xyz"[view.axis],
                        view.planeOffset ? fmt::format("{}", *view.planeOffset) : "auto");
  return line + fmt::format(" zoom={} target={}\n", view.zoom, view.sliceTarget ? textOf(*view.sliceTarget) : "center");
}

std::string cameraLine(const render::OrbitCamera& camera) {
  return fmt::format("camera {},{},{} target={} up={} projection={}\n", camera.azimuthDegrees, camera.elevationDegrees,
                     camera.distance, camera.target ? textOf(*camera.target) : "center",
                     camera.up == render::UpAxis::y ? "y" : "z",
                     camera.projection == render::Projection::perspective ? "perspective" : "orthographic");
}

std::string surfaceLine(const ViewState& view) {
  std::string line = fmt::format("surface offset={} cracks={} clip={}", view.surfaceOffset, view.cracks,
                                 view.clip ? std::string(1, "xyz"[view.clip->axis]) : "none");
  if (view.clip) line += fmt::format(" clip-offset={}", view.clip->offset);
  return line + "\n";
}

std::string colorLine(const Coloring& colors, const char* of) {
  const render::ScaleOptions& scale = colors.scale;
  return fmt::format("color {} of={} range={} scale={}{}{}\n", colorName(colors.by), of,
                     scale.limits ? fmt::format("{},{}", (*scale.limits)[0], (*scale.limits)[1]) : "auto",
                     scale.logarithmic ? "log" : "linear",
                     colors.other.empty() ? "" : " other=" + scriptWord(colors.other),
                     colors.mesh.empty() ? "" : " mesh=" + scriptWord(colors.mesh));
}

std::string backendText(const Backend& backend) {
  if (backend.cpu) return "cpu=true";
  return std::string("gl=") + (backend.gl == render::GlChoice::software   ? "software"
                               : backend.gl == render::GlChoice::hardware ? "hardware"
                                                                          : "auto");
}

std::string panelLine(const ViewState& view) {
  std::string line = "panel";
  for (std::size_t panel = 0; panel < kPanels; ++panel)
    line += fmt::format(" {}={}", kPanelNames[panel], view.open[panel]);
  return line + fmt::format(" left-scroll={} right-scroll={}\n", view.scroll[0], view.scroll[1]);
}

}  // namespace

render::SlicePicture slicePicture(const ViewState& view, const Field& field) {
  render::SlicePicture picture;
  if (view.plane)
    picture.plane = *view.plane;
  else
    picture.plane = render::AxisPlane{view.axis, view.planeOffset.value_or(defaultOffset(field.domain(), view.axis))};
  picture.zoom = view.zoom;
  picture.target = view.sliceTarget;
  picture.color = view.sliceColors.by;
  picture.scale = view.sliceColors.scale;
  return picture;
}

render::SurfacePicture surfacePicture(const ViewState& view) {
  render::SurfacePicture picture;
  picture.camera = view.camera;
  picture.offset = view.surfaceOffset;
  picture.clip = view.clip;
  picture.cracks = view.cracks;
  picture.color = view.surfaceColors.by;
  picture.scale = view.surfaceColors.scale;
  return picture;
}

std::string scriptOf(const ViewState& view) {
  return fmt::format("show {} size={}x{} samples={} {}\n", view.slice ? "slice" : "surface", view.width, view.height,
                     view.samples, backendText(view.backend)) +
         cameraLine(view.camera) + surfaceLine(view) + planeLine(view) + colorLine(view.surfaceColors, "surface") +
         colorLine(view.sliceColors, "slice") +
         fmt::format("worst by={} page={}\n", view.worstBy == JumpKind::value ? "value" : "gradient",
                     view.worstPage + 1) +
         panelLine(view);
}

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
