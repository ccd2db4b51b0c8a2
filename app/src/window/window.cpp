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
#include "window/recent_files.h"
#include "window/recording.h"

namespace hpsdf::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kPollSeconds = 0.2;   // longest wait for an event, because Ctrl-C does not end a wait
constexpr double kRestSeconds = 0.04;  // time without an event after which a slow picture is drawn in full
constexpr double kSettledSeconds =
    0.1;                               // the same after a picture with one sample a pixel, if the finished one is slow
constexpr double kStillSeconds = 0.3;  // the same while work runs, which full pictures would slow down
constexpr double kSmoothSeconds = 0.045;    // frames that take longer are drawn with fewer pixels while the view moves
constexpr double kPromptSeconds = 0.7;      // a picture that takes longer is drawn with one sample a pixel first
constexpr double kFinishedOverPlain = 2.8;  // usual time of a finished picture over that with a sample a pixel
constexpr int kCoarsest = 6;                // greatest divisor of the number of pixels along an axis
constexpr int kRestSamples = 2;             // samples of a pixel along each axis, once nothing moves
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
  /// Opens a window. Its size is in points. `scale` is the number of pixels per point, by default the desktop's.
  Screen(int width, int height, std::optional<double> scale, const std::string& title) : scale_(scale) {
    glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 0);
    window_ = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
    if (window_ == nullptr)
      throw Error(fmt::format("the window cannot be opened ({}): install the graphics driver, or libgl1-mesa-dri",
                              glfwProblem()));
    glfwSetWindowSizeLimits(window_, kLeastSize, kLeastSize, GLFW_DONT_CARE, GLFW_DONT_CARE);
    // A desktop that counts in points has enlarged the window already; X11 counts in pixels.
    int units = 0, pixels = 0;
    glfwGetWindowSize(window_, &units, nullptr);
    glfwGetFramebufferSize(window_, &pixels, nullptr);
    if (const double factor = this->scale() * std::max(units, 1) / std::max(pixels, 1); factor != 1)
      glfwSetWindowSize(window_, int(std::lround(width * factor)), int(std::lround(height * factor)));
    glfwShowWindow(window_);
  }
  ~Screen() { glfwDestroyWindow(window_); }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  GLFWwindow* window() const { return window_; }

  /// Returns the number of pixels per point: what the user chose, or the scale of the desktop. Desktops that derive
  /// their scale from the size of the screen have odd ones, which are rounded to quarters.
  double scale() const {
    if (scale_) return *scale_;
    float across = 1, down = 1;
    glfwGetWindowContentScale(window_, &across, &down);
    return std::clamp(std::round(4.0 * across) / 4, kLeastScale, kGreatestScale);
  }

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
  std::optional<double> scale_;
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
        screen_(options.width, options.height, options.scale, options.title),
        work_(explorer_, [this] { refresh(); }) {
    listen();
    const auto size = screen_.size().value_or(std::array{options.width, options.height});
    const std::string show = fmt::format("show size={}x{} scale={} samples={} {}", size[0], size[1], screen_.scale(),
                                         kRestSamples, backendText(options.backend));
    explorer_.run(show);
    explorer_.recentFiles = recentFiles();
    explorer_.run(kGuessUp);
    std::vector<std::string> lines = {kGuessUp};
    if (!options.opening.empty()) lines.push_back(options.opening);
    recording_.emplace(explorer_, lines);
    if (!options.opening.empty()) openField(options.opening);
    explorer_.run(show);
  }

  void run() {
    draw(false);
    while (!ended()) {
      glfwWaitEventsTimeout(longestWait());
      const bool happened = takeEvents();
      if (ended()) break;
      if (happened || explorer_.isStale()) draw(happened);
    }
  }

  /// Ends the user's input and returns the last frame, which the recorded script reproduces.
  render::Image finish() {
    endGestures();
    return frame(0);
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
    glfwSetDropCallback(window, [](GLFWwindow* w, int count, const char** files) {
      if (count > 0) windowOf(w).dropped_ = files[0];
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
    if (const double scale = screen_.scale(); scale != explorer_.view().scale) {
      attempt([&] { explorer_.run(fmt::format("show scale={}", scale)); });
      happened = true;
    }
    if (const auto file = std::exchange(dropped_, std::nullopt)) {
      attempt([&] { explorer_.run("open " + scriptWord(*file)); });
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
    explorer_.tellProblem(error);
    const std::lock_guard lock(messageMutex());
    explorer_.session().console().err << "hpsdf: " << explorer_.message.text << std::endl;
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
  render::Image frame(int coarseness) {
    for (;;) {
      try {
        return explorer_.frame(coarseness);
      } catch (const Error& error) {
        if (!explorer_.canUndo()) throw;
        explorer_.run("undo");
        showError(error.what());
      }
    }
  }

  /// Shows in the window's title what the field is and how wrong it is, and remembers its file.
  void showTitle() {
    if (!explorer_.session().hasField()) return;
    const CurrentField& current = explorer_.session().current();
    const std::string title = fmt::format("{} - {} - hpsdf", current.name, estimateLine(current.field));
    if (title == title_) return;
    glfwSetWindowTitle(screen_.window(), title.c_str());
    title_ = title;
    rememberFile(current.name);
    explorer_.recentFiles = recentFiles();
  }

  /// Returns the time after which the picture is drawn again if nothing happens.
  double longestWait() const {
    if (!explorer_.isStale()) return kPollSeconds;
    return explorer_.coarseness() == 1 && finishedSeconds_ > kPromptSeconds ? kSettledSeconds : kRestSeconds;
  }

  /// Returns how coarse the next picture is: while the view moves, so coarse that frames are smooth. Where the finished
  /// picture takes long, one with a sample a pixel precedes it.
  int nextCoarseness(bool moves) const {
    if (moves) return movingCoarseness_;
    return finishedSeconds_ > kPromptSeconds && explorer_.redraws(1) ? 1 : 0;
  }

  /// Learns from the time that a frame took how coarse moving pictures must be. The time of pictures without
  /// shadows is proportional to their number of samples; light is measured once a pixel.
  void learn(int coarseness, double seconds) {
    const auto square = [](double x) { return x * x; };
    if (coarseness == 0) finishedSeconds_ = seconds;
    if (coarseness == 1) finishedSeconds_ = kFinishedOverPlain * seconds;
    if (coarseness < 2) {
      const double plain = finishedSeconds_ / square(kRestSamples);
      movingCoarseness_ = std::clamp(int(std::ceil(std::sqrt(plain / kSmoothSeconds))), 1, kCoarsest);
      return;
    }
    const double ofFiner = seconds * square(double(coarseness) / (coarseness - 1));
    if (seconds > kSmoothSeconds) movingCoarseness_ = std::min(coarseness + 1, kCoarsest);
    if (ofFiner < 0.8 * kSmoothSeconds) movingCoarseness_ = coarseness - 1;
  }

  /// Draws and shows a frame. `moves` is true while the user moves what it shows.
  void draw(bool moves) {
    showTitle();
    const int coarseness = nextCoarseness(moves);
    const bool redraws = explorer_.redraws(coarseness);
    const auto start = Clock::now();
    screen_.show(frame(coarseness));
    if (redraws) learn(coarseness, std::chrono::duration<double>(Clock::now() - start).count());
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
    frame(0);                                    // if drawing fails, undoes changes of the view, also in the recording
    explorer_.message = {};
    recording_->notePointer();
  }

  /// Writes the frame to a file with the next unused name.
  void shoot() {
    endGestures();
    attempt([&] {
      const std::string name = freeShotName();
      explorer_.run("shot output=" + name);
    });
  }

  Explorer& explorer_;
  Screen screen_;
  LiveWork work_;
  std::optional<Recording> recording_;       ///< begins with the line that makes the field
  std::deque<std::optional<Input>> events_;  ///< waiting events; std::nullopt asks for a screenshot
  std::optional<std::string> dropped_;       ///< file that was dropped onto the window and is to be opened
  bool damaged_ = false;                     ///< true if the desktop has lost the window's content
  Clock::time_point lastInput_ = {};         ///< time of the last event that was handled while work ran
  std::string title_ = {};                   ///< title of the window; empty before the first frame
  double finishedSeconds_ = 0;               ///< time that the last finished picture took, or would have taken
  int movingCoarseness_ = 1;                 ///< coarseness of pictures while the view moves
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
    if (!session.hasField()) return 0;  // there was nothing to record
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
