#pragma once
// The panels of the left column: settings of the view and of the construction.

#include "explorer/explorer.h"
#include "explorer/panel_controls.h"

namespace hpsdf::app {

/// Draws the controls of the camera or the plane, of the cells and of the colours.
void drawViewPanel(const Controls& controls, Explorer& explorer);

/// Draws the parameters of the next construction, its progress while it runs, and the button that starts it.
void drawBuildPanel(const Controls& controls, Explorer& explorer);

}  // namespace hpsdf::app
