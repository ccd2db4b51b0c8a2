#pragma once
// Names of what pictures show, as commands spell them.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/render/picture.h"

namespace hpsdf::app {

/// Names of colours, as commands spell them.
std::string_view colorName(render::ColorBy color);
std::vector<std::string> colorNames(std::optional<render::ColorBy> without = {});
render::ColorBy colorNamed(std::string_view name);

/// Names of directions of a camera: front, back, …
std::vector<std::string> viewNames();
/// Turns the camera. The name is one of those.
void turnTo(render::OrbitCamera& camera, std::string_view view);
/// The name of its direction; "" where it has none.
std::string viewName(const render::OrbitCamera& camera);

/// none, lines or boxes.
render::CellStyle cellStyle(std::string_view name);
std::string cellStyleName(render::CellStyle style);

}  // namespace hpsdf::app
