#pragma once
// The panels' widgets: Dear ImGui without a window, its input written down event by event, every widget with a path by
// which scripts find it. Nothing depends on the clock.

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

namespace hpsdf::app {

enum class Key : std::uint8_t { enter, escape, backspace, remove, left, right, home, end, tab, a, c, v, x, y, z };

/// "enter", "escape", …, as scripts spell them.
std::vector<std::string> keyNames();
std::optional<Key> keyNamed(std::string_view name);

/// What a person does with mouse or keyboard.
struct Input {
  enum class Kind : std::uint8_t { move, press, release, wheel, type, key } kind = Kind::move;
  std::array<double, 2> at = {};  ///< of move: pixels from the upper left
  int button = 0;                 ///< of press and release: 0 left, 1 right, 2 middle
  double turn = 0;                ///< of wheel: notches, away from the person
  std::string text = {};          ///< of type: UTF-8
  Key key = Key::enter;           ///< of key: pressed and let go
  bool control = false;           ///< held down; of press, release, wheel and key
  bool shift = false;
};

/// Pixels of a frame, half-open.
struct UiRect {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool contains(double x, double y) const { return x >= x0 && x < x1 && y >= y0 && y < y1; }
  double width() const { return x1 - x0; }
  double height() const { return y1 - y0; }
};

/// Where a widget stands in the last frame.
struct Widget {
  UiRect rect;             ///< the part of it that is not scrolled away or covered by its column's ends
  bool enabled = true;     ///< takes input
  bool takesText = false;  ///< a field or a slider
};

/// When a slider asks: at each movement, or once it is let go.
enum class When : std::uint8_t { moved, released };

class Ui {
 public:
  Ui();
  ~Ui();
  Ui(const Ui&) = delete;
  Ui& operator=(const Ui&) = delete;

  /// One frame of width × height pixels: `input` happens, then `widgets` calls the functions below. What it throws
  /// goes on, with the frame ended.
  void frame(int width, int height, const Input* input, const std::function<void()>& widgets);

  /// Paints the last frame over a picture of its size.
  void paint(render::Image& image) const;

  /// Of the last frame.
  const std::map<std::string, Widget>& widgets() const { return widgets_; }
  std::array<double, 2> pointer() const { return pointer_; }
  /// Whether the pointer is over a panel, or a widget holds the mouse.
  bool wantsMouse() const;
  /// Whether a button is down or a widget is being edited: changes belong to one gesture.
  bool busy() const;
  bool holds(int button) const;
  bool editing() const;
  const std::string& clipboard() const;
  void setClipboard(const std::string& text);

  // Within `widgets`. A path is panel/name; the label may be empty. Each gives what the person asked for in this frame.

  /// A panel's background at a fixed place; calls `content` within. `scroll`: how far it is scrolled, pixels; nothing
  /// where it never is. Gives how far it is scrolled now.
  double column(const char* name, const UiRect& rect, std::optional<double> scroll,
                const std::function<void()>& content);
  bool heading(const std::string& path, const char* label);
  bool button(const std::string& path, const char* label, bool pressed = false);
  std::optional<bool> checkbox(const std::string& path, const char* label, bool value);
  std::optional<int> combo(const std::string& path, const char* label, std::span<const std::string> items, int current);
  std::optional<double> slider(const std::string& path, const char* label, double value, double low, double high,
                               const char* format = "%.4g", When when = When::moved);
  /// A text that counts when Enter is pressed.
  std::optional<std::string> field(const std::string& path, const char* label, const std::string& value);
  bool row(const std::string& path, std::span<const std::string> cells, double cellWidth);
  void text(const std::string& line, bool soft = false);
  void facts(std::span<const std::pair<std::string, std::string>> rows);
  void progress(const std::string& path, const std::string& task, double fraction);
  void enable(bool enabled);  ///< until the next call
  /// From now on nothing is enabled, whatever `enable` says.
  void freeze(bool frozen);

  /// Of a place that is drawn by other means.
  void place(const std::string& path, const UiRect& rect) { widgets_[path] = {rect, true}; }

 private:
  void note(const std::string& path, bool takesText = false);
  void setDisabled(bool disabled);
  const char* id(const std::string& path, const char* label);

  struct State;
  std::unique_ptr<State> state_;
  std::map<std::string, Widget> widgets_;
  std::array<double, 2> pointer_ = {-1, -1};
};

}  // namespace hpsdf::app
