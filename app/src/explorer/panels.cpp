// The panels around the explorer's picture.

#include "explorer/panels.h"

#include <algorithm>
#include <sstream>

#include "explorer/gizmo.h"
#include "pictures/picture_arguments.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Draws a section: its heading, which folds and unfolds it, and its content if it is unfolded.
template <typename Content>
void section(const Controls& controls, const ViewState& view, Panel panel, const char* title, const Content& content) {
  const std::string name = kPanelNames[static_cast<std::size_t>(panel)];
  const bool isUnfolded = view.isOpen(panel);
  const std::string command = fmt::format("panel {}={}", name, !isUnfolded);
  controls.describe(command, isUnfolded ? "Fold this section." : "Unfold this section.");
  if (controls.ui.heading(name + "/fold", title, isUnfolded)) controls.commands.push_back(command);
  if (isUnfolded) content();
}

void nextTo(float spaces) { ImGui::SameLine(0, spaces * ImGui::GetFontSize()); }

void drawKinds(const Controls& controls, const ViewState& view) {
  const auto button = [&](const char* path, const char* label, const char* command, bool pressed, const char* help) {
    controls.describe(command, help);
    if (controls.ui.button(path, label, pressed)) controls.commands.emplace_back(command);
  };
  button("bar/surface", "surface", "show surface", !view.slice, "Show the surface in space. Key: s");
  nextTo(0.15F);
  button("bar/slice", "slice", "show slice", view.slice, "Show the flat picture of a plane. Key: p");
}

void drawBar(const Controls& controls, const Explorer& explorer) {
  const ViewState& view = explorer.view();
  drawFileButtons(controls, explorer);
  nextTo(1.5F);
  drawKinds(controls, view);
  nextTo(1.5F);
  controls.button("bar/undo", "undo", "undo", explorer.canUndo(), "Take back the last change of the view. Key: Ctrl+Z");
  nextTo(0.15F);
  controls.button("bar/redo", "redo", "redo", explorer.canRedo(), "Do again what undo took back. Key: Ctrl+Y");
  nextTo(1.5F);
  controls.button("bar/copy-view", "copy view", "copy-view", true,
                  "Copy the lines of script that lead to this view. Key: Ctrl+C");
  nextTo(1.5F);
  const bool anyColumn = view.isOpen(Panel::left) || view.isOpen(Panel::right);
  const std::string columns = fmt::format("panel left={0} right={0}", !anyColumn);
  controls.describe(columns, "Show or hide the columns beside the picture.");
  if (controls.ui.button("bar/columns", "columns", anyColumn)) controls.commands.push_back(columns);
  nextTo(0.15F);
  const std::string keys = fmt::format("panel keys={}", !view.isOpen(Panel::keys));
  controls.describe(keys, "Tell what keys and mouse do. Keys: ? and F1");
  if (controls.ui.button("bar/keys", "?", view.isOpen(Panel::keys))) controls.commands.push_back(keys);
}

using Lines = std::vector<std::pair<const char*, const char*>>;

/// A table of two columns with a title, in the list of keys.
struct KeyTable {
  const char* title;
  Lines lines;

  static float em() { return ImGui::GetFontSize(); }
  static float second() { return 9.5F * em(); }
  static float width() { return 27 * em(); }
  static float heightOf(const char* what) {
    return ImGui::CalcTextSize(what, nullptr, false, width() - second()).y + 0.2F * em();
  }

  float height() const {
    float height = 1.6F * em();
    for (const auto& [key, what] : lines) height += heightOf(what);
    return height;
  }

  void draw(ImDrawList& list, const ImVec2& at) const {
    float y = at.y + 1.6F * em();
    list.AddText(at, kInk, title);
    list.AddLine({at.x, at.y + 1.3F * em()}, {at.x + width(), at.y + 1.3F * em()}, kSoftInk);
    for (const auto& [key, what] : lines) {
      list.AddText({at.x, y}, kInk, key);
      list.AddText(ImGui::GetFont(), em(), {at.x + second(), y}, kSoftInk, what, nullptr, width() - second());
      y += heightOf(what);
    }
  }
};

