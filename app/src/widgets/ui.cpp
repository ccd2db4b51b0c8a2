#include "widgets/ui.h"

#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>

#include "hpsdf/render/font.h"
#include "widgets/raster.h"

namespace hpsdf::app {
namespace {

constexpr float kTextSize = 13;     // points per em
constexpr float kStep = 1.0F / 60;  // assumed seconds per frame; no clock is read
constexpr ImGuiPopupFlags kAnyPopup = ImGuiPopupFlags_AnyPopupId | ImGuiPopupFlags_AnyPopupLevel;

struct NamedKey {
  std::string_view name;
  Key key;
  ImGuiKey code;
};
const ImVec4 kAccent(0.20F, 0.36F, 0.62F, 1), kProblemInk(0.62F, 0.18F, 0.06F, 1);
constexpr NamedKey kKeys[] = {{"enter", Key::enter, ImGuiKey_Enter},
                              {"escape", Key::escape, ImGuiKey_Escape},
                              {"backspace", Key::backspace, ImGuiKey_Backspace},
                              {"delete", Key::remove, ImGuiKey_Delete},
                              {"left", Key::left, ImGuiKey_LeftArrow},
                              {"right", Key::right, ImGuiKey_RightArrow},
                              {"up", Key::up, ImGuiKey_UpArrow},
                              {"down", Key::down, ImGuiKey_DownArrow},
                              {"home", Key::home, ImGuiKey_Home},
                              {"end", Key::end, ImGuiKey_End},
                              {"tab", Key::tab, ImGuiKey_Tab},
                              {"space", Key::space, ImGuiKey_Space},
                              {"f1", Key::f1, ImGuiKey_COUNT},  // Dear ImGui has no name for it
                              {"a", Key::a, ImGuiKey_A},
                              {"c", Key::c, ImGuiKey_C},
                              {"o", Key::o, ImGuiKey_COUNT},  // Dear ImGui has no name for it
                              {"s", Key::s, ImGuiKey_COUNT},
                              {"v", Key::v, ImGuiKey_V},
                              {"x", Key::x, ImGuiKey_X},
                              {"y", Key::y, ImGuiKey_Y},
                              {"z", Key::z, ImGuiKey_Z}};

ImVec4 gray(float value, float alpha = 1) { return {value, value, value * 1.01F, alpha}; }

void setStyle() {
  ImGui::StyleColorsLight();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowPadding = {10, 5};
  style.WindowMinSize = {1, 1};  // the bar must not cover the upper rows of the picture
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
  set(ImGuiCol_CheckMark, kAccent);
  set(ImGuiCol_SliderGrab, {0.74F, 0.82F, 0.93F, 1});
  set(ImGuiCol_SliderGrabActive, kAccent);
  set(ImGuiCol_PlotHistogram, {0.45F, 0.58F, 0.78F, 1});
  set(ImGuiCol_Separator, gray(0.86F));
  set(ImGuiCol_ScrollbarBg, gray(0.94F));
}

UiRect rectOf(const ImVec2& low, const ImVec2& high) { return {low.x, low.y, high.x, high.y}; }
/// Blurs the edges of lines over a pixel, not over a point.
void sharpen(ImDrawList& list, double scale) { list._FringeScale = 1 / float(scale); }

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

std::string fittingEnd(const std::string& text, double width) {
  if (ImGui::CalcTextSize(text.c_str()).x <= width) return text;
  std::string end = text;
  do {
    end.erase(0, 1);
    while (end.size() > 1 && (static_cast<unsigned char>(end[0]) & 0xc0) == 0x80) end.erase(0, 1);
  } while (end.size() > 1 && ImGui::CalcTextSize(("…" + end).c_str()).x > width);
  return "…" + end;
}

struct Ui::State {
  ImGuiContext* context = nullptr;
  Coverage texture;
  bool disabled = false;
  bool frozen = false;
  std::string clipboard;
  std::string idText;
  std::pair<std::string, double> held;        ///< path and value of a held slider that reports its value on release
  std::map<std::string, std::string> drafts;  ///< paths of the text fields that are being edited, and their texts
  std::optional<Key> key;                     ///< key that was pressed in this frame for the control with the focus
  bool focusMoved = false;                    ///< the focus has moved in this frame
  double scrollBy = 0;  ///< distance by which a column must scroll to show the control with the focus
  struct Tip {
    std::string text;
    UiRect widget, column;  ///< the widget with its label, and the column that it stands in
  };
  std::optional<Tip> hovered, chosen;  ///< tooltips of the widget under the pointer and of the one with the focus
};

Ui::Ui() : state_(std::make_unique<State>()) {
  state_->context = ImGui::CreateContext();
  ImGuiIO& io = activate();
  io.IniFilename = nullptr;
  io.LogFilename = nullptr;
  io.ConfigInputTextCursorBlink = false;
  io.MouseDoubleClickTime = 0;  // fast clicks of a script must not become double clicks
  io.MouseDrawCursor = false;
  for (const NamedKey& known : kKeys)
    if (known.code != ImGuiKey_COUNT) io.KeyMap[known.code] = static_cast<int>(known.key);
  io.ClipboardUserData = &state_->clipboard;
  io.SetClipboardTextFn = [](void* clipboard, const char* text) { *static_cast<std::string*>(clipboard) = text; };
  io.GetClipboardTextFn = [](void* clipboard) { return static_cast<std::string*>(clipboard)->c_str(); };
  setStyle();
  setScale(1);
}

/// Makes the font atlas for a number of pixels per point. Dear ImGui counts in points; its glyphs have the size that
/// they will have in pixels, so that text is crisp.
void Ui::setScale(double scale) {
  if (scale == scale_) return;
  scale_ = scale;
  ImGuiIO& io = activate();
  io.Fonts->Clear();
  ImGui::GetStyle().AntiAliasedLinesUseTex = scale == 1;  // only glyphs may have a texture where they are moved

  // Ranges of the characters that the font atlas contains: Latin, Greek, dashes, dots, arrows, ∇, −, ≤, ≥.
  static const ImWchar ranges[] = {0x20,   0x7e,   0xa0,   0xff,   0x391,  0x3c9,  0x2013, 0x2014, 0x2026, 0x2026,
                                   0x2190, 0x2193, 0x2207, 0x2207, 0x2212, 0x2212, 0x2264, 0x2265, 0};
  ImFontConfig config;
  config.FontDataOwnedByAtlas = false;
  config.OversampleH = 1;
  config.PixelSnapH = true;
  const auto font = render::dejavuSans();
  // The const_cast is safe: the atlas only reads the font, which it does not own.
  ImFont* const added =
      io.Fonts->AddFontFromMemoryTTF(const_cast<unsigned char*>(font.data()), static_cast<int>(font.size()),
                                     kTextSize * float(scale), &config, ranges);
  added->Scale = 1 / float(scale);
  unsigned char* texels = nullptr;
  Coverage& texture = state_->texture;
  io.Fonts->GetTexDataAsAlpha8(&texels, &texture.width, &texture.height);
  texture.texels.assign(texels, texels + std::size_t(texture.width) * texture.height);
}

Ui::~Ui() { ImGui::DestroyContext(state_->context); }

void Ui::frame(const FrameSize& size, const Input* input, const std::function<void()>& widgets) {
  setScale(size.scale);
  ImGuiIO& io = activate();
  io.DisplaySize = {float(size.width / scale_), float(size.height / scale_)};
  io.DeltaTime = kStep;
  io.MouseWheel = 0;
  if (input != nullptr) {
    const Input& event = *input;
    takeKey(event);
    io.KeyCtrl = event.control;
    io.KeyShift = event.shift;
    if (event.kind == Input::Kind::move) pointer_ = event.at;
    if (event.kind == Input::Kind::press) io.MouseDown[event.button] = true;
    if (event.kind == Input::Kind::release) io.MouseDown[event.button] = false;
    if (event.kind == Input::Kind::wheel) io.MouseWheel = float(event.turn);
    if (event.kind == Input::Kind::type) io.AddInputCharactersUTF8(event.text.c_str());
    if (event.kind == Input::Kind::key && event.key != Key::tab) io.KeysDown[static_cast<int>(event.key)] = true;
  }
  io.MousePos = {float(pointer_[0] / scale_), float(pointer_[1] / scale_)};
  widgets_.clear();
  order_.clear();
  state_->hovered.reset();
  state_->chosen.reset();
  event_ = input;
  const auto end = [&] {
    std::erase_if(state_->drafts, [&](const auto& draft) { return !widgets_.contains(draft.first); });
    state_->key.reset();
    state_->focusMoved = false;
    help_.clear();
    event_ = nullptr;
    ImGui::Render();
    if (input != nullptr && input->kind == Input::Kind::key) io.KeysDown[static_cast<int>(input->key)] = false;
    if (input == nullptr || input->kind != Input::Kind::press) io.KeyCtrl = io.KeyShift = false;
  };
  ImGui::NewFrame();
  for (ImDrawList* const list : {ImGui::GetBackgroundDrawList(), ImGui::GetForegroundDrawList()})
    sharpen(*list, scale_);
  try {
    widgets();
  } catch (...) {
    state_->disabled = false;
    ImGui::ErrorCheckEndFrameRecover(nullptr);  // closes windows and groups that the exception left open
    end();
    throw;
  }
  drawTip();
  end();
}

void Ui::takeKey(const Input& input) {
  if (input.kind == Input::Kind::press) clearFocus();
  if (input.kind != Input::Kind::key || input.control) return;
  if (input.key == Key::tab) return moveFocus(input.shift ? -1 : 1);
  if (editing() || (input.key == Key::escape && ImGui::IsPopupOpen(nullptr, kAnyPopup))) return;
  if (input.key == Key::escape) clearFocus();
  if (!focus_.empty()) state_->key = input.key;
}

void Ui::moveFocus(int step) {
  if (editing()) ImGui::ClearActiveID();
  if (order_.empty()) return;
  const auto count = std::ptrdiff_t(order_.size());
  const auto found = std::ranges::find(order_, focus_.empty() ? pressed_ : focus_) - order_.begin();
  const auto from = found < count ? found : step > 0 ? -1 : count;
  focus_ = order_[std::size_t((from + step + count) % count)];
  pressed_.clear();
  state_->focusMoved = true;
}

/// Lets Tab go on from the control if the mouse presses it in this frame.
void Ui::notePress(const std::string& path, bool hovered) {
  if (hovered && event_ != nullptr && event_->kind == Input::Kind::press) pressed_ = path;
}

bool Ui::pressedByKey(const std::string& path) const {
  return path == focus_ && !state_->disabled && (state_->key == Key::enter || state_->key == Key::space);
}

bool Ui::isKey(Key key) const { return event_ != nullptr && event_->kind == Input::Kind::key && event_->key == key; }

int Ui::stepByKey(const std::string& path) const {
  if (path != focus_ || state_->disabled || !state_->key) return 0;
  if (state_->key == Key::right || state_->key == Key::down) return 1;
  return state_->key == Key::left || state_->key == Key::up ? -1 : 0;
}

void Ui::hideTip() {
  state_->hovered.reset();
  state_->chosen.reset();
}

/// Draws a tooltip: beside the column of its widget, or else below or above the widget. It covers neither the widget
/// nor, unless there is no other place, other widgets of the column.
void Ui::drawTip() {
  const auto& tip = state_->chosen ? state_->chosen : state_->hovered;
  if (!tip || tip->text.empty() || holds(0) || holds(1) || holds(2)) return;
  if (ImGui::IsPopupOpen(nullptr, kAnyPopup)) return;
  const auto [width, height] = ImGui::GetIO().DisplaySize;
  const float em = ImGui::GetFontSize(), pad = 0.5F * em, gap = 0.4F * em;
  const float wrap = 22 * em;
  const ImVec2 text = ImGui::CalcTextSize(tip->text.c_str(), nullptr, false, wrap);
  const float w = text.x + 2 * pad, h = text.y + 2 * pad;
  const UiRect &item = tip->widget, &column = tip->column;
  ImVec2 at(std::clamp(float(item.x0), 0.0F, std::max(0.0F, width - w)),
            std::clamp(float(item.y0), 0.0F, std::max(0.0F, height - h)));
  if (float(column.x1) + gap + w <= width)
    at.x = float(column.x1) + gap;
  else if (float(column.x0) - gap - w >= 0)
    at.x = float(column.x0) - gap - w;
  else if (float(item.y1) + gap + h <= height)
    at.y = float(item.y1) + gap;
  else if (float(item.y0) - gap - h >= 0)
    at.y = float(item.y0) - gap - h;
  else
    return;  // the frame has no room
  at = {std::round(at.x), std::round(at.y)};
  ImDrawList& list = *ImGui::GetForegroundDrawList();
  list.AddRectFilled(at, {at.x + w, at.y + h}, IM_COL32(40, 43, 54, 245), 0.25F * em);
  list.AddText(ImGui::GetFont(), em, {at.x + pad, at.y + pad}, IM_COL32(245, 245, 242, 255), tip->text.c_str(), nullptr,
               wrap);
}

void Ui::paint(render::Image& image) const {
  activate();
  app::paint(image, *ImGui::GetDrawData(), state_->texture, scale_);
}

ImGuiIO& Ui::activate() const {
  ImGui::SetCurrentContext(state_->context);
  return ImGui::GetIO();
}

bool Ui::wantsMouse() const { return activate().WantCaptureMouse; }
bool Ui::busy() const { return holds(0) || holds(1) || holds(2) || ImGui::IsAnyItemActive(); }
bool Ui::holds(int button) const { return activate().MouseDown[button]; }
bool Ui::editing() const {
  activate();
  return ImGui::GetActiveID() != 0 && ImGui::GetInputTextState(ImGui::GetActiveID()) != nullptr;
}

void Ui::cancelPress() {
  activate();
  ImGui::ClearActiveID();
}

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
  sharpen(*ImGui::GetWindowDrawList(), scale_);
  const bool isByUser = ImGui::GetIO().MouseWheel != 0 || ImGui::IsMouseDown(0);
  const double scrolledTo = isByUser ? double(ImGui::GetScrollY()) : scroll;
  if (std::abs(ImGui::GetScrollY() - scrolledTo) > 0.5) ImGui::SetScrollY(float(scrolledTo));  // at the next frame
  enable(true);
  state_->scrollBy = 0;
  content();
  setDisabled(false);
  const double most = ImGui::GetScrollMaxY();
  const double now = std::clamp(std::min(scrolledTo, most) + state_->scrollBy, 0.0, most);
  ImGui::End();
  return now;
}

void Ui::note(const std::string& path, bool takesText, std::optional<double> from) {
  const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
  const ImVec2 labelled(from ? float(*from) : low.x, low.y);
  const UiRect rect = visiblePart(low, high);
  widgets_[path] = {.rect = rect.times(scale_), .enabled = !state_->disabled, .takesText = takesText, .help = help_};
  const ImGuiWindow& window = *ImGui::GetCurrentWindow();
  const UiRect column = rectOf(window.Pos, {window.Pos.x + window.Size.x, window.Pos.y + window.Size.y});
  const bool hovered = ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled) ||
                       (ImGui::IsWindowHovered() && ImGui::IsMouseHoveringRect(labelled, high));
  if (hovered) state_->hovered = {help_, rectOf(labelled, high), column};
  if (!state_->disabled) order_.push_back(path);
  if (!state_->disabled) notePress(path, hovered);
  if (path == focus_ && !state_->disabled) {
    state_->chosen = {help_, rectOf(labelled, high), column};
    ImGui::GetWindowDrawList()->AddRect({low.x - 1, low.y - 1}, {high.x + 1, high.y + 1}, ImGui::GetColorU32(kAccent),
                                        ImGui::GetStyle().FrameRounding, 0, 2);
    const double room = 0.5 * ImGui::GetFontSize(), top = window.InnerRect.Min.y, bottom = window.InnerRect.Max.y;
    if (state_->focusMoved && high.y + room > bottom) state_->scrollBy = high.y + room - bottom;
    if (state_->focusMoved && low.y - room < top) state_->scrollBy = low.y - room - top;
  }
  help_.clear();
}

