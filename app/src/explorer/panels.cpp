// The panels around the explorer's picture.

#include "explorer/panels.h"

#include "pictures/picture_arguments.h"
#include "text/text.h"

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

void nextTo(float space) { ImGui::SameLine(0, space); }

void drawKinds(const Controls& controls, const ViewState& view) {
  if (controls.ui.button("bar/surface", "surface", !view.slice)) controls.commands.emplace_back("show surface");
  nextTo(2);
  if (controls.ui.button("bar/slice", "slice", view.slice)) controls.commands.emplace_back("show slice");
}

void drawBar(const Controls& controls, const Explorer& explorer) {
  Ui& ui = controls.ui;
  std::vector<std::string>& commands = controls.commands;
  const ViewState& view = explorer.view();
  drawKinds(controls, view);
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

/// A point in a picture.
struct SpotInPicture {
  float x, y;        ///< pixels from the picture's upper left corner
  double pixelSize;  ///< world length of a pixel at the point
};

/// Returns where a picture of the explorer's view shows a point. Returns std::nullopt if the point is not in the view's
/// plane or not before the camera.
std::optional<SpotInPicture> spotAt(const ViewState& view, const Field& field, const Vector3& point, int width,
                                    int height) {
  if (view.slice) {
    const render::SliceView plane = render::sliceView(field, slicePicture(view, field), width, height);
    const Vector3 from = point - plane.origin;
    const double pixel = plane.right.norm() / width;
    if (std::abs(from.dot(plane.right.cross(plane.up).normalized())) > pixel) return std::nullopt;
    return SpotInPicture{float(width * (0.5 + from.dot(plane.right) / plane.right.squaredNorm())),
                         float(height * (0.5 - from.dot(plane.up) / plane.up.squaredNorm())), pixel};
  }
  const render::Camera camera = render::cameraOf(view.camera, field.domain(), width, height);
  const render::PicturePoint at = render::project(camera, point, width, height);
  if (!(at.depth > 0)) return std::nullopt;
  return SpotInPicture{float(at.x), float(at.y), render::pixelSize(camera, at.depth, height)};
}

/// Draws a bar of 1, 2 or 5 times a power of ten, at most 120 pixels long, with its length in world units.
void drawScaleBar(ImDrawList& list, const UiRect& rect, double pixelSize) {
  const double most = 120 * pixelSize, power = std::pow(10, std::floor(std::log10(most)));
  const double length = power * (most >= 5 * power ? 5 : most >= 2 * power ? 2 : 1);
  const std::string text = shortNumber(length);
  const float width = float(length / pixelSize), whole = std::max(width, widthOf(text));
  const float x = float(rect.x1) - whole - 14, y = float(rect.y1) - 16;  // the axes are on the left
  list.AddRectFilled({x - 6, y - 22}, {x + whole + 6, y + 8}, IM_COL32(250, 250, 248, 220), 2);
  list.AddRectFilled({x, y}, {x + width, y + 3}, kInk);
  list.AddText({x, y - 18}, kInk, text.c_str());
}

/// Draws a ring around the marked point and a scale bar into each half of the picture.
void drawMark(const Explorer& explorer, const Layout& layout) {
  const ViewState& view = explorer.view();
  const auto& explained = explorer.session().explanation();
  const std::optional<Vector3> mark = explained ? std::optional(explained->point) : view.mark;
  if (!mark || !explorer.picture()) return;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  for (const UiRect& rect : {layout.canvas, layout.beside}) {
    const int width = int(rect.width()), height = int(rect.height());
    if (width < 16 || height < 16) continue;
    const auto spot = spotAt(view, explorer.session().current().field, *mark, width, height);
    if (!spot) continue;
    const ImVec2 at(float(rect.x0) + spot->x, float(rect.y0) + spot->y);
    list.PushClipRect({float(rect.x0), float(rect.y0)}, {float(rect.x1), float(rect.y1)});
    list.AddCircle(at, 10, IM_COL32(255, 255, 255, 255), 24, 4);
    list.AddCircle(at, 10, IM_COL32(20, 20, 30, 255), 24, 2);
    drawScaleBar(list, rect, spot->pixelSize);
    list.PopClipRect();
  }
}

void drawReadout(Ui& ui, Explorer& explorer) {
  if (const auto& work = explorer.work) {
    std::string line = fmt::format("{} {:.0f} %", work->task, std::floor(100 * work->fraction));
    if (work->forecast) line += "   " + forecastText(*work->forecast);
    ui.text(line);
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
  const auto describe = [&](const std::string& name, const render::Drawn& drawn) {
    std::string line = fileName(name);
    for (const std::string& detail : drawn.details) line += "   " + detail;
    ui.text(line);
  };
  describe(explorer.session().current().name, *explorer.picture());
  if (explorer.pictureBeside())
    describe(explorer.view().beside, *explorer.pictureBeside());
  else
    ui.text("drag: turn or move   right drag: move   wheel: nearer or farther   hover: what is there   click: why",
            true);
}

/// Writes what `why` said into the lower left corner of the picture, above the axes.
void drawExplanation(const Explorer& explorer, const Layout& layout) {
  const auto& explained = explorer.session().explanation();
  if (!explained || layout.canvas.width() < 16) return;
  constexpr float kPad = 8, kAxes = 74;
  const float most = float(layout.canvas.width()) - 4 * kPad;
  float width = 0;
  std::string text;
  for (const std::string& line : explained->lines) {
    width = std::max(width, std::min(widthOf(line), most));
    text += (text.empty() ? "" : "\n") + line;
  }
  const float height = ImGui::CalcTextSize(text.c_str(), nullptr, false, width + 1).y;
  const float x = float(layout.canvas.x0) + kPad + 4;
  const float bottom = float(layout.canvas.y1) - kAxes;
  const float top = bottom - height;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  list.PushClipRect({float(layout.canvas.x0), float(layout.canvas.y0)},
                    {float(layout.canvas.x1), float(layout.canvas.y1)});
  list.AddRectFilled({x - kPad, top - kPad}, {x + width + kPad, bottom + kPad}, IM_COL32(250, 250, 248, 235), 3);
  list.AddRect({x - kPad, top - kPad}, {x + width + kPad, bottom + kPad}, kSoftInk, 3);
  list.AddText(ImGui::GetFont(), ImGui::GetFontSize(), {x, top}, kInk, text.c_str(), nullptr, width + 1);
  list.PopClipRect();
}

/// Draws the panels while the first field is on its way: its progress and, once there are cells, the buttons that show
/// its surface or a slice.
void drawPanelsWithoutField(const Controls& controls, Explorer& explorer, const Layout& layout) {
  Ui& ui = controls.ui;
  if (layout.readout.width() > 0) ui.column("readout", layout.readout, {}, [&] { drawReadout(ui, explorer); });
  if (layout.bar.width() > 0 && explorer.showsUnfinished()) {
    ui.freeze(false);
    ui.column("bar", layout.bar, {}, [&] { drawKinds(controls, explorer.view()); });
    ui.freeze(true);
  }
  ui.addArea("canvas", layout.canvas);
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
  if (explorer.work && !explorer.session().hasField()) return drawPanelsWithoutField(controls, explorer, layout);
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
  drawMark(explorer, layout);
  drawFieldNames(explorer, layout);
  drawExplanation(explorer, layout);
  ui.addArea("canvas", layout.canvas);
  if (layout.beside.width() > 0) ui.addArea("beside", layout.beside);
}

}  // namespace hpsdf::app
