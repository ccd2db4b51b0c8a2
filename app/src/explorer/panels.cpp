// What stands around the picture. Each control shows part of the state and asks for a command; it changes nothing
// itself.

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "explorer/explorer.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/field.h"
#include "pictures/picture_arguments.h"
#include "pictures/picture_names.h"
#include "session/field_summary.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::size_t kWorstRows = 8;

using Commands = std::vector<std::string>;

std::string number(double value) { return fmt::format("{:.6g}", value); }

ImU32 packed(const render::Color& c) { return IM_COL32(c[0], c[1], c[2], 255); }

ImVec2 cursor() { return ImGui::GetCursorScreenPos(); }
float widthLeft() { return ImGui::GetContentRegionAvail().x; }

void textAt(float x, float y, const std::string& text, ImU32 color) {
  ImGui::GetWindowDrawList()->AddText({std::round(x), std::round(y)}, color, text.c_str());
}

float widthOf(const std::string& text) { return ImGui::CalcTextSize(text.c_str()).x; }

/// Without its folders, for which there is no room.
std::string fileName(const std::string& path) { return std::filesystem::path(path).filename().string(); }

/// A panel with its heading, where it is open.
template <typename Content>
void section(Ui& ui, const ViewState& view, Panel panel, const char* title, Commands& commands,
             const Content& content) {
  if (!view.isOpen(panel)) return;
  const std::string name = kPanelNames[static_cast<std::size_t>(panel)];
  if (ui.heading(name + "/close", title)) commands.push_back("panel " + name + "=false");
  content();
}

void drawBar(Ui& ui, const Explorer& explorer, Commands& commands) {
  const ViewState& view = explorer.view();
  const auto nextTo = [](float space = 6) { ImGui::SameLine(0, space); };
  if (ui.button("bar/surface", "surface", !view.slice)) commands.push_back("show surface");
  nextTo(2);
  if (ui.button("bar/slice", "slice", view.slice)) commands.push_back("show slice");
  nextTo(24);
  for (std::size_t panel = 1; panel < kPanels; ++panel) {  // not the bar itself
    const char* name = kPanelNames[panel];
    if (ui.button(fmt::format("bar/{}", name), name, view.open[panel]))
      commands.push_back(fmt::format("panel {}={}", name, !view.open[panel]));
    nextTo(panel + 1 < kPanels ? 2 : 24);
  }
  ui.enable(explorer.canUndo());
  if (ui.button("bar/undo", "undo")) commands.push_back("undo");
  nextTo(2);
  ui.enable(explorer.canRedo());
  if (ui.button("bar/redo", "redo")) commands.push_back("redo");
  ui.enable(true);
  nextTo(24);
  if (ui.button("bar/copy-view", "copy view")) commands.push_back("copy-view");
}

/// A list of names that runs a command with the one chosen.
void choice(Ui& ui, const std::string& path, const char* label, const std::vector<std::string>& names,
            const std::string& current, const std::string& command, Commands& commands) {
  const auto found = std::ranges::find(names, current);
  const int at = found == names.end() ? 0 : static_cast<int>(found - names.begin());
  if (const auto chosen = ui.combo(path, label, names, at)) commands.push_back(command + names[std::size_t(*chosen)]);
}

