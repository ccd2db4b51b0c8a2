#pragma once
// The widgets of the panels, drawn with Dear ImGui without a window. Input arrives as single events. Every
// widget has a path by which scripts find the widget, and the keyboard reaches every control. Nothing depends on the
// clock.

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "console/console.h"
#include "hpsdf/render/image.h"

struct ImGuiIO;

namespace hpsdf::app {

enum class Key : std::uint8_t {
  enter,
  escape,
  backspace,
  remove,
  left,
  right,
  up,
  down,
  home,
  end,
  tab,
  space,
  f1,
  a,
  c,
  o,
  s,
  v,
  x,
  y,
  z
};

/// Returns the names of all keys as scripts spell them: "enter", "escape", ….
std::vector<std::string> keyNames();
std::optional<Key> keyNamed(std::string_view name);

/// The size of a frame.
struct FrameSize {
  int width, height;  ///< pixels
  double scale = 1;   ///< pixels per point, the unit of text and widgets
};

/// One mouse or keyboard event.
struct Input {
  enum class Kind : std::uint8_t { move, press, release, wheel, type, key } kind = Kind::move;
  std::array<double, 2> at = {};  ///< for move: new position, pixels from the upper left
  int button = 0;                 ///< for press and release: 0 left, 1 right, 2 middle
  double turn = 0;                ///< for wheel: number of notches, positive if turned away from the user
  std::string text = {};          ///< for type: the typed text in UTF-8
  Key key = Key::enter;           ///< for key: the key that is pressed and released
  bool control = false;           ///< for press, release, wheel and key: Ctrl is held
  bool shift = false;             ///< for press, release, wheel and key: Shift is held
};

/// A rectangle of a frame in pixels or points: x in [x0, x1), y in [y0, y1).
struct UiRect {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool contains(double x, double y) const { return x >= x0 && x < x1 && y >= y0 && y < y1; }
  double width() const { return x1 - x0; }
  double height() const { return y1 - y0; }
  UiRect times(double factor) const { return {x0 * factor, y0 * factor, x1 * factor, y1 * factor}; }
};

/// A widget of the last frame: its rectangle and the input that it takes.
struct Widget {
  UiRect rect;             ///< visible part, pixels; empty if the widget is scrolled out of its column
  bool enabled = true;     ///< false while the widget takes no input
  bool takesText = false;  ///< true for text fields and sliders
  bool isControl = true;   ///< false for areas and displays, which the keyboard does not reach
  std::string help = {};   ///< text of the tooltip
};

/// Returns the end of a text, so much as fits into a width in points. Must be called within `Ui::frame`.
std::string fittingEnd(const std::string& text, double width);

/// When a slider returns its value: at each movement, or once it is released.
enum class When : std::uint8_t { moved, released };

class Ui {
 public:
  Ui();
  ~Ui();
  Ui(const Ui&) = delete;
  Ui& operator=(const Ui&) = delete;

  /// Makes one frame. Handles the event `input` unless it is null, then calls
  /// `widgets`, which draws all widgets by calling the functions below. An exception that `widgets` throws is
  /// passed on after the frame has been completed.
  void frame(const FrameSize& size, const Input* input, const std::function<void()>& widgets);

  /// Paints the widgets of the last frame over a picture that has the size of this frame.
  void paint(render::Image& image) const;

  /// Returns the widgets of the last frame by their paths, such as "bar/undo".
  const std::map<std::string, Widget>& widgets() const { return widgets_; }
  /// Returns the position of the mouse pointer, pixels.
  std::array<double, 2> pointer() const { return pointer_; }
  /// True if the mouse pointer is over a panel, or if a widget has captured the mouse.
  bool wantsMouse() const;
  /// True while a mouse button is down or a widget is being edited. All changes during this time belong to one
  /// gesture.
  bool busy() const;
  bool holds(int button) const;
  /// True while a text is being typed.
  bool editing() const;
  /// The path of the control that the keyboard has chosen, or "". Tab and Shift+Tab move on to the next and the
  /// previous control; then Enter and Space press it, arrows change a slider or a list, Enter begins to type into a
  /// slider. A press of the mouse and Escape end the choice. After a press of a control, Tab goes on from there.
  const std::string& focus() const { return focus_; }
  void clearFocus() {
    focus_.clear();
    pressed_.clear();
  }
  /// Lets go of the control that the mouse has pressed, which then does nothing when the button is released.
  void cancelPress();
  /// Returns the event that the present frame handles, or nullptr.
  const Input* event() const { return event_; }
  const std::string& clipboard() const;
  void setClipboard(const std::string& text);

  // The following functions draw widgets. Only the function `widgets`, the argument of `frame`, may call them. Each
  // function returns the change that the user made in this frame. A path has the form panel/name. A label may be empty;
  // it stands on the left of the widget. Sizes and positions are in points.

  /// Sets the tooltip of the next widget. A tooltip is shown beside its column while the pointer rests on the widget
  /// and no mouse button is down, and for the control that the keyboard has chosen.
  void help(std::string text) { help_ = std::move(text); }
  /// Hides the tooltip of this frame, because something else lies over the frame.
  void hideTip();