bool Ui::addControl(const std::string& path, const UiRect& rect, std::string help) {
  const bool over = !wantsMouse() && rect.contains(pointerInPoints()[0], pointerInPoints()[1]);
  if (over) state_->hovered = {help, rect, rect};
  if (path == focus_) state_->chosen = {help, rect, rect};
  widgets_[path] = {.rect = rect.times(scale_), .enabled = !state_->frozen, .help = std::move(help)};
  if (!state_->frozen) order_.push_back(path);
  if (!state_->frozen) notePress(path, over);
  return !state_->frozen && pressedByKey(path);
}

double Ui::label(const char* text) {
  const double from = ImGui::GetCursorScreenPos().x;
  if (*text != '\0') {
    const float width = ImGui::CalcTextSize(text).x, left = 0.42F * ImGui::GetContentRegionAvail().x;
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(text);
    ImGui::SameLine(0, std::max(left - width, ImGui::GetStyle().ItemInnerSpacing.x));
  }
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
  return from;
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

bool Ui::heading(const std::string& path, const char* label, bool unfolded) {
  const float em = ImGui::GetFontSize(), height = ImGui::GetFrameHeight();
  const bool isFirst = ImGui::GetCursorPosY() <= ImGui::GetWindowContentRegionMin().y + 0.5F;
  if (!isFirst) ImGui::Dummy({0, 0.2F * em});
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const bool pressed = ImGui::InvisibleButton(id(path, ""), {ImGui::GetContentRegionAvail().x, height});
  const ImVec2 to = ImGui::GetItemRectMax();
  const ImGuiCol color = ImGui::IsItemHovered() ? ImGuiCol_HeaderHovered : ImGuiCol_Separator;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddRectFilled(from, to, ImGui::GetColorU32(color), ImGui::GetStyle().FrameRounding);
  const float y = from.y + 0.5F * (height - em);
  const ImU32 ink = ImGui::GetColorU32(ImGuiCol_Text);
  ImGui::RenderArrow(&list, {from.x + 0.3F * em, y + 0.1F * em}, ink, unfolded ? ImGuiDir_Down : ImGuiDir_Right, 0.8F);
  list.AddText({from.x + 1.5F * em, y}, ink, label);
  note(path);
  return pressed || pressedByKey(path);
}

bool Ui::button(const std::string& path, const char* label, bool pressed, double width) {
  if (pressed) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_Header));
  const bool clicked = ImGui::Button(id(path, label), {float(width), 0});
  if (pressed) ImGui::PopStyleColor();
  note(path);
  return clicked || pressedByKey(path);
}

