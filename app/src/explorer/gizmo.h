#pragma once
// The gizmo in the corner of the picture of a surface: the three axes as the camera sees them. A click on the end of an
// axis looks along it.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "explorer/view_state.h"
#include "widgets/ui.h"

namespace hpsdf::app {

/// Draws the gizmo into the picture `canvas`, unless this is a slice or has no room for it, and registers the ends of
/// its axes as controls, such as "gizmo/-x". If the keyboard presses one of them, appends the line of script that looks
/// along it.
void drawGizmo(Ui& ui, const ViewState& view, const UiRect& canvas, std::vector<std::string>& commands);

/// Returns the name of the view that a click of the pointer on the gizmo asks for, such as "right", or std::nullopt if
/// the pointer is not over an end of an axis. A click on the end that points to the viewer asks for the opposite view.
std::optional<std::string> gizmoViewAt(const ViewState& view, const UiRect& canvas,
                                       const std::array<double, 2>& pointer);

}  // namespace hpsdf::app
