// The controls by which the explorer opens and writes files, and what it shows before there is a field.

#include "construction/file_kind.h"
#include "explorer/panels.h"
#include "hpsdf/detail/text.h"
#include "hpsdf/mesh_file.h"
#include "language/script.h"
#include "session/field_summary.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr const char* kOpen = "open";
constexpr const char* kSave = "save";
constexpr std::size_t kRecentShown = 6;
constexpr double kStartWidth = 480;  // points
constexpr float kStartGap = 12;
constexpr std::array kShapes = {"torus", "gear", "helix-bowl", "box"};

bool canBeOpened(const std::string& file) { return kindOfFile(file) != FileKind::unknown; }
bool isField(const std::string& file) { return lowerExtension(file) == ".hpsdf"; }

/// True if the command `export` takes a file of this name.
bool isGrid(const Registry& registry, const std::string& file) {
  try {
    parseScript(registry, "export", "export output=" + scriptWord(file), {});
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// Returns a name for a file to be written: that of the field without its folder and its ending.
std::string proposedName(const Explorer& explorer) {
  std::string name = fileName(explorer.session().current().name);
  if (const std::size_t shape = name.find(':'); shape != std::string::npos)
    name = name.substr(shape + 1, name.find(',') - shape - 1);
  return std::filesystem::path(name).stem().string();
}

/// Returns the command that writes the triangles of what is shown.
std::string contourLine(const ViewState& view, const std::string& word) {
  std::string line = "contour output=" + word;
  if (view.surfaceOffset != 0) line += fmt::format(" offset={}", view.surfaceOffset);
  if (view.triangles)
    line += fmt::format(" tolerance={} simplify={}", view.trianglesTolerance, view.trianglesSimplified);
  return line;
}

/// Returns the command that writes a file; the ending of its name tells what is written.
std::string savingLine(const ViewState& view, const std::string& file) {
  const std::string ending = lowerExtension(file), word = scriptWord(file);
  if (ending == ".png") return "shot panels=false output=" + word;
  if (ending == ".hpsdf") return "save output=" + word;
  if (isMeshFileName(file)) return contourLine(view, word);
  return "export output=" + word;
}

/// Draws the text field of a file, after a button by which the user chooses one.
void fileField(const Controls& controls, const std::string& path, const char* label, const std::string& value,
               const std::string& command, FileQuestion question) {
  controls.ui.help("Choose a file.");
  if (controls.ui.button(path + "-file", "…")) controls.files.ask(std::move(question));
  if (const auto file = controls.files.chosen(path)) controls.commands.push_back(command + scriptWord(*file));
  ImGui::SameLine();
  controls.field(path, label, value, command, true);
}

/// Returns the question which file is to be opened.
FileQuestion openQuestion(const Explorer& explorer) {
  return {.id = kOpen,
          .title = "Open a mesh, a grid or a field",
          .accepts = canBeOpened,
          .suggested = explorer.recentFiles};
}

/// Returns the question into which file the picture, the field, its triangles or a grid is to be written.
FileQuestion saveQuestion(const Explorer& explorer) {
  const std::vector<FileEnding> endings = {
      {"picture", ".png", "The picture as it is shown, without the panels. F12 writes the whole window."},
      {"field", ".hpsdf", "The field, which hpsdf opens again."},
      {"triangles", ".stl", "The triangles of the surface that is shown; .obj, .ply and .glb can be typed, too."},
      {"grid", ".vti",
       "The field's values on a grid, for ParaView; .vtu, .npy, .vdb, .nvdb and .cdf can be typed, too."}};
  const auto isWritten = [&registry = explorer.session().registry()](const std::string& file) {
    return lowerExtension(file) == ".png" || isField(file) || isMeshFileName(file) || isGrid(registry, file);
  };
  return {.id = kSave,
          .title = "Save the picture without panels, the field, its triangles or a grid",
          .accepts = isWritten,
          .endings = endings,
          .name = proposedName(explorer) + ".png"};
}

void drawStartPanel(const Controls& controls, const Explorer& explorer, std::size_t recent) {
  Ui& ui = controls.ui;
  const auto gap = [] { ImGui::Dummy({0, kStartGap - ImGui::GetStyle().ItemSpacing.y}); };
  ui.text("Open a mesh to build its signed distance field, or a field to look at it.");
  gap();
  ui.help("Choose a file. Key: Ctrl+O");
  if (ui.button("start/open", "open a file")) controls.files.ask(openQuestion(explorer));
  ImGui::SameLine();
  ui.text("or drop one onto this window", true);
  if (recent > 0) {
    gap();
    ui.text("Opened before", true);
  }
  for (std::size_t i = 0; i < recent; ++i) {
    const std::string file = explorer.recentFiles[i];
    controls.describe("open " + scriptWord(file), "Open this file.");
    if (ui.item(fmt::format("start/{}", i + 1), fittingEnd(file, widthLeft()).c_str(), false))
      controls.commands.push_back("open " + scriptWord(file));
  }
  gap();
  ui.text("Or begin with a shape", true);
  for (const char* shape : kShapes) {
    controls.button(fmt::format("start/shape/{}", shape), shape, fmt::format("open builtin:{}", shape).c_str());
    ImGui::SameLine(0, 4);
  }
}

/// Returns the accuracy that a field was built for, such as ": target error 1e-6", or "" if it is unknown.
std::string accuracyAsked(const Field& field) {
  const FieldMetadata& metadata = field.metadata();
  if (hasTolerance(field)) return ": tolerance " + shortNumber(metadata.settings.tolerance);
  if (!metadata.hasEstimate()) return "";
  return ": target error " + shortNumber(metadata.settings.targetError.weighted());
}

}  // namespace

void askForFiles(const Controls& controls, const Explorer& explorer) {
  const Input* const event = controls.ui.event();
  const bool isShortcut = event != nullptr && event->kind == Input::Kind::key && event->control &&
                          !controls.ui.editing() && !controls.files.isOpen() && !explorer.work &&
                          !explorer.view().isOpen(Panel::keys);
  if (isShortcut && event->key == Key::o) controls.files.ask(openQuestion(explorer));
  if (isShortcut && event->key == Key::s && explorer.session().hasField()) controls.files.ask(saveQuestion(explorer));
  if (const auto file = controls.files.chosen(kOpen)) controls.commands.push_back("open " + scriptWord(*file));
  if (const auto file = controls.files.chosen(kSave)) controls.commands.push_back(savingLine(explorer.view(), *file));
}

void drawFileButtons(const Controls& controls, const Explorer& explorer) {
  controls.ui.help("Open a mesh or a field. Key: Ctrl+O");
  if (controls.ui.button("bar/open", "open")) controls.files.ask(openQuestion(explorer));
  ImGui::SameLine(0, 2);
  controls.ui.help("Write the picture without panels, the field, its triangles or a grid into a file. Key: Ctrl+S");
  if (controls.ui.button("bar/save", "save")) controls.files.ask(saveQuestion(explorer));
}

void fieldFile(const Controls& controls, const std::string& path, const char* label, const std::string& value,
               const std::string& command) {
  fileField(controls, path, label, value, command, {.id = path, .title = "Choose a field", .accepts = isField});
}

void surfaceFile(const Controls& controls, const std::string& path, const char* label, const std::string& value,
                 const std::string& command) {
  const auto isSurface = [](const std::string& file) { return kindOfFile(file) == FileKind::surface; };
  fileField(controls, path, label, value, command, {.id = path, .title = "Choose a mesh", .accepts = isSurface});
}

void drawStart(const Controls& controls, const Explorer& explorer, const Layout& layout) {
  const ViewState& view = explorer.view();
  const std::size_t recent = std::min(kRecentShown, explorer.recentFiles.size());
  const float line = ImGui::GetTextLineHeightWithSpacing(), button = ImGui::GetFrameHeightWithSpacing();
  const double frameWidth = view.width / view.scale, frameHeight = view.height / view.scale;
  const double width = std::min(kStartWidth, frameWidth);
  const double content =
      2 * line + 2 * button + 3 * kStartGap + (recent > 0 ? line * float(recent + 1) + kStartGap : 0);
  const double height = std::min(content, frameHeight);
  const double x = std::floor((frameWidth - width) / 2), y = std::floor((frameHeight - height) / 2);
  const ImVec2 from(float(x) - kStartGap, float(y) - kStartGap);
  const ImVec2 to(float(x + width) + kStartGap, float(y + height) + kStartGap);
  ImGui::GetBackgroundDrawList()->AddRectFilled(from, to, ImGui::GetColorU32(ImGuiCol_WindowBg), 6);
  ImGui::GetBackgroundDrawList()->AddRect(from, to, ImGui::GetColorU32(ImGuiCol_Border), 6);
  controls.ui.column("start", {x, y, x + width, y + height}, {}, [&] { drawStartPanel(controls, explorer, recent); });
  if (layout.readout.width() > 0 && !explorer.message.text.empty())
    controls.ui.column("readout", layout.readout, {}, [&] { drawMessage(controls.ui, explorer); });
}

std::string currentName(const Explorer& explorer) {
  const CurrentField& current = explorer.session().current();
  return explorer.view().beside == Session::kKept ? "now" + accuracyAsked(current.field) : fileName(current.name);
}

std::string besideName(const Explorer& explorer) {
  const std::string& beside = explorer.view().beside;
  return beside == Session::kKept ? "before" + accuracyAsked(explorer.session().other(beside).field) : fileName(beside);
}

}  // namespace hpsdf::app
