#include "widgets/ui.h"

#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>

#include "hpsdf/render/font.h"
#include "widgets/raster.h"

namespace hpsdf::app {
namespace {

constexpr float kTextSize = 13;     // pixels per em
constexpr float kStep = 1.0F / 60;  // assumed seconds per frame; no clock is read

struct NamedKey {
  std::string_view name;
  Key key;
  ImGuiKey code;
};
constexpr NamedKey kKeys[] = {{"enter", Key::enter, ImGuiKey_Enter},
                              {"escape", Key::escape, ImGuiKey_Escape},
                              {"backspace", Key::backspace, ImGuiKey_Backspace},
                              {"delete", Key::remove, ImGuiKey_Delete},
                              {"left", Key::left, ImGuiKey_LeftArrow},
                              {"right", Key::right, ImGuiKey_RightArrow},
                              {"home", Key::home, ImGuiKey_Home},
                              {"end", Key::end, ImGuiKey_End},
                              {"tab", Key::tab, ImGuiKey_Tab},
                              {"a", Key::a, ImGuiKey_A},
                              {"c", Key::c, ImGuiKey_C},
                              {"v", Key::v, ImGuiKey_V},
                              {"x", Key::x, ImGuiKey_X},
                              {"y", Key::y, ImGuiKey_Y},
                              {"z", Key::z, ImGuiKey_Z}};

ImVec4 gray(float value, float alpha = 1) { return {value, value, value * 1.01F, alpha}; }

void setStyle() {
  ImGui::StyleColorsLight();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowPadding = {10, 5};
  style.FramePadding = {6, 2};
  style.ItemSpacing = {6, 4};
  style.ItemInnerSpacing = {6, 4};
  style.ScrollbarSize = 10;
  style.WindowBorderSize = 0;
  style.PopupBorderSize = 1;
  style.FrameBorderSize = 1;
  style.FrameRounding = 2;
  style.GrabRounding = 2;
  style.GrabMinSize = 8;
  const ImVec4 accent(0.20F, 0.36F, 0.62F, 1);
  const auto set = [&](ImGuiCol what, ImVec4 color) { style.Colors[what] = color; };
  set(ImGuiCol_WindowBg, gray(0.965F));
  set(ImGuiCol_PopupBg, gray(0.99F));
  set(ImGuiCol_Text, {0.12F, 0.13F, 0.17F, 1});
  set(ImGuiCol_TextDisabled, {0.42F, 0.44F, 0.50F, 1});
  set(ImGuiCol_Border, gray(0.78F));
  set(ImGuiCol_FrameBg, gray(1));
  set(ImGuiCol_FrameBgHovered, {0.90F, 0.93F, 0.98F, 1});
  set(ImGuiCol_FrameBgActive, {0.84F, 0.89F, 0.97F, 1});
  set(ImGuiCol_Button, gray(0.92F));
  set(ImGuiCol_ButtonHovered, {0.84F, 0.89F, 0.97F, 1});
  set(ImGuiCol_ButtonActive, {0.72F, 0.80F, 0.93F, 1});
  set(ImGuiCol_Header, {0.80F, 0.87F, 0.97F, 1});
  set(ImGuiCol_HeaderHovered, {0.86F, 0.91F, 0.98F, 1});
  set(ImGuiCol_HeaderActive, {0.72F, 0.80F, 0.93F, 1});
  set(ImGuiCol_CheckMark, accent);
  set(ImGuiCol_SliderGrab, {0.74F, 0.82F, 0.93F, 1});
  set(ImGuiCol_SliderGrabActive, accent);
  set(ImGuiCol_PlotHistogram, {0.45F, 0.58F, 0.78F, 1});
  set(ImGuiCol_Separator, gray(0.86F));
  set(ImGuiCol_ScrollbarBg, gray(0.94F));
}

UiRect visiblePart(const ImVec2& low, const ImVec2& high) {
  const ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 from = list.GetClipRectMin(), to = list.GetClipRectMax();
  return {std::max(low.x, from.x), std::max(low.y, from.y), std::min(high.x, to.x), std::min(high.y, to.y)};
}

}  // namespace

std::vector<std::string> keyNames() {
  std::vector<std::string> names;
  for (const NamedKey& known : kKeys) names.emplace_back(known.name);
  return names;
}

std::optional<Key> keyNamed(std::string_view name) {
  const auto found = std::ranges::find(kKeys, name, &NamedKey::name);
  return found == std::end(kKeys) ? std::nullopt : std::optional(found->key);
}

struct Ui::State {
  ImGuiContext* context = nullptr;
  Coverage texture;
  bool disabled = false;
  bool frozen = false;
  std::string clipboard;
  std::string idText;
  std::pair<std::string, double> held;  ///< path and value of a held slider that reports its value on release
};

Ui::Ui() : state_(std::make_unique<State>()) {
  state_->context = ImGui::CreateContext();
  ImGuiIO& io = activate();
  io.IniFilename = nullptr;
  io.LogFilename = nullptr;
  io.ConfigInputTextCursorBlink = false;
  io.MouseDoubleClickTime = 0;  // fast clicks of a script must not become double clicks
  io.MouseDrawCursor = false;
  for (const NamedKey& known : kKeys) io.KeyMap[known.code] = static_cast<int>(known.key);
  io.ClipboardUserData = &state_->clipboard;
  io.SetClipboardTextFn = [](void* clipboard, const char* text) { *static_cast<std::string*>(clipboard) = text; };
  io.GetClipboardTextFn = [](void* clipboard) { return static_cast<std::string*>(clipboard)->c_str(); };
  setStyle();

  // Ranges of the characters that the font atlas contains: Latin, Greek, dashes, dots, arrows, ∇, −, ≤, ≥.
  static const ImWchar ranges[] = {0x20,   0x7e,   0xa0,   0xff,   0x391,  0x3c9,  0x2013, 0x2014, 0x2026, 0x2026,
                                   0x2190, 0x2193, 0x2207, 0x2207, 0x2212, 0x2212, 0x2264, 0x2265, 0};
  ImFontConfig config;
  config.FontDataOwnedByAtlas = false;
  config.OversampleH = 1;
  config.PixelSnapH = true;
  const auto font = render::dejavuSans();
  // The const_cast is safe: the atlas only reads the font, which it does not own.
  io.Fonts->AddFontFromMemoryTTF(const_cast<unsigned char*>(font.data()), static_cast<int>(font.size()), kTextSize,
                                 &config, ranges);
  unsigned char* texels = nullptr;
  Coverage& texture = state_->texture;
  io.Fonts->GetTexDataAsAlpha8(&texels, &texture.width, &texture.height);
  texture.texels.assign(texels, texels + std::size_t(texture.width) * texture.height);
}

Ui::~Ui() { ImGui::DestroyContext(state_->context); }

void Ui::frame(int width, int height, const Input* input, const std::function<void()>& widgets) {
  ImGuiIO& io = activate();
  io.DisplaySize = {float(width), float(height)};
  io.DeltaTime = kStep;
  io.MouseWheel = 0;
  if (input != nullptr) {
    const Input& event = *input;
    io.KeyCtrl = event.control;
    io.KeyShift = event.shift;
    if (event.kind == Input::Kind::move) pointer_ = event.at;
    if (event.kind == Input::Kind::press) io.MouseDown[event.button] = true;
    if (event.kind == Input::Kind::release) io.MouseDown[event.button] = false;
    if (event.kind == Input::Kind::wheel) io.MouseWheel = float(event.turn);
    if (event.kind == Input::Kind::type) io.AddInputCharactersUTF8(event.text.c_str());
    if (event.kind == Input::Kind::key) io.KeysDown[static_cast<int>(event.key)] = true;
  }
  io.MousePos = {float(pointer_[0]), float(pointer_[1])};
  widgets_.clear();
  const auto end = [&] {
    ImGui::Render();
    if (input != nullptr && input->kind == Input::Kind::key) io.KeysDown[static_cast<int>(input->key)] = false;
    if (input == nullptr || input->kind != Input::Kind::press) io.KeyCtrl = io.KeyShift = false;
  };
  ImGui::NewFrame();
  try {
    widgets();
  } catch (...) {
    state_->disabled = false;
    ImGui::ErrorCheckEndFrameRecover(nullptr);  // closes windows and groups that the exception left open
    end();
    throw;
  }
  end();
}

void Ui::paint(render::Image& image) const {
  activate();
  app::paint(image, *ImGui::GetDrawData(), state_->texture);
}

ImGuiIO& Ui::activate() const {
  ImGui::SetCurrentContext(state_->context);
  return ImGui::GetIO();
}

bool Ui::wantsMouse() const { return activate().WantCaptureMouse; }
bool Ui::busy() const { return holds(0) || holds(1) || holds(2) || ImGui::IsAnyItemActive(); }
bool Ui::holds(int button) const { return activate().MouseDown[button]; }
bool Ui::editing() const { return activate().WantTextInput; }

const std::string& Ui::clipboard() const { return state_->clipboard; }
void Ui::setClipboard(const std::string& text) { state_->clipboard = text; }

double Ui::column(const char* name, const UiRect& rect, std::optional<double> scrolled,
                  const std::function<void()>& content) {
  const bool scrolls = scrolled.has_value();
  const double scroll = scrolled.value_or(0);
  ImGui::SetNextWindowPos({float(rect.x0), float(rect.y0)});
  ImGui::SetNextWindowSize({float(rect.width()), float(rect.height())});
  ImGui::Begin(
      name, nullptr,
      ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
          ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoBringToFrontOnFocus |
          (scrolls ? ImGuiWindowFlags_None : ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse));
  if (std::abs(ImGui::GetScrollY() - scroll) > 0.5 && ImGui::GetIO().MouseWheel == 0 && !ImGui::IsMouseDown(0))
    ImGui::SetScrollY(float(scroll));
  ImGui::PushItemWidth(0.52F * ImGui::GetContentRegionAvail().x);
  enable(true);
  content();
  setDisabled(false);
  ImGui::PopItemWidth();
  const double now = std::min(ImGui::GetScrollY(), ImGui::GetScrollMaxY());
  ImGui::End();
  return now;
}

void Ui::note(const std::string& path, bool takesText) {
  widgets_[path] = {visiblePart(ImGui::GetItemRectMin(), ImGui::GetItemRectMax()), !state_->disabled, takesText};
}

const char* Ui::id(const std::string& path, const char* label) {
  state_->idText = std::string(label) + "##" + path;
  return state_->idText.c_str();
}

void Ui::setDisabled(bool disabled) {
  if (disabled && !state_->disabled) ImGui::BeginDisabled();
  if (!disabled && state_->disabled) ImGui::EndDisabled();
  state_->disabled = disabled;
}

void Ui::enable(bool enabled) { setDisabled(!enabled || state_->frozen); }

void Ui::freeze(bool frozen) { state_->frozen = frozen; }

bool Ui::heading(const std::string& path, const char* label) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted(label);
  const float width = ImGui::CalcTextSize("×").x + 8;
  ImGui::SameLine(ImGui::GetWindowContentRegionMax().x - width);
  ImGui::PushStyleVar(ImGuiStyleVar_FrameBorderSize, 0);
  ImGui::PushStyleColor(ImGuiCol_Button, {0, 0, 0, 0});
  const bool closed = ImGui::Button(id(path, "×"), {width, 0});
  note(path);
  ImGui::PopStyleColor();
  ImGui::PopStyleVar();
  ImGui::Separator();
  return closed;
}

