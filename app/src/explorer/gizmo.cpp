#include "explorer/gizmo.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "hpsdf/render/view.h"

namespace hpsdf::app {
namespace {

/// An end of an axis in the frame.
struct AxisEnd {
  int axis;
  bool positive;
  Vector3 seen;  ///< its direction to the right, up and to the viewer, each from -1 to 1
  double x, y;   ///< its middle, pixels of the frame
  double radius;

  std::string name() const { return (positive ? "" : "-") + std::string(1, "xyz"[axis]); }
  std::string path() const { return "gizmo/" + name(); }
  UiRect rect() const { return {x - radius, y - radius, x + radius, y + radius}; }
};

/// Colours that people tell apart with any colour vision; the letters say the same.
constexpr std::array kAxisColors = {IM_COL32(213, 94, 0, 255), IM_COL32(0, 158, 115, 255), IM_COL32(0, 90, 181, 255)};

/// Returns the name of the view from this end of an axis.
std::string viewFrom(const AxisEnd& end, render::UpAxis up, bool positive) {
  if (end.axis == 0) return positive ? "right" : "left";
  const bool isUp = (end.axis == 1) == (up == render::UpAxis::y);
  if (isUp) return positive ? "top" : "bottom";
  return positive == (up == render::UpAxis::y) ? "front" : "back";  // the front is at +z if y is up, and at -y if z is
}

/// Returns the distance of the gizmo's middle from two sides of the picture.
double roomOf() { return 4 * ImGui::GetFontSize(); }

ImVec2 middleOf(const UiRect& canvas) {
  return {static_cast<float>(canvas.x1 - roomOf()), static_cast<float>(canvas.y0 + roomOf())};
}

/// Returns the ends of the axes, the farthest from the viewer first, and none if there is no gizmo.
std::vector<AxisEnd> axisEnds(const ViewState& view, const UiRect& canvas) {
  const double em = ImGui::GetFontSize(), arm = 2.6 * em;
  if (view.slice || canvas.width() < 4 * roomOf() || canvas.height() < 4 * roomOf()) return {};
  const ImVec2 middle = middleOf(canvas);
  const Box unit(Vector3::Constant(-1), Vector3::Constant(1));
  const render::Camera camera = render::cameraOf(view.camera, unit, 100, 100);
  std::vector<AxisEnd> ends;
  for (const bool positive : {false, true})
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3 direction = (positive ? 1 : -1) * Vector3::Unit(axis);
      const Vector3 seen(direction.dot(camera.right.normalized()), direction.dot(camera.up.normalized()),
                         -direction.dot(camera.forward));
      ends.push_back(
          {axis, positive, seen, middle.x + arm * seen.x(), middle.y - arm * seen.y(), (positive ? 0.68 : 0.5) * em});
    }
  std::ranges::stable_sort(ends, {}, [](const AxisEnd& end) { return std::round(1e6 * end.seen.z()); });
  return ends;
}

/// Returns the end that is nearest to the viewer of those at the pointer.
const AxisEnd* endAt(const std::vector<AxisEnd>& ends, const std::array<double, 2>& pointer) {
  const auto found = std::ranges::find_if(ends.rbegin(), ends.rend(), [&](const AxisEnd& end) {
    return std::hypot(pointer[0] - end.x, pointer[1] - end.y) <= end.radius + 1;
  });
  return found == ends.rend() ? nullptr : &*found;
}

std::string viewOfClick(const AxisEnd& end, render::UpAxis up) {
  const bool isSeenAlready = end.seen.z() > 1 - 1e-9;
  return viewFrom(end, up, end.positive != isSeenAlready);
}

void drawEnd(ImDrawList& list, const ImVec2& middle, const AxisEnd& end, bool hovered) {
  const ImVec2 at(static_cast<float>(end.x), static_cast<float>(end.y));
  const auto radius = static_cast<float>(end.radius);
  const ImU32 color = kAxisColors[static_cast<std::size_t>(end.axis)];
  constexpr ImU32 kWhite = IM_COL32(255, 255, 255, 255);
  if (end.positive) {
    list.AddLine(middle, at, color, 2);
    list.AddCircleFilled(at, radius, color, 24);
    const char letter[] = {"XYZ"[end.axis], 0};
    const ImVec2 size = ImGui::CalcTextSize(letter);
    list.AddText({std::round(at.x - size.x / 2), std::round(at.y - size.y / 2)}, kWhite, letter);
  } else {
    list.AddCircleFilled(at, radius, kWhite, 24);
    list.AddCircle(at, radius, color, 24, 1.5F);
  }
  if (hovered) list.AddCircle(at, radius + 2, IM_COL32(32, 34, 44, 255), 24, 1.5F);
}

}  // namespace

void drawGizmo(Ui& ui, const ViewState& view, const UiRect& canvas, std::vector<std::string>& commands) {
  const std::vector<AxisEnd> ends = axisEnds(view, canvas);
  if (ends.empty()) return;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const AxisEnd* const hovered = ui.wantsMouse() ? nullptr : endAt(ends, ui.pointer());
  const ImVec2 middle = middleOf(canvas);
  list.AddCircleFilled(middle, 3.5F * ImGui::GetFontSize(), IM_COL32(250, 250, 248, 150), 48);
  for (const AxisEnd& end : ends) {
    const std::string name = viewOfClick(end, view.camera.up);
    const bool pressed =
        ui.addControl(end.path(), end.rect(),
                      fmt::format("Look from the {}, along the axis {}. Drag to turn.\nIn scripts: camera view={}",
                                  name, "xyz"[end.axis], name));
    if (pressed) commands.push_back("camera view=" + name);
    drawEnd(list, middle, end, &end == hovered || end.path() == ui.focus());
  }
}

std::optional<std::string> gizmoViewAt(const ViewState& view, const UiRect& canvas,
                                       const std::array<double, 2>& pointer) {
  const std::vector<AxisEnd> ends = axisEnds(view, canvas);
  const AxisEnd* const end = endAt(ends, pointer);
  return end == nullptr ? std::nullopt : std::optional(viewOfClick(*end, view.camera.up));
}

}  // namespace hpsdf::app