void drawCamera(Ui& ui, const ViewState& view, const Field& field, Commands& commands) {
  const render::OrbitCamera& c = view.camera;
  std::vector<std::string> directions = viewNames();
  directions.insert(directions.begin(), "any");
  choice(ui, "view/direction", "direction", directions, viewName(c), "camera view=", commands);
  const auto camera = [&](double azimuth, double elevation, double distance) {
    commands.push_back(fmt::format("camera {},{},{}", number(azimuth), number(elevation), number(distance)));
  };
  if (const auto v = ui.slider("view/azimuth", "azimuth", std::remainder(c.azimuthDegrees, 360), -180, 180, "%.1f°"))
    camera(*v, c.elevationDegrees, c.distance);
  if (const auto v = ui.slider("view/elevation", "elevation", c.elevationDegrees, -90, 90, "%.1f°"))
    camera(c.azimuthDegrees, *v, c.distance);
  if (const auto v = ui.slider("view/distance", "distance", c.distance, 0.05, 3, "%.3g"))
    camera(c.azimuthDegrees, c.elevationDegrees, *v);
  choice(ui, "view/projection", "projection", {"perspective", "orthographic"},
         c.projection == render::Projection::perspective ? "perspective" : "orthographic",
         "camera projection=", commands);
  choice(ui, "view/up", "up", {"y", "z"}, c.up == render::UpAxis::y ? "y" : "z", "camera up=", commands);
  ui.enable(c.target.has_value());
  if (ui.button("view/center", "back to the center")) commands.push_back("camera target=center");
  ui.enable(true);
  const double span = 0.15 * field.domain().diagonal().norm();
  if (const auto v = ui.slider("view/offset", "offset", view.surfaceOffset, -span, span))
    commands.push_back("surface offset=" + number(*v));
  if (const auto on = ui.checkbox("view/cracks", "mark cracks", view.cracks))
    commands.push_back(fmt::format("surface cracks={}", *on));
  choice(ui, "view/clip", "cut across", {"none", "x", "y", "z"},
         view.clip ? std::string(1, "xyz"[view.clip->axis]) : "none", "surface clip=", commands);
  if (!view.clip) return;
  const Box& domain = field.domain();
  if (const auto v = ui.slider("view/clip-offset", "cut at", view.clip->offset, domain.min()[view.clip->axis],
                               domain.max()[view.clip->axis]))
    commands.push_back("surface clip-offset=" + number(*v));
}

void drawPlaneOffset(Ui& ui, const ViewState& view, const Field& field, Commands& commands) {
  choice(ui, "view/axis", "plane across", {"x", "y", "z"}, std::string(1, "xyz"[view.axis]), "plane axis=", commands);
  const Box& domain = field.domain();
  if (const auto v =
          ui.slider("view/plane-offset", "plane at", view.planeOffset.value_or(defaultOffset(domain, view.axis)),
                    domain.min()[view.axis], domain.max()[view.axis]))
    commands.push_back("plane offset=" + number(*v));
}

void drawPlane(Ui& ui, const ViewState& view, const Field& field, Commands& commands) {
  drawPlaneOffset(ui, view, field, commands);
  if (const auto v = ui.slider("view/zoom", "zoom", view.zoom, 1, 32, "%.3g"))
    commands.push_back("plane zoom=" + number(*v));
  ui.enable(view.sliceTarget || view.zoom != 1);
  if (ui.button("view/whole", "whole section")) commands.push_back("plane zoom=1 target=center");
  ui.enable(true);
}

/// What else stands in the surface's picture.
void drawCells(Ui& ui, const ViewState& view, const Field& field, Commands& commands) {
  if (const auto on = ui.checkbox("view/surface", "surface", view.surface))
    commands.push_back(fmt::format("surface shown={}", *on));
  ImGui::SameLine();
  if (const auto on = ui.checkbox("view/plane", "plane", view.planeInSpace))
    commands.push_back(fmt::format("plane in-space={}", *on));
  if (view.planeInSpace) drawPlaneOffset(ui, view, field, commands);
  choice(ui, "view/cells", "cells", {"none", "lines", "boxes"}, cellStyleName(view.cells.style), "cells ", commands);
  if (view.cells.style == render::CellStyle::none) return;
  if (const auto list = ui.field("view/degrees", "of degrees", levelText(view.cells.degrees)))
    commands.push_back("cells degrees=" + scriptWord(*list));
  if (const auto list = ui.field("view/depths", "of depths", levelText(view.cells.depths)))
    commands.push_back("cells depths=" + scriptWord(*list));
}