bool Ui::button(const std::string& path, const char* label, bool pressed) {
  if (pressed) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_Header));
  const bool clicked = ImGui::Button(id(path, label));
  if (pressed) ImGui::PopStyleColor();
  note(path);
  return clicked;
}

std::optional<bool> Ui::checkbox(const std::string& path, const char* label, bool value) {
  const bool changed = ImGui::Checkbox(id(path, label), &value);
  note(path);
  return changed ? std::optional(value) : std::nullopt;
}

std::optional<std::string> Ui::combo(const std::string& path, const char* label, std::span<const std::string> items,
                                     const std::string& current) {
  std::optional<std::string> chosen;
  const std::string& shown = std::ranges::find(items, current) != items.end() ? current : items.front();
  const bool open = ImGui::BeginCombo(id(path, label), shown.c_str(), ImGuiComboFlags_HeightLargest);
  note(path);
  if (!open) return chosen;
  for (const std::string& item : items) {
    const std::string itemPath = path + "/" + item;
    if (ImGui::Selectable(id(itemPath, item.c_str()), item == shown)) chosen = item;
    note(itemPath);
  }
  ImGui::EndCombo();
  return chosen;
}

std::optional<double> Ui::slider(const std::string& path, const char* label, double value, double low, double high,
                                 const char* format, When when) {
  const double before = value;
  if (when == When::released && state_->held.first == path) value = state_->held.second;
  bool changed = ImGui::SliderScalar(id(path, label), ImGuiDataType_Double, &value, &low, &high, format);
  if (when == When::released) {
    if (ImGui::IsItemActive()) state_->held = {path, value};
    changed = ImGui::IsItemDeactivatedAfterEdit();
    if (changed) value = state_->held.second;
    if (!ImGui::IsItemActive() && state_->held.first == path) state_->held = {};
  }
  note(path, true);
  return changed && value != before ? std::optional(value) : std::nullopt;
}