std::optional<bool> Ui::checkbox(const std::string& path, const char* label, bool value) {
  const bool byKey = pressedByKey(path);
  bool changed = ImGui::Checkbox(id(path, label), &value);
  if (byKey) {
    changed = true;
    value = !value;
  }
  note(path);
  return changed ? std::optional(value) : std::nullopt;
}

std::optional<std::string> Ui::combo(const std::string& path, const char* text, std::span<const std::string> items,
                                     const std::string& current) {
  std::optional<std::string> chosen;
  const auto found = std::ranges::find(items, current);
  const auto now = found == items.end() ? 0 : found - items.begin();
  const std::string& shown = items[std::size_t(now)];
  const double from = label(text);
  const bool open = ImGui::BeginCombo(id(path, ""), shown.c_str(), ImGuiComboFlags_HeightLargest);
  note(path, false, from);
  const auto count = std::ptrdiff_t(items.size());
  if (pressedByKey(path)) chosen = items[std::size_t((now + 1) % count)];
  if (const int step = stepByKey(path))
    chosen = items[std::size_t(std::clamp(now + step, std::ptrdiff_t{0}, count - 1))];
  if (!open) return chosen == shown ? std::nullopt : chosen;
  sharpen(*ImGui::GetWindowDrawList(), scale_);
  for (const std::string& item : items) {
    const std::string itemPath = path + "/" + item;
    if (ImGui::Selectable(id(itemPath, item.c_str()), item == shown)) chosen = item;
    note(itemPath);
    if (pressed_ == itemPath) pressed_ = path;  // the entry is gone once it is chosen
    if (!pressedByKey(itemPath)) continue;
    chosen = item;
    ImGui::CloseCurrentPopup();
  }
  if (isKey(Key::escape)) ImGui::CloseCurrentPopup();
  ImGui::EndCombo();
  return chosen;
}

