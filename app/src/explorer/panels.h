#pragma once
// The parts of the explorer's panels, and the controls and drawing functions that they share.

#include <fmt/format.h>
#include <imgui.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "explorer/explorer.h"
#include "hpsdf/render/image.h"

namespace hpsdf::app {

constexpr ImU32 kInk = IM_COL32(32, 34, 44, 255), kSoftInk = IM_COL32(98, 102, 116, 255);
constexpr ImU32 kTick = IM_COL32(60, 64, 78, 255);

/// Formats a slider's value for a command. Six digits suffice.
inline std::string number(double value) { return fmt::format("{:.6g}", value); }

/// Returns the name of a file without its folders, because a panel has no room for them.
inline std::string fileName(const std::string& path) { return std::filesystem::path(path).filename().string(); }

inline ImU32 packed(const render::Color& c) { return IM_COL32(c[0], c[1], c[2], 255); }

inline float widthLeft() { return ImGui::GetContentRegionAvail().x; }
inline float widthOf(const std::string& text) { return ImGui::CalcTextSize(text.c_str()).x; }

inline void textAt(float x, float y, const std::string& text, ImU32 color) {
  ImGui::GetWindowDrawList()->AddText({std::round(x), std::round(y)}, color, text.c_str());
}

/// The controls of the explorer's panels. Each control shows a part of the explorer's state. When a person uses a
/// control, the control does not change the state but appends a line of script to `commands`. The line consists of the
/// control's parameter `command` and the chosen value. The tooltip of a control is `help`, or else what the registry
/// says of the command and its parameter.
struct Controls {
  Ui& ui;
  const Registry& registry;
  std::vector<std::string>& commands;
  FileDialog& files;

  /// Sets the tooltip of the next control.
  void describe(const std::string& command, const char* help = nullptr) const;

  void button(const std::string& path, const char* label, const char* command, bool enabled = true,
              const char* help = nullptr, double width = 0) const {
    describe(command, help);
    ui.enable(enabled);
    if (ui.button(path, label, false, width)) commands.emplace_back(command);
    ui.enable(true);
  }

  void slider(const std::string& path, const char* label, double value, double low, double high,
              const std::string& command, const char* format = "%.4g") const {
    describe(command);
    if (const auto chosen = ui.slider(path, label, value, low, high, format))
      commands.push_back(command + number(*chosen));
  }

  void checkbox(const std::string& path, const char* label, bool value, const char* command) const {
    describe(command);
    if (const auto chosen = ui.checkbox(path, label, value)) commands.push_back(fmt::format("{}{}", command, *chosen));
  }

  void choice(const std::string& path, const char* label, const std::vector<std::string>& names,
              const std::string& current, const std::string& command) const {
    describe(command);
    if (const auto chosen = ui.combo(path, label, names, current)) commands.push_back(command + *chosen);
  }

  /// A text field. Its text becomes one word of the command. If the text is empty and `orNone` is true, the
  /// word is "none".
  void field(const std::string& path, const char* label, const std::string& value, const std::string& command,
             bool orNone = false) const {
    describe(command);
    if (const auto text = ui.field(path, label, value))
      commands.push_back(command + (orNone ? wordOrNone(*text) : scriptWord(*text)));
  }
};

/// Draws buttons that answer common questions, each by the command `preset`.
void drawQuestions(const Controls& controls);
/// Draws the controls of what the picture shows: offset and cut of the surface, the slice's plane, cells, triangles.
void drawShown(const Controls& controls, Explorer& explorer);
/// Draws the controls of the colours and of their scale.
void drawColors(const Controls& controls, Explorer& explorer);
/// Draws the controls of the camera or, for a slice, of the part of the plane that is seen.
void drawCamera(const Controls& controls, Explorer& explorer);
/// Draws the parameters of the next construction, its progress while it runs, and the button that starts it.
void drawBuildPanel(const Controls& controls, Explorer& explorer);

/// Draws the colour legend of the present picture. A degree or depth that is pressed shows its cells.
void drawLegend(const Controls& controls, const Explorer& explorer);
/// Draws two histograms: the shares of the domain's volume by degree and by depth of the cells. A column that is
/// pressed shows the cells of its degree or depth.
void drawHistograms(const Controls& controls, Explorer& explorer);
/// Draws a table of statistics of the field, such as its number of cells.
void drawStatistics(Ui& ui, Explorer& explorer);
/// Draws one page of the list of cell interfaces with the greatest jumps, and the buttons that turn the page.
void drawWorst(const Controls& controls, Explorer& explorer);

/// Asks for a file to open or to write when its keys are pressed, and appends the command for the file that was chosen.
void askForFiles(const Controls& controls, const Explorer& explorer);

/// Draws the buttons that open and write files.
void drawFileButtons(const Controls& controls, const Explorer& explorer);

/// Draws a text field for the file of a field, with a button that lets the user choose one. The file becomes the last
/// word of `command`; without a file it is "none".
void fieldFile(const Controls& controls, const std::string& path, const char* label, const std::string& value,
               const std::string& command);
/// Draws the same for a mesh or a shape.
void surfaceFile(const Controls& controls, const std::string& path, const char* label, const std::string& value,
                 const std::string& command);

/// Draws the explorer's message.
void drawMessage(Ui& ui, const Explorer& explorer);

/// Draws an invitation to open a file, in the middle of a frame without a field.
void drawStart(const Controls& controls, const Explorer& explorer, const Layout& layout);

/// Return the names of the two fields that are shown beside each other. Where they differ in their construction only,
/// the names tell for which accuracy they were built.
std::string currentName(const Explorer& explorer);
std::string besideName(const Explorer& explorer);

}  // namespace hpsdf::app