std::optional<std::string> Ui::field(const std::string& path, const char* label, const std::string& value) {
  std::array<char, 1024> buffer{};
  value.copy(buffer.data(), buffer.size() - 1);
  const bool entered = ImGui::InputText(id(path, label), buffer.data(), buffer.size(),
                                        ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_AutoSelectAll);
  note(path, true);
  return entered && buffer.data() != value ? std::optional<std::string>(buffer.data()) : std::nullopt;
}

bool Ui::row(const std::string& path, std::span<const std::string> cells, double cellWidth) {
  const bool clicked = ImGui::Selectable(id(path, ""));
  note(path);
  ImVec2 at = ImGui::GetItemRectMin();
  at.y += 0.5F * ImGui::GetStyle().ItemSpacing.y;
  for (const std::string& cell : cells) {
    ImGui::GetWindowDrawList()->AddText(at, ImGui::GetColorU32(ImGuiCol_Text), cell.c_str());
    at.x += float(cellWidth);
  }
  return clicked;
}

void Ui::text(const std::string& line, bool soft) {
  if (soft)
    ImGui::TextDisabled("%s", line.c_str());
  else
    ImGui::TextUnformatted(line.c_str());
}

void Ui::facts(std::span<const std::pair<std::string, std::string>> rows) {
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {6, 1});
  for (const auto& [name, value] : rows) {
    ImGui::TextDisabled("%s", name.c_str());
    ImGui::SameLine(ImGui::GetWindowContentRegionMax().x - ImGui::CalcTextSize(value.c_str()).x);
    ImGui::TextUnformatted(value.c_str());
  }
  ImGui::PopStyleVar();
}

void Ui::progress(const std::string& path, const std::string& task, double fraction) {
  ImGui::ProgressBar(float(fraction), {-1, 0}, task.c_str());
  note(path);
}

}  // namespace hpsdf::app