/// Begins to type into the widget that was drawn last, at the next frame.
void Ui::typeInto(const std::string& path, bool atOnce) {
  const bool wanted = state_->key == Key::enter || (atOnce && state_->focusMoved);
  if (path != focus_ || state_->disabled || !wanted) return;
  ImGuiContext& context = *ImGui::GetCurrentContext();
  context.NavNextActivateId = ImGui::GetItemID();
  context.NavNextActivateFlags = ImGuiActivateFlags_PreferInput;
}

std::optional<double> Ui::slider(const std::string& path, const char* text, double value, double low, double high,
                                 const char* format, When when) {
  const double before = value, from = label(text);
  if (when == When::released && state_->held.first == path) value = state_->held.second;
  bool changed = ImGui::SliderScalar(id(path, ""), ImGuiDataType_Double, &value, &low, &high, format);
  if (when == When::released) {
    if (ImGui::IsItemActive()) state_->held = {path, value};
    changed = ImGui::IsItemDeactivatedAfterEdit();
    if (changed) value = state_->held.second;
    if (!ImGui::IsItemActive() && state_->held.first == path) state_->held = {};
  }
  if (const int step = stepByKey(path)) {
    const bool whole = std::string_view(format).starts_with("%.0f");
    value = std::clamp(value + step * (whole ? 1 : (high - low) / 100), low, high);
    changed = true;
  }
  typeInto(path, false);
  note(path, true, from);
  return changed && value != before ? std::optional(value) : std::nullopt;
}