  /// Draws the background of a panel and calls `content` to fill the panel. `scroll` is the scroll position in
  /// points, or std::nullopt for a panel that never scrolls. Returns the new scroll position.
  double column(const char* name, const UiRect& rect, std::optional<double> scroll,
                const std::function<void()>& content);
  /// Draws the heading of a section that is unfolded or folded. Returns true if it was pressed.
  bool heading(const std::string& path, const char* label, bool unfolded);
  bool button(const std::string& path, const char* label, bool pressed = false, double width = 0);
  std::optional<bool> checkbox(const std::string& path, const char* label, bool value);
  /// Draws a list of the names `items`. If `current` is not one of these names, the list shows the first name.
  std::optional<std::string> combo(const std::string& path, const char* label, std::span<const std::string> items,
                                   const std::string& current);
  std::optional<double> slider(const std::string& path, const char* label, double value, double low, double high,
                               const char* format = "%.4g", When when = When::moved);
  /// Draws a text field. While it is not edited, it shows the end of a text that is too long, which names the file of a
  /// path. Returns its text, if it was changed, when Enter is pressed and when the field loses the
  /// keyboard otherwise than by Escape, which discards the text.
  std::optional<std::string> field(const std::string& path, const char* label, const std::string& value);
  /// Draws a text field that changes `text` as the user types. If `focus` is true, it gets the keyboard, and what is
  /// typed replaces the text.
  void entry(const std::string& path, std::string& text, bool focus);
  /// Draws an entry of a list. Returns true if it is clicked.
  bool item(const std::string& path, const char* label, bool selected);
  /// Draws a list that scrolls.
  void list(const char* name, double height, const std::function<void()>& content);
  /// Draws a box over the whole frame, the rest of which is darkened.
  void overlay(const char* name, const UiRect& box, const std::function<void()>& content);
  /// Returns the position of the mouse pointer, points.
  std::array<double, 2> pointerInPoints() const { return {pointer_[0] / scale_, pointer_[1] / scale_}; }
  /// Draws a row of a table, with its cells from `columns` on, measured in widths of a digit.
  bool row(const std::string& path, std::span<const std::string> cells, std::span<const double> columns);
  /// Reserves a rectangle that the caller has drawn or will draw, which can be pressed. A thin frame marks it while the
  /// pointer is over it, and a thicker one if it is `chosen`.
  bool place(const std::string& path, double width, double height, bool chosen);
  void text(const std::string& line, bool soft = false);
  /// Writes why something failed, in a colour of its own.
  void problem(const std::string& line);
  void facts(std::span<const std::pair<std::string, std::string>> rows);
  /// Draws a bar that shows how much of a task is done. `room` is left free on its right.
  void progress(const std::string& path, const std::string& task, double fraction, double room = 0);
  /// Enables or disables all widgets that are drawn after this call.
  void enable(bool enabled);
  /// While `frozen` is true, `enable` cannot enable any widgets.
  void freeze(bool frozen);

  /// Registers a rectangle that no function of this class draws, such as the picture, as a widget, so that
  /// scripts find it by its path.
  void addArea(const std::string& path, const UiRect& rect) {
    widgets_[path] = {.rect = rect.times(scale_), .isControl = false};
  }

  /// Registers a rectangle that no function of this class draws as a control with a tooltip. Returns true if it was
  /// pressed by the keyboard; presses of the mouse are the caller's.
  bool addControl(const std::string& path, const UiRect& rect, std::string help);

 private:
  /// Makes this object's context the current context of Dear ImGui.
  ImGuiIO& activate() const;
  /// Registers the widget that was drawn last. `from` is the left end of its label.
  void note(const std::string& path, bool takesText = false, std::optional<double> from = {});
  /// Draws the label of the next widget. Returns the position of its left end.
  double label(const char* text);
  void typeInto(const std::string& path, bool atOnce);
  void takeKey(const Input& input);
  void moveFocus(int step);
  void notePress(const std::string& path, bool hovered);
  /// True if this key was pressed in this frame.
  bool isKey(Key key) const;
  /// True if the key that was pressed in this frame presses the control.
  bool pressedByKey(const std::string& path) const;
  /// Returns 1 for the keys right and down, -1 for left and up, if they are pressed for this control, otherwise 0.
  int stepByKey(const std::string& path) const;
  void drawTip();
  void setScale(double scale);
  void setDisabled(bool disabled);
  const char* id(const std::string& path, const char* label);

  struct State;
  std::unique_ptr<State> state_;
  std::map<std::string, Widget> widgets_;
  std::vector<std::string> order_;  ///< paths of the controls that take input, in the order in which they are drawn
  std::string focus_;
  std::string pressed_;  ///< the control that the mouse has pressed last, unless the keyboard has chosen another one
  std::string help_;     ///< tooltip of the next widget
  std::array<double, 2> pointer_ = {-1, -1};
  const Input* event_ = nullptr;
  double scale_ = 0;  ///< pixels per point; 0 before the first frame
};

}  // namespace hpsdf::app
