#pragma once
// The panels of the right column: the colours' key and figures of the whole field.

#include "explorer/explorer.h"
#include "explorer/panel_controls.h"

namespace hpsdf::app {

/// Draws the key to the colours of the present picture.
void drawLegend(Ui& ui, const std::optional<render::Drawn>& picture);

/// Draws the shares of the domain's volume by degree and by depth.
void drawHistograms(Ui& ui, Explorer& explorer);

void drawStatistics(Ui& ui, Explorer& explorer);

/// Draws one page of the list of interfaces with the greatest jumps, and the buttons that turn the page.
void drawWorst(const Controls& controls, Explorer& explorer);

}  // namespace hpsdf::app