void drawColors(Ui& ui, const ViewState& view, const std::optional<render::Drawn>& picture, Commands& commands) {
  const Coloring& colors = view.colors();
  const render::ColorBy without = view.slice ? render::ColorBy::normal : render::ColorBy::distance;
  choice(ui, "view/color", "color", colorNames(without), std::string(colorName(colors.by)), "color ", commands);
  const auto change = [&](const std::string& what) {
    commands.push_back(fmt::format("color {} {}", colorName(colors.by), what));
  };
  if (colors.by == render::ColorBy::difference)
    if (const auto file = ui.field("view/other", "other field", colors.other)) change("other=" + wordOrNone(*file));
  if (colors.by == render::ColorBy::error)
    if (const auto mesh = ui.field("view/mesh", "made from", colors.mesh)) change("mesh=" + wordOrNone(*mesh));
  if (!render::isQuantity(colors.by)) return;
  choice(ui, "view/scale", "scale", {"log", "linear"}, colors.scale.logarithmic ? "log" : "linear",
         fmt::format("color {} scale=", colorName(colors.by)), commands);
  const auto range = [&](const std::string& low, const std::string& high) {
    change("range=" + scriptWord(low + "," + high));
  };
  if (const auto pinned = ui.checkbox("view/pinned", "pinned range", colors.scale.limits.has_value())) {
    if (!*pinned)
      change("range=auto");
    else if (picture && picture->scale.limits)
      range(fmt::format("{}", (*picture->scale.limits)[0]), fmt::format("{}", (*picture->scale.limits)[1]));
  }
  if (!colors.scale.limits) return;
  const auto [low, high] = *colors.scale.limits;
  if (const auto text = ui.field("view/low", "from", shortNumber(low))) range(*text, fmt::format("{}", high));
  if (const auto text = ui.field("view/high", "to", shortNumber(high))) range(fmt::format("{}", low), *text);
}

/// Which half of the picture shows which field.
void drawNames(const Explorer& explorer, const Layout& layout) {
  if (layout.beside.width() <= 0) return;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const auto name = [&](const UiRect& rect, const std::string& text) {
    const float x = float(rect.x0) + 8, y = float(rect.y0) + 6;
    list.AddRectFilled({x - 4, y - 2}, {x + widthOf(text) + 4, y + ImGui::GetTextLineHeight() + 2},
                       IM_COL32(250, 250, 248, 255), 2);
    list.AddText({x, y}, IM_COL32(32, 34, 44, 255), text.c_str());
  };
  name(layout.canvas, fileName(explorer.session().current().name));
  name(layout.beside, fileName(explorer.view().beside));
  list.AddLine({float(layout.beside.x0), float(layout.beside.y0)}, {float(layout.beside.x0), float(layout.beside.y1)},
               IM_COL32(98, 102, 116, 255));
}

void drawView(Ui& ui, Explorer& explorer, Commands& commands) {
  const ViewState& view = explorer.view();
  const Field& field = explorer.session().current().field;
  if (view.slice) {
    drawPlane(ui, view, field, commands);
  } else {
    drawCamera(ui, view, field, commands);
    drawCells(ui, view, field, commands);
  }
  if (const auto v = ui.slider("view/arrows", "arrows", view.arrows, 0, 120, "%.0f"))
    commands.push_back(fmt::format("arrows {:.0f}", *v));
  drawColors(ui, view, explorer.picture(), commands);
  if (const auto file = ui.field("view/beside", "beside", view.beside))
    commands.push_back("beside " + wordOrNone(*file));
}

