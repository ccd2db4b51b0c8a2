#include "window/window.h"

#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <filesystem>
#include <mutex>

#include "console/error_text.h"
#include "console/interrupt.h"
#include "console/progress_line.h"
#include "explorer/explorer.h"
#include "files/text_file.h"
#include "language/script.h"
#include "session/field_summary.h"
#include "text/text.h"
#include "window/live_work.h"
#include "window/recording.h"

namespace hpsdf::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kPollSeconds = 0.2;     // longest wait for an event, because Ctrl-C does not end a wait
constexpr double kRestSeconds = 0.06;    // time without an event after which a slow picture is drawn in full
constexpr double kStillSeconds = 0.3;    // the same while work runs, which full pictures would slow down
constexpr double kSmoothSeconds = 0.04;  // a picture that takes longer is drawn with fewer pixels while the view moves
constexpr const char* kGuessUp = "camera up=auto";    // files of meshes do not say which axis points up
constexpr int kLeastSize = 64, kGreatestSize = 8192;  // range of frame sizes, pixels

/// Returns the description of GLFW's last error.
std::string glfwProblem() {
  const char* description = nullptr;
  glfwGetError(&description);
  std::string text = description == nullptr ? "no reason given" : description;
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

/// Keeps GLFW initialized during the lifetime of this object.
class Desktop {
 public:
  Desktop() {
    if (!glfwInit())
      throw Error(
          fmt::format("no window can be opened here ({}): set DISPLAY, or draw without a window, by 'hpsdf render' or "
                      "by 'shot' in a script",
                      glfwProblem()));
  }
  ~Desktop() { glfwTerminate(); }
  Desktop(const Desktop&) = delete;
  Desktop& operator=(const Desktop&) = delete;
};

/// A window with an OpenGL context of its own. This context is current only while `show` runs, because the
/// renderer draws in another OpenGL context.
class Screen {
 public:
  Screen(int width, int height, const std::string& title) {
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 0);
    window_ = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
    if (window_ == nullptr)
      throw Error(fmt::format("the window cannot be opened ({}): install the graphics driver, or libgl1-mesa-dri",
                              glfwProblem()));
    glfwSetWindowSizeLimits(window_, kLeastSize, kLeastSize, GLFW_DONT_CARE, GLFW_DONT_CARE);
  }
  ~Screen() { glfwDestroyWindow(window_); }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  GLFWwindow* window() const { return window_; }

  /// Returns the window's size in pixels, or std::nullopt if the window is minimized.
  std::optional<std::array<int, 2>> size() const {
    std::array<int, 2> size{};
    glfwGetFramebufferSize(window_, &size[0], &size[1]);
    if (size[0] <= 0 || size[1] <= 0) return std::nullopt;
    for (int& pixels : size) pixels = std::clamp(pixels, kLeastSize, kGreatestSize);
    return size;
  }

  /// Copies a frame into the window, scaled to the window's size.
  void show(const render::Image& image) {
    glfwMakeContextCurrent(window_);
    if (texture_ == 0) {
      glGenTextures(1, &texture_);
      glGenFramebuffers(1, &framebuffer_);
    }
    glBindTexture(GL_TEXTURE_2D, texture_);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, image.width, image.height, 0, GL_RGB, GL_UNSIGNED_BYTE,
                 image.pixels.data());
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
    glFramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_, &width, &height);
    glViewport(0, 0, width, height);
    glBlitFramebuffer(0, 0, image.width, image.height, 0, height, width, 0, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glfwSwapBuffers(window_);
    glfwMakeContextCurrent(nullptr);
  }

 private:
  GLFWwindow* window_ = nullptr;
  unsigned texture_ = 0, framebuffer_ = 0;
};

void appendUtf8(std::string& text, unsigned code) {
  const auto add = [&](unsigned byte) { text += static_cast<char>(byte); };
  if (code < 0x80) return add(code);
  const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
  constexpr unsigned kLead[] = {0, 0xc0, 0xe0, 0xf0};
  add(kLead[more] | code >> 6 * more);
  for (int i = more - 1; i >= 0; --i) add(0x80 | (code >> 6 * i & 0x3f));
}