std::optional<std::string> Ui::field(const std::string& path, const char* text, const std::string& value) {
  std::array<char, 1024> buffer{};
  value.copy(buffer.data(), buffer.size() - 1);
  const double from = label(text);
  const ImVec2 padding = ImGui::GetStyle().FramePadding;
  const std::string end = fittingEnd(value, ImGui::CalcItemWidth() - 2 * padding.x);
  const bool isCut = end != value && ImGui::GetActiveID() != ImGui::GetID(id(path, ""));
  if (isCut) ImGui::PushStyleColor(ImGuiCol_Text, {0, 0, 0, 0});
  const bool entered = ImGui::InputText(id(path, ""), buffer.data(), buffer.size(),
                                        ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_AutoSelectAll);
  if (isCut) {
    ImGui::PopStyleColor();
    const ImVec2 corner = ImGui::GetItemRectMin();
    ImGui::GetWindowDrawList()->AddText({corner.x + padding.x, corner.y + padding.y}, ImGui::GetColorU32(ImGuiCol_Text),
                                        end.c_str());
  }
  std::optional<std::string> result;
  if (ImGui::IsItemActive()) {
    state_->drafts[path] = buffer.data();
  } else if (const auto draft = state_->drafts.extract(path); !draft.empty() && !state_->disabled) {
    if (!isKey(Key::escape)) result = entered ? std::string(buffer.data()) : draft.mapped();
  }
  typeInto(path, true);
  note(path, true, from);
  return result == value ? std::nullopt : result;
}