void drawBuild(Ui& ui, Explorer& explorer, Commands& commands) {
  const Field& current = explorer.session().current().field;
  const FieldMetadata& made = current.metadata();
  const auto& grid = current.grid();
  const auto setting = [&](const char* name, const std::string& standard) {
    const auto found = explorer.settings().find(name);
    return found == explorer.settings().end() ? standard : found->second;
  };
  const auto field = [&](const char* name, const std::string& standard) {
    if (const auto text = ui.field(fmt::format("build/{}", name), name, setting(name, standard)))
      commands.push_back(fmt::format("settings {}={}", name, scriptWord(*text)));
  };
  const auto slider = [&](const char* name, double standard, double low, double high, const char* format) {
    const double value = parseNumber(setting(name, number(standard))).value_or(standard);
    if (const auto v = ui.slider(fmt::format("build/{}", name), name, value, low, high, format))
      commands.push_back(fmt::format("settings {}={}", name, number(*v)));
  };
  field("mesh", explorer.session().current().madeFrom());
  field("target-error", shortNumber(made.targetError));
  field("grid", fmt::format("{},{},{}", grid[0], grid[1], grid[2]));
  slider("nearness", made.nearness, 0, 8, "%.1f");
  slider("max-degree", made.maxDegree, 1, kMaxDegree, "%.0f");
  slider("max-depth", made.maxDepth, 0, kMaxDepth, "%.0f");
  const auto oneOf = [&](const char* name, const std::vector<std::string>& names, const std::string& standard) {
    choice(ui, fmt::format("build/{}", name), name, names, setting(name, standard), fmt::format("settings {}=", name),
           commands);
  };
  oneOf("strategy", {"hp", "h1", "h2"}, strategyName(made.strategy));
  oneOf("criterion", {"paper", "optimal"}, criterionName(made.criterion));
  oneOf("estimator", {"embedded", "residual"}, estimatorName(made.estimator));
  const std::string continuity = setting("continuity", continuityName(current));
  oneOf("continuity", {"none", "weak", "exact", "both"}, continuity);
  if (continuity == "weak" || continuity == "both")
    field("continuity-weight",
          shortNumber(made.continuityWeight > 0 ? made.continuityWeight : WeakContinuity{}.weight));
  if (continuity == "exact" || continuity == "both") {
    const double width = current.data().blend;
    slider("blend-width", width > 0 ? width : kDefaultBlend, 0.01, kMaxBlend, "%.3f");
  }
  const bool bounds = setting("bounds", current.data().bounds.empty() ? "false" : "true") == "true";
  if (const auto on = ui.checkbox("build/bounds", "bounds", bounds))
    commands.push_back(fmt::format("settings bounds={}", *on));
  if (explorer.work) {
    ui.progress("build/progress", explorer.work->task, explorer.work->fraction);
    if (!explorer.work->cancellable) return;
    ui.freeze(false);
    ui.enable(true);
    if (ui.button("build/cancel", "cancel")) explorer.cancelWanted = true;
    ui.freeze(true);
    ui.enable(true);
    return;
  }
  if (const auto all = explorer.allSteps()) {
    const auto steps = double(made.steps.value_or(*all));
    if (const auto v = ui.slider("build/steps", "steps", steps, 0, double(*all), "%.0f", When::released))
      commands.push_back(fmt::format("rebuild max-steps={:.0f}", *v));
  }
  ui.enable(!setting("mesh", explorer.session().current().madeFrom()).empty());
  if (ui.button("build/rebuild", "rebuild")) commands.push_back("rebuild");
  ui.enable(true);
}

void drawLevelSwatches(const std::vector<render::Legend::Level>& levels) {
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 from = cursor();
  const float width = widthLeft() / float(std::max<std::size_t>(levels.size(), 1)), height = 20;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const float x0 = std::round(from.x + width * float(i)), x1 = std::round(from.x + width * float(i + 1));
    list.AddRectFilled({x0, from.y}, {x1, from.y + height}, packed(levels[i].color));
    const std::string label = std::to_string(levels[i].level);
    const bool dark = 2 * levels[i].color[0] + 5 * levels[i].color[1] + levels[i].color[2] < 4 * 255;
    if (widthOf(label) + 2 <= x1 - x0)
      textAt((x0 + x1 - widthOf(label)) / 2, from.y + 3, label, dark ? IM_COL32_WHITE : IM_COL32(20, 20, 30, 255));
  }
  ImGui::Dummy({widthLeft(), height});
}

void drawColorBar(const render::Legend& legend) {
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 from = cursor();
  const float inset = 12, width = widthLeft() - 2 * inset, height = 16;
  for (int x = 0; x < int(width); ++x) {
    const auto& color = legend.bar[std::size_t(x) * (legend.bar.size() - 1) / std::size_t(width)];
    list.AddRectFilled({from.x + inset + float(x), from.y}, {from.x + inset + float(x) + 1, from.y + height},
                       packed(color));
  }
  float free = from.x;
  for (const auto& mark : legend.marks) {
    const float x = std::round(from.x + inset + float(mark.place) * (width - 1));
    list.AddRectFilled({x, from.y + height}, {x + 1, from.y + height + 4}, IM_COL32(60, 64, 78, 255));
    const float half = widthOf(mark.text) / 2, right = from.x + widthLeft();
    const float left = std::clamp(x - half, from.x, right - 2 * half);
    if (left < free) continue;
    textAt(left, from.y + height + 4, mark.text, IM_COL32(32, 34, 44, 255));
    free = left + 2 * half + 6;
  }
  ImGui::Dummy({widthLeft(), height + 20});
}

