#include "pictures/picture_names.h"

#include <algorithm>
#include <utility>

namespace hpsdf::app {

namespace {

using render::ColorBy;
constexpr std::pair<std::string_view, ColorBy> kColors[] = {
    {"normal", ColorBy::normal},       {"degree", ColorBy::degree},        {"depth", ColorBy::depth},
    {"distance", ColorBy::distance},   {"value-jump", ColorBy::valueJump}, {"gradient-jump", ColorBy::gradientJump},
    {"slope", ColorBy::slope},         {"error", ColorBy::error},          {"difference", ColorBy::difference},
    {"cell-error", ColorBy::cellError}};

struct NamedView {
  std::string_view name;
  double azimuthDegrees, elevationDegrees;
};
constexpr NamedView kViews[] = {{"front", 0, 0},
                                {"back", 180, 0},
                                {"left", -90, 0},
                                {"right", 90, 0},
                                {"top", 0, 90},
                                {"bottom", 0, -90},
                                {"corner", 45, 35.264389682754654}};

}  // namespace

std::vector<std::string> viewNames() {
  std::vector<std::string> names;
  for (const NamedView& view : kViews) names.emplace_back(view.name);
  return names;
}

void turnTo(render::OrbitCamera& camera, std::string_view view) {
  const NamedView& named = *std::ranges::find(kViews, view, &NamedView::name);
  camera.azimuthDegrees = named.azimuthDegrees;
  camera.elevationDegrees = named.elevationDegrees;
}

std::string viewName(const render::OrbitCamera& camera) {
  for (const NamedView& view : kViews)
    if (view.azimuthDegrees == camera.azimuthDegrees && view.elevationDegrees == camera.elevationDegrees)
      return std::string(view.name);
  return {};
}

std::vector<std::string> colorNames(std::optional<ColorBy> without) {
  std::vector<std::string> names;
  for (const auto& [name, color] : kColors)
    if (color != without) names.emplace_back(name);
  return names;
}

std::string_view colorName(ColorBy color) {
  return std::ranges::find(kColors, color, [](auto& c) { return c.second; })->first;
}

/// The registry accepts only the names above, so that one is always found.
ColorBy colorNamed(std::string_view name) {
  return std::ranges::find(kColors, name, [](auto& c) { return c.first; })->second;
}

render::CellStyle cellStyle(std::string_view name) {
  return name == "lines"   ? render::CellStyle::lines
         : name == "boxes" ? render::CellStyle::boxes
                           : render::CellStyle::none;
}

std::string cellStyleName(render::CellStyle style) {
  return style == render::CellStyle::lines ? "lines" : style == render::CellStyle::boxes ? "boxes" : "none";
}

}  // namespace hpsdf::app