/// Returns the key that GLFW's code stands for: a special key such as Enter, or the letter on the key in the
/// present keyboard layout. Returns std::nullopt for an unknown key.
std::optional<Key> keyOf(int key, int scancode) {
  struct Code {
    int code;
    Key key;
  };
  static constexpr Code kCodes[] = {
      {GLFW_KEY_ENTER, Key::enter},         {GLFW_KEY_KP_ENTER, Key::enter}, {GLFW_KEY_ESCAPE, Key::escape},
      {GLFW_KEY_BACKSPACE, Key::backspace}, {GLFW_KEY_DELETE, Key::remove},  {GLFW_KEY_LEFT, Key::left},
      {GLFW_KEY_RIGHT, Key::right},         {GLFW_KEY_UP, Key::up},          {GLFW_KEY_DOWN, Key::down},
      {GLFW_KEY_HOME, Key::home},           {GLFW_KEY_END, Key::end},        {GLFW_KEY_TAB, Key::tab},
      {GLFW_KEY_SPACE, Key::space},         {GLFW_KEY_F1, Key::f1}};
  if (const auto* known = std::ranges::find(kCodes, key, &Code::code); known != std::end(kCodes)) return known->key;
  const char* letter = glfwGetKeyName(key, scancode);
  return letter == nullptr ? std::nullopt : keyNamed(letter);
}

/// Removes the script position from the beginning of an error message, because users do not know the explorer's
/// internal scripts.
std::string withoutPosition(std::string message) {
  for (const std::string_view script : {"panel:1:", "rebuild:1:", "preset:1:"})
    if (message.starts_with(script)) message.erase(0, message.find(": ") + 2);
  return message;
}

/// Returns the first of the names hpsdf-0001.png, hpsdf-0002.png, … for which no file exists.
std::string freeShotName() {
  for (int number = 1;; ++number) {
    std::string name = fmt::format("hpsdf-{:04}.png", number);
    if (!std::filesystem::exists(name)) return name;
  }
}

class Window {
 public:
  Window(Session& session, const WindowOptions& options)
      : explorer_(explorerOf(session)),
        screen_(options.width, options.height, options.title),
        work_(explorer_, [this] { refresh(); }) {
    listen();
    const auto size = screen_.size().value_or(std::array{options.width, options.height});
    const std::string show = fmt::format("show size={}x{} {}", size[0], size[1], backendText(options.backend));
    explorer_.run(show);
    explorer_.run(kGuessUp);
    recording_.emplace(explorer_, std::vector{std::string(kGuessUp), options.opening});
    openField(options.opening);
    explorer_.run(show);
  }

  void run() {
    draw(false);
    while (!ended()) {
      glfwWaitEventsTimeout(explorer_.isStale() ? kRestSeconds : kPollSeconds);
      const bool happened = takeEvents();
      if (ended()) break;
      if (happened || explorer_.isStale()) draw(happened);
    }
  }

  /// Ends the user's input and returns the last frame, which the recorded script reproduces.
  render::Image finish() {
    endGestures();
    return frame(1);
  }

  const Recording& recording() const { return *recording_; }

 private:
  bool ended() const { return glfwWindowShouldClose(screen_.window()) || InterruptGuard::interrupted(); }

  static Window& windowOf(GLFWwindow* window) { return *static_cast<Window*>(glfwGetWindowUserPointer(window)); }