void drawDefectSwatches(const std::vector<render::Legend::Defects>& defects) {
  constexpr float kRow = 18, kSide = 10;
  for (const auto& [name, count, color] : defects) {
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImVec2 from = cursor();
    list.AddRectFilled(from, {from.x + kSide, from.y + kSide}, IM_COL32(60, 64, 78, 255));
    list.AddRectFilled({from.x + 1, from.y + 1}, {from.x + kSide - 1, from.y + kSide - 1}, packed(color));
    textAt(from.x + kSide + 8, from.y - 2, name + ": " + count, IM_COL32(32, 34, 44, 255));
    ImGui::Dummy({widthLeft(), kRow});
  }
}

void drawLegend(Ui& ui, const std::optional<render::Drawn>& picture) {
  if (!picture) return;
  const render::Legend& legend = picture->legend;
  drawDefectSwatches(legend.defects);
  if (legend.title.empty()) {
    if (legend.defects.empty()) ui.text("light only: choose a color", true);
    return;
  }
  ui.text(legend.title);
  if (!legend.levels.empty()) drawLevelSwatches(legend.levels);
  if (!legend.bar.empty()) drawColorBar(legend);
}

/// Shares of the volume as columns, in the legend's colours where it is theirs.
void drawHistogram(Ui& ui, const char* title, const std::map<int, double>& shares, const render::Legend* legend) {
  ui.text(title);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 from = cursor();
  const float height = 36, line = ImGui::GetTextLineHeight();
  const float width = std::min(44.0F, widthLeft() / float(std::max<std::size_t>(shares.size(), 1)));
  double greatest = 0;
  for (const auto& [level, share] : shares) greatest = std::max(greatest, share);
  float x = from.x;
  for (const auto& [level, share] : shares) {
    const float bar = std::max(1.0F, std::round(height * float(share / greatest)));
    const float bottom = from.y + line + height;
    ImU32 color = IM_COL32(115, 148, 199, 255);
    if (legend != nullptr)
      for (const auto& known : legend->levels)
        if (known.level == level) color = packed(known.color);
    list.AddRectFilled({std::round(x) + 2, bottom - bar}, {std::round(x + width) - 2, bottom}, color);
    const auto centred = [&](const std::string& text, float y, ImU32 ink) {
      if (widthOf(text) <= width) textAt(x + (width - widthOf(text)) / 2, y, text, ink);
    };
    const double percent = 100 * share;
    centred(percent < 0.1    ? "<.1"
            : percent < 9.95 ? fmt::format("{:.1f}", percent)
                             : fmt::format("{:.0f}", percent),
            bottom - bar - line, IM_COL32(98, 102, 116, 255));
    centred(std::to_string(level), bottom + 2, IM_COL32(32, 34, 44, 255));
    x += width;
  }
  ImGui::Dummy({widthLeft(), height + 2 * line + 2});
}

void drawHistograms(Ui& ui, Explorer& explorer) {
  const FieldStatistics& figures = explorer.figures();
  const auto& picture = explorer.picture();
  const auto legendOf = [&](render::ColorBy color) {
    return picture && explorer.view().colors().by == color ? &picture->legend : nullptr;
  };
  drawHistogram(ui, "degrees, % of the volume", figures.degreeVolume, legendOf(render::ColorBy::degree));
  drawHistogram(ui, "depths, % of the volume", figures.depthVolume, legendOf(render::ColorBy::depth));
}

void drawStatistics(Ui& ui, Explorer& explorer) {
  const FieldStatistics& figures = explorer.figures();
  const Field& field = explorer.session().current().field;
  std::vector<std::pair<std::string, std::string>> rows = {
      {"cells", grouped(figures.leaves)},
      {"coefficients", grouped(figures.coefficients)},
      {"memory", bytesText(double(figures.bytes))},
      {"target error", shortNumber(field.metadata().targetError)},
      {"RMS estimate", shortNumber(field.metadata().rmsEstimate(field.domain()))},
  };
  if (explorer.session().knowsJumps()) {
    const Jumps& jumps = explorer.session().jumps();
    rows.emplace_back("jump of f, RMS", shortNumber(jumps.value.rms));
    rows.emplace_back("jump of gradient, RMS", shortNumber(jumps.gradient.rms));
  }
  ui.facts(rows);
}

