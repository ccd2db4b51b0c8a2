// The panels around the explorer's picture.

#include "explorer/panels.h"

namespace hpsdf::app {
namespace {

/// Draws a panel if it is open: its heading with a button that closes the panel, and its content.
template <typename Content>
void section(const Controls& controls, const ViewState& view, Panel panel, const char* title, const Content& content) {
  if (!view.isOpen(panel)) return;
  const std::string name = kPanelNames[static_cast<std::size_t>(panel)];
  if (controls.ui.heading(name + "/close", title)) controls.commands.push_back("panel " + name + "=false");
  content();
}

void drawBar(const Controls& controls, const Explorer& explorer) {
  Ui& ui = controls.ui;
  std::vector<std::string>& commands = controls.commands;
  const ViewState& view = explorer.view();
  const auto nextTo = [](float space) { ImGui::SameLine(0, space); };
  if (ui.button("bar/surface", "surface", !view.slice)) commands.push_back("show surface");
  nextTo(2);
  if (ui.button("bar/slice", "slice", view.slice)) commands.push_back("show slice");
  nextTo(24);
  for (std::size_t panel = 1; panel < kPanels; ++panel) {  // panel 0 is the bar itself, which needs no button
    const char* name = kPanelNames[panel];
    if (ui.button(fmt::format("bar/{}", name), name, view.open[panel]))
      commands.push_back(fmt::format("panel {}={}", name, !view.open[panel]));
    nextTo(panel + 1 < kPanels ? 2 : 24);
  }
  controls.button("bar/undo", "undo", "undo", explorer.canUndo());
  nextTo(2);
  controls.button("bar/redo", "redo", "redo", explorer.canRedo());
  nextTo(24);
  controls.button("bar/copy-view", "copy view", "copy-view");
}

/// Draws a line between the two halves of the picture, and the name of a field into each half.
void drawFieldNames(const Explorer& explorer, const Layout& layout) {
  if (layout.beside.width() <= 0) return;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const auto name = [&](const UiRect& rect, const std::string& text) {
    const float x = float(rect.x0) + 8, y = float(rect.y0) + 6;
    list.AddRectFilled({x - 4, y - 2}, {x + widthOf(text) + 4, y + ImGui::GetTextLineHeight() + 2},
                       IM_COL32(250, 250, 248, 255), 2);
    list.AddText({x, y}, kInk, text.c_str());
  };
  name(layout.canvas, fileName(explorer.session().current().name));
  name(layout.beside, fileName(explorer.view().beside));
  list.AddLine({float(layout.beside.x0), float(layout.beside.y0)}, {float(layout.beside.x0), float(layout.beside.y1)},
               kSoftInk);
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

void drawPanels(Ui& ui, Explorer& explorer, std::vector<std::string>& commands) {
  const Controls controls{ui, commands};
  const ViewState& view = explorer.view();
  const Layout layout = layoutOf(view);
  ui.freeze(explorer.work.has_value());
  const auto scrolling = [&](const char* name, const UiRect& rect, double scroll, const auto& content) {
    if (rect.width() <= 0) return;
    const double now = ui.column(name, rect, scroll, content);
    if (std::abs(now - scroll) > 0.5) commands.push_back(fmt::format("panel {}-scroll={}", name, now));
  };
  if (layout.bar.width() > 0) ui.column("bar", layout.bar, {}, [&] { drawBar(controls, explorer); });
  scrolling("left", layout.left, view.scroll[0], [&] {
    section(controls, view, Panel::view, view.slice ? "Slice" : "Surface", [&] { drawViewPanel(controls, explorer); });
    section(controls, view, Panel::build, "Construction", [&] { drawBuildPanel(controls, explorer); });
  });
  scrolling("right", layout.right, view.scroll[1], [&] {
    section(controls, view, Panel::legend, "Legend", [&] { drawLegend(ui, explorer.picture()); });
    section(controls, view, Panel::histograms, "Histograms", [&] { drawHistograms(ui, explorer); });
    section(controls, view, Panel::statistics, "Statistics", [&] { drawStatistics(ui, explorer); });
    section(controls, view, Panel::worst, "Worst interfaces", [&] { drawWorst(controls, explorer); });
  });
  if (layout.readout.width() > 0) ui.column("readout", layout.readout, {}, [&] { drawReadout(ui, explorer); });
  drawFieldNames(explorer, layout);
  ui.addArea("canvas", layout.canvas);
  if (layout.beside.width() > 0) ui.addArea("beside", layout.beside);
}

}  // namespace hpsdf::app