/// Draws the list of keys and mouse actions over the picture, in two columns if there is room for them.
void drawKeys(const ViewState& view) {
  static const KeyTable kMouse = {"Mouse",
                                  {{"drag", "turn the surface, move the slice"},
                                   {"right drag", "move the surface"},
                                   {"wheel", "nearer or farther; over a column, scroll it"},
                                   {"hover", "read out what is there"},
                                   {"click", "why the cell there is as it is"},
                                   {"axes, top right", "click an end to look along it"},
                                   {"Ctrl+click", "type the number of a slider"}}};
  static const KeyTable kPlaces = {"Where to find what",
                                   {{"what is here?", "point at it; the line below the picture"},
                                    {"how wrong is it?", "Questions: how far off; Statistics"},
                                    {"where is it torn?", "Questions; Worst interfaces"},
                                    {"what is inside?", "Questions; cut across, or the slice"},
                                    {"a finer field?", "Construction: target error, rebuild"},
                                    {"two fields?", "Surface: beside; rebuild and compare"}}};
  static const KeyTable kKeys = {"Keys",
                                 {{"s, p", "surface, slice"},
                                  {"1 2 3 4", "from the front, back, left, right"},
                                  {"5 6 7", "from the top, bottom, corner"},
                                  {"Ctrl+Z, Ctrl+Y", "undo, redo"},
                                  {"Ctrl+O, Ctrl+S", "open a file, write one"},
                                  {"Ctrl+C", "copy the view as lines of script"},
                                  {"Tab, Shift+Tab", "next control, the one before"},
                                  {"Enter, Space", "press it; Enter types into a slider"},
                                  {"arrows", "change a slider or a list"},
                                  {"F12", "write a picture of the window"},
                                  {"?, F1", "this list"},
                                  {"Escape", "cancel, close, leave a text"},
                                  {"Ctrl+Q", "close the window"}}};
  constexpr const char* kManual = "The manual is docs/explorer.md and docs/window.md.";
  const float em = ImGui::GetFontSize(), pad = 1.4F * em, column = KeyTable::width();
  const auto width = static_cast<float>(view.width / view.scale);
  const auto height = static_cast<float>(view.height / view.scale);
  const bool two = width > 2 * column + 3 * pad;
  const float left = kMouse.height() + pad + kPlaces.height(), right = kKeys.height() + pad + em;
  const float w = (two ? 2 * column + pad : column) + 2 * pad;
  const float h = (two ? std::max(left, right) : left + pad + right) + 2 * pad;
  const ImVec2 from(std::round((width - w) / 2), std::round(std::max(0.0F, (height - h) / 2)));
  ImDrawList& list = *ImGui::GetForegroundDrawList();
  list.AddRectFilled({0, 0}, {width, height}, IM_COL32(40, 43, 54, 90));
  list.AddRectFilled(from, {from.x + w, from.y + h}, IM_COL32(252, 252, 250, 255), 0.4F * em);
  ImVec2 at(from.x + pad, from.y + pad);
  kMouse.draw(list, at);
  kPlaces.draw(list, {at.x, at.y + kMouse.height() + pad});
  at = two ? ImVec2(at.x + column + pad, at.y) : ImVec2(at.x, at.y + left + pad);
  kKeys.draw(list, at);
  list.AddText({at.x, at.y + kKeys.height() + pad}, kSoftInk, kManual);
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
  name(layout.canvas, currentName(explorer));
  name(layout.beside, besideName(explorer));
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
  if (!explorer.message.text.empty()) return drawMessage(ui, explorer);
  if (const auto readout = explorer.readout()) {
    for (const std::string& line : readoutText(*readout)) ui.text(line);
    return;
  }
  if (!explorer.picture()) return;
  const ViewState& view = explorer.view();
  const auto describe = [&](const std::string& name, const render::Drawn& drawn) {
    std::string line = fileName(name);
    for (const std::string& detail : drawn.details) line += "   " + detail;
    if (!view.slice && view.guessesUp) line += "   up axis guessed: " + upName(view.camera);
    ui.text(line);
  };
  describe(explorer.session().current().name, *explorer.picture());
  if (explorer.pictureBeside())
    describe(besideName(explorer), *explorer.pictureBeside());
  else
    ui.text(
        "drag: turn or move   right drag: move   wheel: nearer or farther   hover: what is there   click: why   ?: all "
        "keys",
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

/// Returns what the registry says of the parameter at the end of a line of script such as "plane zoom=", or of the
/// command if there is none.
std::string helpOf(const Registry& registry, const std::string& line) {
  std::istringstream words(line);
  std::string name, last;
  words >> name;
  for (std::string word; words >> word;) last = word;
  const Command& command = registry.command(name);
  const Parameter* parameter = nullptr;
  if (line.ends_with('='))
    parameter = findParameter(command, last.substr(0, last.size() - 1));
  else if (const auto found = std::ranges::find(command.parameters, true, &Parameter::isPositional);
           line.ends_with(' ') && found != command.parameters.end())
    parameter = &*found;
  return parameter != nullptr ? parameter->help : command.summary;
}

/// Draws all panels but the dialog of files.
void drawParts(const Controls& controls, Explorer& explorer) {
  Ui& ui = controls.ui;
  const ViewState& view = explorer.view();
  const Layout layout = layoutInPoints(view);
  ui.freeze(explorer.work || controls.files.isOpen() || view.isOpen(Panel::keys));  // a click closes the list of keys
  const auto scrolling = [&](const char* name, const UiRect& rect, double scroll, const auto& content) {
    if (rect.width() <= 0) return;
    const double now = ui.column(name, rect, scroll, content);
    if (std::abs(now - scroll) > 0.5) controls.commands.push_back(fmt::format("panel {}-scroll={}", name, now));
  };
  askForFiles(controls, explorer);
  if (explorer.work && explorer.isOpening()) return drawPanelsWithoutField(controls, explorer, layout);
  if (!explorer.session().hasField()) return drawStart(controls, explorer, layout);
  if (layout.bar.width() > 0) ui.column("bar", layout.bar, {}, [&] { drawBar(controls, explorer); });
  scrolling("left", layout.left, view.scroll[0], [&] {
    section(controls, view, Panel::questions, "Questions", [&] { drawQuestions(controls); });
    section(controls, view, Panel::shown, view.slice ? "Slice" : "Surface", [&] { drawShown(controls, explorer); });
    section(controls, view, Panel::colors, "Colours", [&] { drawColors(controls, explorer); });
    section(controls, view, Panel::camera, view.slice ? "Part of the plane" : "Camera",
            [&] { drawCamera(controls, explorer); });
    section(controls, view, Panel::build, "Construction", [&] { drawBuildPanel(controls, explorer); });
  });
  scrolling("right", layout.right, view.scroll[1], [&] {
    section(controls, view, Panel::legend, "Legend", [&] { drawLegend(controls, explorer); });
    section(controls, view, Panel::histograms, "Degrees and depths", [&] { drawHistograms(controls, explorer); });
    section(controls, view, Panel::worst, "Worst interfaces", [&] { drawWorst(controls, explorer); });
    section(controls, view, Panel::statistics, "Statistics", [&] { drawStatistics(ui, explorer); });
  });
  if (layout.readout.width() > 0) ui.column("readout", layout.readout, {}, [&] { drawReadout(ui, explorer); });
  drawMark(explorer, layout);
  drawFieldNames(explorer, layout);
  drawExplanation(explorer, layout);
  if (!explorer.drawsCanvasOnly()) drawGizmo(ui, view, layout.canvas, controls.commands);
  ui.addArea("canvas", layout.canvas);
  if (layout.beside.width() > 0) ui.addArea("beside", layout.beside);
}

}  // namespace

void Controls::describe(const std::string& command, const char* help) const {
  const bool isUnfinished = command.ends_with('=') || command.ends_with(' ');
  ui.help(fmt::format("{}\nIn scripts: {}{}", help != nullptr ? help : helpOf(registry, command), command,
                      isUnfinished ? "…" : ""));
}

void drawMessage(Ui& ui, const Explorer& explorer) {
  const auto& [text, isProblem] = explorer.message;
  ImGui::PushTextWrapPos(0);
  isProblem ? ui.problem(text) : ui.text(text);
  ImGui::PopTextWrapPos();
}

void drawPanels(Ui& ui, Explorer& explorer, std::vector<std::string>& commands) {
  const Controls controls{ui, explorer.session().registry(), commands, explorer.files};
  drawParts(controls, explorer);
  if (explorer.drawsCanvasOnly()) return ui.hideTip();
  const ViewState& view = explorer.view();
  if (view.isOpen(Panel::keys)) {
    drawKeys(view);
    ui.hideTip();
  }
  explorer.files.draw(ui, view.width / view.scale, view.height / view.scale);
}

}  // namespace hpsdf::app
