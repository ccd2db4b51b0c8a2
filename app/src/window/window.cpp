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
#include <memory>

#include "console/error_text.h"
#include "console/interrupt.h"
#include "explorer/explorer.h"
#include "hpsdf/detail/output_file.h"
#include "language/script.h"
#include "window/live_work.h"
#include "window/recording.h"

namespace hpsdf::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kLookSeconds = 0.2;    // Ctrl-C wakes nobody
constexpr double kQuietSeconds = 0.06;  // without an event, before a slow picture is drawn in full
constexpr double kQuickSeconds = 0.04;
constexpr int kLeastSize = 64, kGreatestSize = 8192;  // as `show` has it

std::string glfwProblem() {
  const char* description = nullptr;
  glfwGetError(&description);
  std::string text = description == nullptr ? "no reason given" : description;
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

/// The desktop.
class Desktop {
 public:
  Desktop() {
    if (!glfwInit())
      throw Error(
          fmt::format("no window can be opened here ({}): set DISPLAY, or write frames without one, by 'shot' in a "
                      "script",
                      glfwProblem()));
  }
  ~Desktop() { glfwTerminate(); }
  Desktop(const Desktop&) = delete;
  Desktop& operator=(const Desktop&) = delete;
};

/// A window with an OpenGL context, which is current only while a picture is shown: the pictures are drawn in another.
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

  /// Pixels; nothing while it is not to be seen.
  std::optional<std::array<int, 2>> size() const {
    std::array<int, 2> size{};
    glfwGetFramebufferSize(window_, &size[0], &size[1]);
    if (size[0] <= 0 || size[1] <= 0) return std::nullopt;
    for (int& pixels : size) pixels = std::clamp(pixels, kLeastSize, kGreatestSize);
    return size;
  }

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

/// By the letter on it, wherever the keyboard has that.
std::optional<Key> keyOf(int key, int scancode) {
  switch (key) {
    case GLFW_KEY_ENTER:
    case GLFW_KEY_KP_ENTER:
      return Key::enter;
    case GLFW_KEY_ESCAPE:
      return Key::escape;
    case GLFW_KEY_BACKSPACE:
      return Key::backspace;
    case GLFW_KEY_DELETE:
      return Key::remove;
    case GLFW_KEY_LEFT:
      return Key::left;
    case GLFW_KEY_RIGHT:
      return Key::right;
    case GLFW_KEY_HOME:
      return Key::home;
    case GLFW_KEY_END:
      return Key::end;
    case GLFW_KEY_TAB:
      return Key::tab;
    default:
      break;
  }
  const char* letter = glfwGetKeyName(key, scancode);
  return letter == nullptr ? std::nullopt : keyNamed(letter);
}

/// What went wrong, without the places of the script that a widget's line is.
std::string withoutPlaces(std::string message) {
  for (const std::string_view script : {"panel:1:", "rebuild:1:"})
    if (message.starts_with(script)) message.erase(0, message.find(": ") + 2);
  return message;
}

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
        recording_(explorer_, {options.opening}),
        work_(explorer_, [this] { refresh(); }) {
    listen();
    const auto size = screen_.size().value_or(std::array{options.width, options.height});
    explorer_.run(fmt::format("show size={}x{} {}", size[0], size[1], backendText(options.backend)));
  }

  void run() {
    draw(false);
    while (!ended()) {
      glfwWaitEventsTimeout(explorer_.isStale() ? kQuietSeconds : kLookSeconds);
      const bool happened = takeEvents();
      if (ended()) break;
      if (happened)
        draw(true);
      else if (explorer_.isStale())
        draw(false);
    }
  }

  /// The last frame, as the recording leads to it.
  render::Image finish() {
    putAway();
    return frame(1);
  }

  const Recording& recording() const { return recording_; }

 private:
  bool ended() const { return glfwWindowShouldClose(screen_.window()) || InterruptGuard::interrupted(); }

  static Window& of(GLFWwindow* window) { return *static_cast<Window*>(glfwGetWindowUserPointer(window)); }

  void listen() {
    GLFWwindow* window = screen_.window();
    glfwSetWindowUserPointer(window, this);
    glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) { of(w).moved(x, y); });
    glfwSetCursorEnterCallback(window, [](GLFWwindow* w, int entered) {
      if (!entered && !of(w).holdsButton()) of(w).move({-1, -1});
    });
    glfwSetMouseButtonCallback(
        window, [](GLFWwindow* w, int button, int action, int mods) { of(w).clicked(button, action, mods); });
    glfwSetScrollCallback(window, [](GLFWwindow* w, double, double turn) {
      of(w).events_.push_back(Input{.kind = Input::Kind::wheel, .turn = turn});
    });
    glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int scancode, int action, int mods) {
      if (action != GLFW_RELEASE) of(w).pressed(key, scancode, mods);
    });
    glfwSetCharCallback(window, [](GLFWwindow* w, unsigned code) {
      Input event{.kind = Input::Kind::type};
      appendUtf8(event.text, code);
      of(w).events_.push_back(event);
    });
    glfwSetWindowRefreshCallback(window, [](GLFWwindow* w) { of(w).damaged_ = true; });
  }

  bool holdsButton() const {
    for (const int button : {GLFW_MOUSE_BUTTON_LEFT, GLFW_MOUSE_BUTTON_RIGHT, GLFW_MOUSE_BUTTON_MIDDLE})
      if (glfwGetMouseButton(screen_.window(), button) == GLFW_PRESS) return true;
    return false;
  }

  /// Where the desktop's units are not pixels, the picture's are.
  void moved(double x, double y) {
    int width = 0, height = 0;
    glfwGetWindowSize(screen_.window(), &width, &height);
    if (width <= 0 || height <= 0) return;
    const ViewState& view = explorer_.view();
    move({x * view.width / width, y * view.height / height});
  }

  /// Moves that nobody has looked at yet are one.
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

  /// Whether there were any.
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

  /// The clipboard is the desktop's.
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

  /// In the window, and where the panel is closed that shows it.
  void tell(const std::string& mistake) {
    explorer_.message = withoutPlaces(mistake);
    explorer_.session().console().err << "hpsdf: " << explorer_.message << std::endl;
  }

  /// What goes wrong is told, and the window stays open.
  template <typename Action>
  void attempt(const Action& action) {
    try {
      action();
    } catch (const Cancelled&) {
      tell("cancelled: all is as it was");
    } catch (const std::exception& error) {
      tell(errorText(error));
    }
  }

  /// A view that cannot be drawn gives way to the one before.
  render::Image frame(int shrink) {
    for (;;) {
      try {
        return explorer_.frame(shrink);
      } catch (const Error& error) {
        if (!explorer_.canUndo()) throw;
        explorer_.run("undo");
        tell(error.what());
      }
    }
  }

  /// `roughly`: a picture that takes too long is drawn with fewer pixels for now.
  void draw(bool roughly) {
    const bool slow = roughly && fullSeconds_ > kQuickSeconds;
    const int shrink = slow ? std::clamp(int(std::ceil(std::sqrt(fullSeconds_ / kQuickSeconds))), 2, 4) : 1;
    const bool measures = explorer_.isStale() && shrink == 1;
    const auto start = Clock::now();
    const render::Image image = frame(shrink);
    if (measures) fullSeconds_ = std::chrono::duration<double>(Clock::now() - start).count();
    screen_.show(image);
  }

  /// During long work.
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
    }
    events_ = std::move(later);
    if (ended()) explorer_.cancelWanted = true;
    screen_.show(explorer_.frame());
  }

  void putAway() {
    attempt([&] { explorer_.letGo(); });  // a button that is let go may start what is cancelled
    frame(1);                             // the recording leads to a view that can be drawn
    explorer_.message.clear();
    recording_.notePointer();
  }

  void shoot() {
    putAway();
    attempt([&] {
      const std::string name = freeShotName();
      explorer_.run("shot output=" + name);
      explorer_.message = name + " written";
    });
  }

  Explorer& explorer_;
  Screen screen_;
  Recording recording_;
  LiveWork work_;
  std::deque<std::optional<Input>> events_;  ///< nothing: a shot is wanted
  bool damaged_ = false;
  double fullSeconds_ = 0;  ///< that the last picture took
};

void writeFile(const std::string& file, const std::string& text) {
  OutputFile out(file);
  out.write(text);
  out.commit();
}

}  // namespace

std::size_t showWindow(Session& session, const WindowOptions& options) {
  const Desktop desktop;
  runScript(session, parseScript(session.registry(), "view", options.opening, {}));
  const InterruptGuard guard;
  Window window(session, options);
  const auto write = [&] {
    if (options.record) writeFile(*options.record, window.recording().script());
  };
  try {
    window.run();
    const render::Image last = window.finish();
    if (options.shot) savePng(last, *options.shot);
  } catch (const Cancelled&) {
    // closed while something was measured for the first frame: there is none
  } catch (...) {
    write();
    throw;
  }
  write();
  return window.recording().lines();
}

}  // namespace hpsdf::app