  void listen() {
    GLFWwindow* window = screen_.window();
    glfwSetWindowUserPointer(window, this);
    glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) { windowOf(w).moved(x, y); });
    glfwSetCursorEnterCallback(window, [](GLFWwindow* w, int entered) {
      if (!entered && !windowOf(w).holdsButton()) windowOf(w).move({-1, -1});
    });
    glfwSetMouseButtonCallback(
        window, [](GLFWwindow* w, int button, int action, int mods) { windowOf(w).clicked(button, action, mods); });
    glfwSetScrollCallback(window, [](GLFWwindow* w, double, double turn) {
      windowOf(w).events_.push_back(Input{.kind = Input::Kind::wheel, .turn = turn});
    });
    glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int scancode, int action, int mods) {
      if (action != GLFW_RELEASE) windowOf(w).pressed(key, scancode, mods);
    });
    glfwSetCharCallback(window, [](GLFWwindow* w, unsigned code) {
      Input event{.kind = Input::Kind::type};
      appendUtf8(event.text, code);
      windowOf(w).events_.push_back(event);
    });
    glfwSetWindowRefreshCallback(window, [](GLFWwindow* w) { windowOf(w).damaged_ = true; });
  }

  bool holdsButton() const {
    for (const int button : {GLFW_MOUSE_BUTTON_LEFT, GLFW_MOUSE_BUTTON_RIGHT, GLFW_MOUSE_BUTTON_MIDDLE})
      if (glfwGetMouseButton(screen_.window(), button) == GLFW_PRESS) return true;
    return false;
  }

  /// Handles a movement of the pointer. Converts its position from the desktop's units into pixels of the frame.
  void moved(double x, double y) {
    int width = 0, height = 0;
    glfwGetWindowSize(screen_.window(), &width, &height);
    if (width <= 0 || height <= 0) return;
    const ViewState& view = explorer_.view();
    move({x * view.width / width, y * view.height / height});
  }

  /// Adds a movement of the pointer to the waiting events. If the last waiting event is also a movement, replaces it.
  void move(const std::array<double, 2>& at) {
    if (!events_.empty() && events_.back() && events_.back()->kind == Input::Kind::move) events_.pop_back();
    events_.push_back(Input{.kind = Input::Kind::move, .at = at});
  }

  void clicked(int button, int action, int mods) {
    if (button > GLFW_MOUSE_BUTTON_MIDDLE) return;
    events_.push_back(Input{.kind = action == GLFW_PRESS ? Input::Kind::press : Input::Kind::release,
                            .button = button,
                            .control = (mods & GLFW_MOD_CONTROL) != 0,
                            .shift = (mods & GLFW_MOD_SHIFT) != 0});
  }

  void pressed(int key, int scancode, int mods) {
    const bool control = (mods & GLFW_MOD_CONTROL) != 0;
    const char* letter = glfwGetKeyName(key, scancode);
    if (control && letter != nullptr && std::string_view(letter) == "q")
      return glfwSetWindowShouldClose(screen_.window(), GLFW_TRUE);
    if (key == GLFW_KEY_F12)
      events_.emplace_back();
    else if (const auto known = keyOf(key, scancode))
      events_.push_back(
          Input{.kind = Input::Kind::key, .key = *known, .control = control, .shift = (mods & GLFW_MOD_SHIFT) != 0});
  }

  /// Handles all waiting input events and a change of the window's size. Returns true if the frame must be drawn again.
  bool takeEvents() {
    bool happened = std::exchange(damaged_, false);
    const auto size = screen_.size();
    if (size && *size != std::array{explorer_.view().width, explorer_.view().height}) {
      attempt([&] { explorer_.run(fmt::format("show size={}x{}", (*size)[0], (*size)[1])); });
      happened = true;
    }
    while (!events_.empty()) {
      const auto event = events_.front();
      events_.pop_front();
      if (event)
        attempt([&] { take(*event); });
      else
        shoot();
      happened = true;
    }
    return happened;
  }

  /// Passes an input event to the explorer. Text can be pasted from the desktop's clipboard and copied to it.
  void take(const Input& event) {
    if (event.kind == Input::Kind::key && event.control && event.key == Key::v) {
      const char* text = glfwGetClipboardString(screen_.window());
      explorer_.setClipboard(text == nullptr ? "" : text);
    }
    const std::string before = explorer_.ui().clipboard();
    explorer_.input(event);
    if (const std::string& text = explorer_.ui().clipboard(); text != before)
      glfwSetClipboardString(screen_.window(), text.c_str());
  }

  /// Shows an error in the window and writes it to the terminal, since the readout panel may be closed.
  void showError(const std::string& error) {
    explorer_.message = printable(withoutPosition(error));
    const std::lock_guard lock(messageMutex());
    explorer_.session().console().err << "hpsdf: " << explorer_.message << std::endl;
  }

  /// Runs an action. If the action throws, shows the error in the window, which stays open.
  template <typename Action>
  void attempt(const Action& action) {
    try {
      action();
    } catch (const Cancelled&) {
      showError("cancelled: nothing has changed");
    } catch (const std::exception& error) {
      showError(errorText(error));
    }
  }

  /// Draws a frame and returns it. If the picture cannot be drawn, undoes changes of the view until it can be drawn.
  render::Image frame(int shrink) {
    for (;;) {
      try {
        return explorer_.frame(shrink);
      } catch (const Error& error) {
        if (!explorer_.canUndo()) throw;
        explorer_.run("undo");
        showError(error.what());
      }
    }
  }

  /// Shows in the window's title what the field is and how wrong it is.
  void showTitle() {
    if (!explorer_.session().hasField()) return;
    const CurrentField& current = explorer_.session().current();
    const std::string title = fmt::format("{} - {} - hpsdf", current.name, estimateLine(current.field));
    if (title != title_) glfwSetWindowTitle(screen_.window(), title.c_str());
    title_ = title;
  }

  /// Draws and shows a frame. If `roughly` is true and the picture takes too long, it is drawn with fewer pixels.
  void draw(bool roughly) {
    showTitle();
    const bool slow = roughly && fullSeconds_ > kSmoothSeconds;
    const int shrink = slow ? std::clamp(int(std::ceil(std::sqrt(fullSeconds_ / kSmoothSeconds))), 2, 4) : 1;
    // The pictures of a growing field may all be rough, so that their time in full is estimated.
    const bool measures = explorer_.redraws(shrink) && (shrink == 1 || explorer_.showsUnfinished());
    const auto start = Clock::now();
    const render::Image image = frame(shrink);
    if (measures) fullSeconds_ = shrink * shrink * std::chrono::duration<double>(Clock::now() - start).count();
    screen_.show(image);
  }

  /// Loads or builds the field. The window is there at once and shows the progress; closing it or Escape cancels the
  /// work.
  void openField(const std::string& opening) {
    explorer_.work = Explorer::Work{.task = "opening", .cancellable = true};
    screen_.show(explorer_.frame());
    explorer_.work.reset();
    try {
      explorer_.open(opening);
    } catch (const Error& error) {
      throw Error(withoutPosition(error.what()));
    }
    if (ended()) throw Cancelled();
  }

  /// Handles input events and shows a frame while long work runs. Screenshots wait until the work has ended.
  void refresh() {
    glfwPollEvents();
    std::deque<std::optional<Input>> later;
    while (!events_.empty()) {
      const auto event = events_.front();
      events_.pop_front();
      if (event)
        explorer_.input(*event);
      else
        later.emplace_back();
      lastInput_ = Clock::now();
    }
    events_ = std::move(later);
    if (ended()) explorer_.cancelWanted = true;
    const bool isMoving = std::chrono::duration<double>(Clock::now() - lastInput_).count() < kStillSeconds;
    draw(isMoving || explorer_.showsUnfinished());
  }

  /// Ends the user's gestures and records the pointer's position, so that the recording leads to the present
  /// frame.
  void endGestures() {
    attempt([&] { explorer_.releaseInput(); });  // a released slider may start long work
    frame(1);                                    // if drawing fails, undoes changes of the view, also in the recording
    explorer_.message.clear();
    recording_->notePointer();
  }

  /// Writes the frame to a file with the next unused name.
  void shoot() {
    endGestures();
    attempt([&] {
      const std::string name = freeShotName();
      explorer_.run("shot output=" + name);
      explorer_.message = name + " written";
    });
  }

  Explorer& explorer_;
  Screen screen_;
  LiveWork work_;
  std::optional<Recording> recording_;       ///< begins with the line that makes the field
  std::deque<std::optional<Input>> events_;  ///< waiting events; std::nullopt asks for a screenshot
  bool damaged_ = false;                     ///< true if the desktop has lost the window's content
  Clock::time_point lastInput_ = {};         ///< time of the last event that was handled while work ran
  std::string title_ = {};                   ///< title of the window; empty before the first frame
  double fullSeconds_ = 0;                   ///< time that the last picture in full resolution took
};

}  // namespace

std::size_t showWindow(Session& session, const WindowOptions& options) {
  const Desktop desktop;
  const InterruptGuard guard;
  std::optional<Window> shown;
  try {
    shown.emplace(session, options);
  } catch (const Cancelled&) {
    if (InterruptGuard::interrupted()) throw;
    return 0;  // the user closed the window before there was a field
  }
  Window& window = *shown;
  const auto write = [&] {
    if (options.record) writeTextFile(*options.record, window.recording().script());
  };
  try {
    window.run();
    const render::Image last = window.finish();
    if (options.shot) savePng(last, *options.shot);
  } catch (const Cancelled&) {
    // `Cancelled` is not an error here: the user closed the window during a measurement for the first frame, and
    // there is no frame yet.
  } catch (...) {
    write();
    throw;
  }
  write();
  return window.recording().lines();
}

}  // namespace hpsdf::app