void drawWorst(Ui& ui, Explorer& explorer, Commands& commands) {
  if (!explorer.session().knowsJumps()) return;  // being measured
  const ViewState& view = explorer.view();
  const Jumps& jumps = explorer.session().jumps();
  choice(ui, "worst/by", "jump of", {"value", "gradient"}, view.worstBy == JumpKind::value ? "value" : "gradient",
         "worst by=", commands);
  const std::size_t first = std::size_t(view.worstPage) * kWorstRows;
  const auto& worst = explorer.worst(first + kWorstRows);
  const std::size_t last = std::min(worst.size(), first + kWorstRows);
  for (std::size_t rank = first; rank < last; ++rank) {
    const Interface& face = jumps.interfaces[worst[rank]];
    const Vector3& x = face.worst;
    const std::array cells = {fmt::format("{}. {}", rank + 1, shortNumber(jumpOf(face, view.worstBy).max)),
                              fmt::format("({:.2f}, {:.2f}, {:.2f})", x.x(), x.y(), x.z())};
    if (ui.row(fmt::format("worst/{}", rank - first + 1), cells, 90))
      commands.push_back(fmt::format("fly {}", rank + 1));
  }
  ui.enable(view.worstPage > 0);
  if (ui.button("worst/previous", "previous")) commands.push_back(fmt::format("worst page={}", view.worstPage));
  ImGui::SameLine();
  ui.enable(last < jumps.interfaces.size());
  if (ui.button("worst/next", "next")) commands.push_back(fmt::format("worst page={}", view.worstPage + 2));
  ui.enable(true);
}

void drawReadout(Ui& ui, Explorer& explorer) {
  if (const auto& work = explorer.work) {
    ui.text(fmt::format("{} {:.0f} %", work->task, std::floor(100 * work->fraction)));
    if (work->cancellable) ui.text("Escape: cancel", true);
    return;
  }
  if (!explorer.message.empty()) {
    ImGui::PushTextWrapPos(0);
    ui.text(explorer.message);
    ImGui::PopTextWrapPos();
    return;
  }
  if (const auto readout = explorer.readout()) {
    for (const std::string& line : readoutText(*readout)) ui.text(line);
    return;
  }
  if (!explorer.picture()) return;
  std::string line;
  for (const std::string& detail : explorer.picture()->details) line += (line.empty() ? "" : "   ") + detail;
  ui.text(fileName(explorer.session().current().name) + "   " + line);
  ui.text("drag: turn or move   right drag: move   wheel: nearer or farther   hover: what is there", true);
}

}  // namespace

void drawPanels(Ui& ui, Explorer& explorer, Commands& commands) {
  const ViewState& view = explorer.view();
  const Layout layout = layoutOf(view);
  ui.freeze(explorer.work.has_value());
  const auto scrolling = [&](const char* name, const UiRect& rect, double scroll, const auto& content) {
    if (rect.width() <= 0) return;
    const double now = ui.column(name, rect, scroll, content);
    if (std::abs(now - scroll) > 0.5) commands.push_back(fmt::format("panel {}-scroll={}", name, now));
  };
  if (layout.bar.width() > 0) ui.column("bar", layout.bar, {}, [&] { drawBar(ui, explorer, commands); });
  scrolling("left", layout.left, view.scroll[0], [&] {
    section(ui, view, Panel::view, view.slice ? "Slice" : "Surface", commands,
            [&] { drawView(ui, explorer, commands); });
    section(ui, view, Panel::build, "Construction", commands, [&] { drawBuild(ui, explorer, commands); });
  });
  scrolling("right", layout.right, view.scroll[1], [&] {
    section(ui, view, Panel::legend, "Legend", commands, [&] { drawLegend(ui, explorer.picture()); });
    section(ui, view, Panel::histograms, "Histograms", commands, [&] { drawHistograms(ui, explorer); });
    section(ui, view, Panel::statistics, "Statistics", commands, [&] { drawStatistics(ui, explorer); });
    section(ui, view, Panel::worst, "Worst interfaces", commands, [&] { drawWorst(ui, explorer, commands); });
  });
  if (layout.readout.width() > 0) ui.column("readout", layout.readout, {}, [&] { drawReadout(ui, explorer); });
  drawNames(explorer, layout);
  ui.place("canvas", layout.canvas);
  if (layout.beside.width() > 0) ui.place("beside", layout.beside);
}

}  // namespace hpsdf::app