void Ui::entry(const std::string& path, std::string& text, bool focus) {
  std::array<char, 1024> buffer{};
  text.copy(buffer.data(), buffer.size() - 1);
  ImGui::SetNextItemWidth(-1);
  if (focus) {
    ImGui::ClearActiveID();  // a field that has the keyboard ignores another text
    ImGui::SetKeyboardFocusHere();
  }
  ImGui::InputText(id(path, ""), buffer.data(), buffer.size(), ImGuiInputTextFlags_AutoSelectAll);
  note(path, true);
  // As with a slider, what is typed after a Ctrl+click replaces the text.
  if (ImGui::IsItemClicked() && ImGui::GetIO().KeyCtrl)
    if (ImGuiInputTextState* const state = ImGui::GetInputTextState(ImGui::GetItemID())) state->SelectAll();
  text = buffer.data();
}

bool Ui::item(const std::string& path, const char* label, bool selected) {
  const bool clicked = ImGui::Selectable(id(path, label), selected);
  note(path);
  return clicked || pressedByKey(path);
}

void Ui::list(const char* name, double height, const std::function<void()>& content) {
  ImGui::BeginChild(name, {0, float(height)}, true);
  sharpen(*ImGui::GetWindowDrawList(), scale_);
  content();
  ImGui::EndChild();
}

