#pragma once
// Names of colours, directions and cell styles, as commands spell them.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/render/picture.h"

namespace hpsdf::app {

/// Names of the quantities that colours show: degree, depth, distance, ….
std::string_view colorName(render::ColorBy color);
std::vector<std::string> colorNames(std::optional<render::ColorBy> without = {});
render::ColorBy colorNamed(std::string_view name);

/// Names of a camera's directions: front, back, ….
std::vector<std::string> viewNames();
/// Turns the camera into a direction that `viewNames` contains.
void turnTo(render::OrbitCamera& camera, std::string_view view);
/// The name of the camera's direction; "" if it has none.
std::string viewName(const render::OrbitCamera& camera);

/// The names are none, lines and boxes.
render::CellStyle cellStyle(std::string_view name);
std::string cellStyleName(render::CellStyle style);

}  // namespace hpsdf::app
