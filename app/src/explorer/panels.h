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

/// Six digits suffice for a slider's value in a command.
inline std::string number(double value) { return fmt::format("{:.6g}", value); }

/// The name of a file without its folders, for which a panel has no room.
inline std::string fileName(const std::string& path) { return std::filesystem::path(path).filename().string(); }

inline ImU32 packed(const render::Color& c) { return IM_COL32(c[0], c[1], c[2], 255); }

inline float widthLeft() { return ImGui::GetContentRegionAvail().x; }
inline float widthOf(const std::string& text) { return ImGui::CalcTextSize(text.c_str()).x; }

inline void textAt(float x, float y, const std::string& text, ImU32 color) {
  ImGui::GetWindowDrawList()->AddText({std::round(x), std::round(y)}, color, text.c_str());
}

/// Controls that show a part of the state and append a command to `commands` when a person uses them. They change
/// nothing themselves. A `command` is the beginning of a line, to which the chosen value is appended.
struct Controls {
  Ui& ui;
  std::vector<std::string>& commands;

  void button(const std::string& path, const char* label, const char* command, bool enabled = true) const {
    ui.enable(enabled);
    if (ui.button(path, label)) commands.emplace_back(command);
    ui.enable(true);
  }

  void slider(const std::string& path, const char* label, double value, double low, double high,
              const std::string& command, const char* format = "%.4g") const {
    if (const auto chosen = ui.slider(path, label, value, low, high, format))
      commands.push_back(command + number(*chosen));
  }

  void checkbox(const std::string& path, const char* label, bool value, const char* command) const {
    if (const auto chosen = ui.checkbox(path, label, value)) commands.push_back(fmt::format("{}{}", command, *chosen));
  }

  void choice(const std::string& path, const char* label, const std::vector<std::string>& names,
              const std::string& current, const std::string& command) const {
    if (const auto chosen = ui.combo(path, label, names, current)) commands.push_back(command + *chosen);
  }

  /// A text field, whose text becomes one word of the command: "none" where it is empty and `orNone` is true.
  void field(const std::string& path, const char* label, const std::string& value, const std::string& command,
             bool orNone = false) const {
    if (const auto text = ui.field(path, label, value))
      commands.push_back(command + (orNone ? wordOrNone(*text) : scriptWord(*text)));
  }
};

/// Draws the controls of the camera or the plane, of the cells and of the colours.
void drawViewPanel(const Controls& controls, Explorer& explorer);
/// Draws the parameters of the next construction, its progress while it runs, and the button that starts it.
void drawBuildPanel(const Controls& controls, Explorer& explorer);

/// Draws the key to the colours of the present picture.
void drawLegend(Ui& ui, const std::optional<render::Drawn>& picture);
/// Draws the shares of the domain's volume by degree and by depth.
void drawHistograms(Ui& ui, Explorer& explorer);
/// Draws figures of the whole field.
void drawStatistics(Ui& ui, Explorer& explorer);
/// Draws one page of the list of interfaces with the greatest jumps, and the buttons that turn the page.
void drawWorst(const Controls& controls, Explorer& explorer);

}  // namespace hpsdf::app