void Ui::overlay(const char* name, const UiRect& box, const std::function<void()>& content) {
  ImGui::SetNextWindowPos({0, 0});
  ImGui::SetNextWindowSize(ImGui::GetIO().DisplaySize);
  ImGui::PushStyleColor(ImGuiCol_WindowBg, {0.1F, 0.11F, 0.14F, 0.3F});
  ImGui::Begin(name, nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings);
  ImGui::PopStyleColor();
  ImGui::SetCursorPos({float(box.x0), float(box.y0)});
  ImGui::PushStyleColor(ImGuiCol_ChildBg, ImGui::GetStyleColorVec4(ImGuiCol_PopupBg));
  ImGui::BeginChild("box", {float(box.width()), float(box.height())}, true, ImGuiWindowFlags_NoScrollbar);
  ImGui::PopStyleColor();
  sharpen(*ImGui::GetWindowDrawList(), scale_);
  content();
  ImGui::EndChild();
  ImGui::End();
}

bool Ui::row(const std::string& path, std::span<const std::string> cells, std::span<const double> columns) {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const bool clicked = ImGui::Selectable(id(path, ""));
  note(path);
  const float digit = ImGui::CalcTextSize("0").x;
  for (std::size_t i = 0; i < cells.size(); ++i)
    ImGui::GetWindowDrawList()->AddText({std::round(at.x + digit * float(columns[i])), at.y},
                                        ImGui::GetColorU32(ImGuiCol_Text), cells[i].c_str());
  return clicked || pressedByKey(path);
}

bool Ui::place(const std::string& path, double width, double height, bool chosen) {
  const bool clicked = ImGui::InvisibleButton(id(path, ""), {float(width), float(height)});
  const bool isOver = ImGui::IsItemHovered();
  if (chosen || isOver)
    ImGui::GetWindowDrawList()->AddRect(ImGui::GetItemRectMin(), ImGui::GetItemRectMax(), ImGui::GetColorU32(kAccent),
                                        ImGui::GetStyle().FrameRounding, 0, chosen ? 2.0F : 1.0F);
  note(path);
  return clicked || pressedByKey(path);
}

void Ui::text(const std::string& line, bool soft) {
  if (soft)
    ImGui::TextDisabled("%s", line.c_str());
  else
    ImGui::TextUnformatted(line.c_str());
}

void Ui::problem(const std::string& line) {
  ImGui::PushStyleColor(ImGuiCol_Text, kProblemInk);
  text(line);
  ImGui::PopStyleColor();
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

void Ui::progress(const std::string& path, const std::string& task, double fraction, double room) {
  ImGui::ProgressBar(float(fraction), {-1 - float(room), 0}, task.c_str());
  addArea(path, visiblePart(ImGui::GetItemRectMin(), ImGui::GetItemRectMax()));
  widgets_[path].enabled = !state_->disabled;
}

}  // namespace hpsdf::app
