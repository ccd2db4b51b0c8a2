// Tests the window on a separate virtual display (Xvfb) with mouse and keyboard events from xdotool.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "commands/commands.h"
#include "explorer/explorer.h"
#include "file_drop.h"
#include "files/other_program.h"
#include "hpsdf/render/image.h"
#include "language/script.h"
#include "support/require_gl.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace window_test {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kPatience(30);
constexpr int kWidth = 960, kHeight = 640;

std::string contents(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return std::move(text).str();
}

template <typename Condition>
bool comesTrue(const Condition& condition) {
  for (const auto end = Clock::now() + kPatience; Clock::now() < end;) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return false;
}

/// Runs another program in `folder`, with its output in out.txt and err.txt in that folder.
class Child {
 public:
  Child(std::vector<std::string> words, const fs::path& folder, const std::string& display) : folder_(folder) {
    std::vector<std::string> environment;
    for (char** variable = environ; *variable != nullptr; ++variable)
      if (!std::string_view(*variable).starts_with("DISPLAY=") &&
          !std::string_view(*variable).starts_with("WAYLAND_DISPLAY=") &&
          !std::string_view(*variable).starts_with("XDG_STATE_HOME="))
        environment.emplace_back(*variable);
    if (!display.empty()) environment.push_back("DISPLAY=" + display);
    environment.push_back("XDG_STATE_HOME=" + folder.string());
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    constexpr int kNew = O_WRONLY | O_CREAT | O_TRUNC;
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "out.txt", kNew, 0600);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "err.txt", kNew, 0600);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t defaults;
    sigemptyset(&defaults);
    sigaddset(&defaults, SIGINT);  // a test that runs in the background inherits an ignored SIGINT
    posix_spawnattr_setsigdefault(&attributes, &defaults);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
    const auto pointers = [](std::vector<std::string>& texts) {
      std::vector<char*> list;
      for (std::string& text : texts) list.push_back(text.data());
      list.push_back(nullptr);
      return list;
    };
    const int error = posix_spawnp(&id_, words[0].c_str(), &actions, &attributes, pointers(words).data(),
                                   pointers(environment).data());
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    if (error != 0) throw std::runtime_error(words[0] + ": " + std::strerror(error));
  }
  ~Child() {
    if (ended()) return;
    kill(id_, SIGKILL);
    waitpid(id_, nullptr, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  bool ended() {
    int status = 0;
    if (status_ || waitpid(id_, &status, WNOHANG) == 0) return status_.has_value();
    status_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    return true;
  }
  /// Waits for the end of the process. Returns its exit status, or minus the number of the signal that ended it.
  int wait() {
    if (!comesTrue([&] { return ended(); })) ADD_FAILURE() << "does not end; it said: " << err();
    return status_.value_or(-SIGKILL);
  }
  void interrupt() const { kill(id_, SIGINT); }
  std::string out() const { return contents(folder_ / "out.txt"); }
  std::string err() const { return contents(folder_ / "err.txt"); }

 private:
  fs::path folder_;
  pid_t id_ = 0;
  std::optional<int> status_;
};

std::string problem() {
#ifndef HPSDF_WINDOW
  return "built without a window (libglfw3-dev)";
#endif
  for (const char* program : {"Xvfb", "xdotool"})
    if (!findProgram(program)) return std::string(program) + " is not installed";
  return support::glProblem();
}

/// An explorer that repeats the window's session step by step, so that the positions of the widgets are known.
class Follower {
 public:
  explicit Follower(const std::string& field) {
    run("build " + field + " ; show size=" + std::to_string(kWidth) + "x" + std::to_string(kHeight) + " gl=software");
  }
  void run(const std::string& lines) { runScript(session_, parseScript(registry_, "test", lines, {})); }
  std::array<int, 2> middleOf(const std::string& widget) {
    explorerOf(session_).frame();
    const UiRect& rect = explorerOf(session_).widgets().at(widget).rect;
    EXPECT_TRUE(rect.width() > 0 && rect.height() > 0) << widget << " is out of sight";
    return {int(rect.x0 + rect.x1) / 2, int(rect.y0 + rect.y1) / 2};
  }
  UiRect canvas() { return layoutOf(explorerOf(session_).view()).canvas; }

 private:
  std::istringstream in_;
  std::ostringstream out_, err_;
  Registry registry_ = makeRegistry();
  Session session_{registry_, {in_, out_, err_}};
};

class WindowTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string missing = problem();
    if (!missing.empty() && support::glRequired()) FAIL() << "HPSDF_REQUIRE_GL=1: " << missing;
    if (!missing.empty()) GTEST_SKIP() << missing;
    fs::create_directory(folder_ / "x");
    server_.emplace(std::vector<std::string>{"Xvfb", "-displayfd", "1", "-screen", "0", "1280x1024x24", "-fbdir",
                                             (folder_ / "x").string(), "-nolisten", "tcp", "-noreset"},
                    folder_ / "x", "");
    ASSERT_TRUE(comesTrue([&] { return server_->out().ends_with('\n') || server_->ended(); }));
    ASSERT_FALSE(server_->ended()) << server_->err();
    std::string number = server_->out();
    number.pop_back();
    display_ = ":" + number;
  }

  fs::path file(const std::string& name) const { return folder_ / name; }

  /// Runs the program in the test's folder to its end and returns its exit status.
  int program(std::vector<std::string> words, const std::string& display = "") {
    words.insert(words.begin(), HPSDF_PROGRAM);
    Child child(std::move(words), folder_.path(), display);
    const int status = child.wait();
    said_ = child.out() + child.err();
    return status;
  }

  /// Opens a window with a field or, for "", without one.
  void open(const std::string& field, bool waits = true, int width = kWidth, int height = kHeight) {
    std::vector<std::string> words = {
        HPSDF_PROGRAM, "view",     "--size",   std::to_string(width) + "x" + std::to_string(height),
        "--gl",        "software", "--record", "session.hps",
        "--shot",      "last.png"};
    if (!field.empty()) words.insert(words.begin() + 2, field);
    window_.emplace(words, folder_.path(), display_);
    id_ = desktop({"search", "--sync", "--onlyvisible", "--name", "hpsdf$"});
    ASSERT_FALSE(id_.empty()) << window_->err();
    id_.pop_back();
    // The title tells the field's error once there is a field; until then the window takes no other input than Escape.
    if (waits) waitForTitle("weighted estimate.*hpsdf$");
    desktop({"windowfocus", "--sync", id_});
  }
  void waitForTitle(const std::string& pattern) { desktop({"search", "--sync", "--onlyvisible", "--name", pattern}); }

  /// Closes the window by Ctrl+Q or by another event.
  int close() {
    desktop({"key", "ctrl+q"});
    return window_->wait();
  }

  std::string desktop(std::vector<std::string> words) {
    words.insert(words.begin(), "xdotool");
    return onDisplay(std::move(words));
  }
  /// Runs a program on the virtual display and returns its output.
  std::string onDisplay(std::vector<std::string> words) {
    Child child(std::move(words), folder_ / "x", display_);
    EXPECT_EQ(child.wait(), 0) << child.err();
    return child.out();
  }
  void move(const std::array<int, 2>& at) {
    desktop({"mousemove", "--window", id_, std::to_string(at[0]), std::to_string(at[1])});
  }
  void drag(const std::array<int, 2>& from, int dx, int dy, const char* button = "1") {
    move(from);
    desktop({"mousedown", button});
    move({from[0] + dx / 2, from[1] + dy / 2});
    move({from[0] + dx, from[1] + dy});
    desktop({"mouseup", button});
  }
  void click(const std::array<int, 2>& at) {
    move(at);
    desktop({"click", "1"});
  }
  void type(const std::string& text) {
    desktop({"type", "--delay", "1", text});
    desktop({"key", "Return"});
  }

  struct Screen {
    std::string bytes;        ///< pixels of four bytes: blue, green, red and a byte without use
    std::size_t first, line;  ///< position of the first pixel, and number of bytes of a row
  };
  Screen screen() const {
    std::string file = contents(folder_ / "x" / "Xvfb_screen0");  // an xwd file, which begins with big-endian words
    const auto word = [&](std::size_t index) {
      std::uint32_t value = 0;
      for (std::size_t byte = 0; byte < 4; ++byte)
        value = value << 8 | static_cast<unsigned char>(file[4 * index + byte]);
      return value;
    };
    const std::size_t first = word(0) + 12 * word(19), line = word(12);
    return {std::move(file), first, line};
  }

  /// Returns true if the display shows this part of a frame, pixel by pixel, at the window's position.
  bool screenShows(const render::Image& frame, const UiRect& part) {
    const auto [screen, pixels, line] = this->screen();
    for (int y = int(part.y0); y < int(part.y1); ++y)
      for (int x = int(part.x0); x < int(part.x1); ++x)
        for (std::size_t channel = 0; channel < 3; ++channel) {  // the display stores the blue channel first
          const char shown = screen[pixels + std::size_t(y) * line + 4 * std::size_t(x) + 2 - channel];
          if (static_cast<std::uint8_t>(shown) != frame.at(x, y)[channel]) return false;
        }
    return true;
  }

  /// Returns the number of pixels of the display that have the colour of a surface, more red than blue.
  std::size_t clayOnScreen() const {
    const Screen shown = screen();
    std::size_t count = 0;
    for (std::size_t pixel = shown.first; pixel + 4 <= shown.bytes.size(); pixel += 4) {
      const auto blue = static_cast<unsigned char>(shown.bytes[pixel]);
      const auto red = static_cast<unsigned char>(shown.bytes[pixel + 2]);
      count += red > blue + 20;
    }
    return count;
  }

  support::TemporaryDirectory folder_;
  std::optional<Child> server_, window_;
  std::string display_, id_, said_;
};

TEST_F(WindowTest, aSessionOfMouseAndKeyboardReplaysToTheSamePixels) {
  const std::string field = "builtin:torus";
  ASSERT_NO_FATAL_FAILURE(open(field));
  Follower follower(field);
  const auto canvas = follower.middleOf("canvas");
  drag(canvas, 60, -30);
  drag(canvas, 20, 30, "3");
  move(canvas);
  desktop({"click", "4"});
  click(follower.middleOf("bar/slice"));
  follower.run("show slice");
  click(follower.middleOf("view/color"));
  follower.run("ui click view/color");
  click(follower.middleOf("view/color/depth"));
  follower.run("ui click view/color/depth");
  click(follower.middleOf("camera/fold"));
  follower.run("panel camera=true");
  move(follower.middleOf("view/zoom"));
  desktop({"keydown", "ctrl", "click", "1", "keyup", "ctrl"});
  type("4");
  follower.run("plane zoom=4");
  click(follower.middleOf("worst/fold"));
  desktop({"key", "ctrl+z"});
  click(follower.middleOf("questions/fold"));
  follower.run("panel questions=false");
  click(follower.middleOf("colors/fold"));
  follower.run("panel colors=false");
  click(follower.middleOf("build/fold"));
  follower.run("panel build=true");
  click(follower.middleOf("build/target-error"));
  type("1e-4");
  click(follower.middleOf("build/rebuild"));
  desktop({"key", "F12"});
  ASSERT_TRUE(comesTrue([&] { return fs::exists(file("hpsdf-0001.png")); })) << window_->err();
  const render::Image shot = render::loadPng(file("hpsdf-0001.png"));
  EXPECT_TRUE(comesTrue([&] { return screenShows(shot, follower.canvas()); }));
  move(canvas);
  click(follower.middleOf("view/axis"));  // opens a list that stays open
  ASSERT_EQ(close(), 0) << window_->err();

  const std::string script = contents(file("session.hps"));
  for (const char* line :
       {"camera up=auto\nbuild builtin:torus\nshow size=960x640 scale=1 samples=2 gl=software\ncamera 6,8,1.1\ncamera "
        "target=",
        "\nshow slice\n", "\ncolor depth\n",
        "\nplane zoom=4\npanel worst=true\nundo\npanel questions=false\npanel colors=false\npanel build=true\nsettings "
        "target-error=1e-4\napply\nui hover ",
        "\nshot output=hpsdf-0001.png\nui hover "})
    EXPECT_THAT(script, HasSubstr(line));
  const std::string first = contents(file("hpsdf-0001.png")), last = contents(file("last.png"));
  EXPECT_FALSE(first == last);
  fs::remove(file("hpsdf-0001.png"));
  ASSERT_EQ(program({"run", "-e", "include session.hps", "-e", "shot output=replay.png"}), 0) << said_;
  EXPECT_TRUE(contents(file("hpsdf-0001.png")) == first);
  EXPECT_TRUE(contents(file("replay.png")) == last);

  std::string other = script;
  other.replace(other.find("plane zoom=4"), 12, "plane zoom=5");
  std::ofstream(file("other.hps")) << other;
  ASSERT_EQ(program({"run", "-e", "include other.hps", "-e", "shot output=other.png"}), 0) << said_;
  EXPECT_FALSE(contents(file("other.png")) == last);
}

TEST_F(WindowTest, aConstructionIsCancelledAndMistakesLeaveItOpen) {
  const std::string field = "analytic:torus";
  ASSERT_NO_FATAL_FAILURE(open(field));
  Follower follower(field);
  click(follower.middleOf("shown/fold"));
  follower.run("panel shown=false");
  click(follower.middleOf("questions/fold"));  // makes room for the construction
  follower.run("panel questions=false");
  click(follower.middleOf("build/fold"));
  follower.run("panel build=true");
  click(follower.middleOf("build/grid"));
  type("many");
  click(follower.middleOf("build/target-error"));
  type("1e-30");
  click(follower.middleOf("build/rebuild"));
  desktop({"key", "Escape"});
  click(follower.middleOf("bar/slice"));
  ASSERT_EQ(close(), 0) << window_->err();
  EXPECT_THAT(window_->err(), HasSubstr("hpsdf: cancelled"));
  EXPECT_THAT(window_->err(), HasSubstr("many"));
  const std::string script = contents(file("session.hps"));
  EXPECT_THAT(script, HasSubstr("settings target-error=1e-30\n"));
  EXPECT_THAT(script, Not(HasSubstr("apply")));
  EXPECT_THAT(script, Not(HasSubstr("many")));
  ASSERT_EQ(program({"run", "-e", "include session.hps", "-e", "shot output=replay.png"}), 0) << said_;
  EXPECT_TRUE(contents(file("replay.png")) == contents(file("last.png")));
}

/// The window is there before the field is, shows the progress, and cancels the construction when it is closed.
TEST_F(WindowTest, itShowsTheProgressOfTheFirstConstructionAndClosingCancelsIt) {
  for (const char* key : {"ctrl+q", "Escape"}) {
    ASSERT_NO_FATAL_FAILURE(open("builtin:helix-bowl,turns=4", false));
    EXPECT_TRUE(comesTrue([&] {
      const std::string screen = contents(folder_ / "x" / "Xvfb_screen0");
      return std::ranges::count(screen, char(0xf8)) > 1000;  // the frame's background has the blue 248
    }));
    EXPECT_TRUE(comesTrue([&] { return clayOnScreen() > 5000; })) << "the mesh is shown";
    EXPECT_EQ(desktop({"getwindowname", id_}).find("weighted estimate"), std::string::npos);
    desktop({"key", key});
    EXPECT_EQ(window_->wait(), 0) << window_->err();
    EXPECT_FALSE(fs::exists(file("last.png"))) << "there was no field to show";
    EXPECT_FALSE(fs::exists(file("session.hps")));
  }
}

/// Text has as many points on a desktop with more pixels per inch.
TEST_F(WindowTest, theFrameFollowsTheDesktopsScale) {
  if (!findProgram("xprop")) GTEST_SKIP() << "xprop is not installed";
  int plain = 0;
  for (const double scale : {1.0, 1.5, 2.0}) {
    onDisplay({"xprop", "-root", "-f", "RESOURCE_MANAGER", "8s", "-set", "RESOURCE_MANAGER",
               "Xft.dpi: " + std::to_string(int(96 * scale))});
    ASSERT_NO_FATAL_FAILURE(open("analytic:torus", true, 600, 400));
    ASSERT_EQ(close(), 0) << window_->err();
    const render::Image frame = render::loadPng(file("last.png"));
    EXPECT_EQ(frame.width, int(600 * scale));
    EXPECT_EQ(frame.height, int(400 * scale));
    int rows = 0;  // with the ink of the first button's text
    for (int y = int(5 * scale); y < int(25 * scale); ++y) {
      bool isInked = false;
      for (int x = int(12 * scale); x < int(36 * scale); ++x) isInked |= frame.at(x, y)[0] < 110;
      rows += isInked;
    }
    if (scale == 1) plain = rows;
    EXPECT_GE(plain, 7);
    EXPECT_NEAR(rows / scale, plain, 1) << scale;
    EXPECT_THAT(contents(file("session.hps")), HasSubstr(" samples=2 "));
  }
}

/// A window without a field invites to open one. What is opened is in the recording, and is offered the next time.
TEST_F(WindowTest, filesAreOpenedInTheWindow) {
  ASSERT_EQ(program({"build", "analytic:torus", "-o", "one.hpsdf", "--target-error", "1e-2"}), 0) << said_;
  ASSERT_EQ(program({"build", "builtin:box", "-o", "two.hpsdf", "--target-error", "1e-2"}), 0) << said_;
  ASSERT_NO_FATAL_FAILURE(open("", false));
  desktop({"key", "ctrl+o"});
  type("nowhere.hpsdf");
  desktop({"key", "ctrl+o"});
  type("one.hpsdf");
  waitForTitle("^one.hpsdf.*hpsdf$");
  desktop({"key", "ctrl+s"});
  type("frame.png");
  EXPECT_TRUE(comesTrue([&] { return fs::exists(file("frame.png")); })) << window_->err();
#ifdef HPSDF_X11
  EXPECT_TRUE(dropFile(display_, std::stoul(id_), file("two.hpsdf").string()));
  waitForTitle("two.hpsdf.*hpsdf$");
#endif
  ASSERT_EQ(close(), 0) << window_->err();
  EXPECT_THAT(window_->err(), HasSubstr("nowhere.hpsdf"));
  const std::string script = contents(file("session.hps"));
  EXPECT_THAT(script, AllOf(HasSubstr("show size=960x640 scale=1 samples=2 gl=software\nopen one.hpsdf\n"),
                            HasSubstr("\nshot panels=false output=frame.png\n")));
  EXPECT_THAT(script, Not(HasSubstr("nowhere")));
  EXPECT_THAT(contents(file("hpsdf/recent")), HasSubstr("/one.hpsdf\n"));
  const std::string first = contents(file("frame.png")), last = contents(file("last.png"));
  ASSERT_EQ(program({"run", "-e", "include session.hps", "-e", "shot output=replay.png"}), 0) << said_;
  EXPECT_TRUE(contents(file("frame.png")) == first);
  EXPECT_TRUE(contents(file("replay.png")) == last);

  // The files are offered in the next window, whose first entry is the last one.
  fs::remove(file("last.png"));
  ASSERT_NO_FATAL_FAILURE(open("", false));
  desktop({"key", "ctrl+o"});
  desktop({"key", "Down"});
  desktop({"key", "Return"});
  waitForTitle("(one|two).hpsdf.*hpsdf$");
  ASSERT_EQ(close(), 0) << window_->err();
  EXPECT_TRUE(fs::exists(file("last.png")));
}

TEST_F(WindowTest, aWindowThatIsClosedWithoutAFieldWritesNothing) {
  std::ofstream(file("hpsdf")) << "no folder for recent files";
  ASSERT_NO_FATAL_FAILURE(open("", false));
  ASSERT_EQ(close(), 0) << window_->err();
  EXPECT_EQ(window_->out() + window_->err(), "");
  EXPECT_FALSE(fs::exists(file("last.png")) || fs::exists(file("session.hps")));
}

TEST_F(WindowTest, aSurfaceThatCannotBeOpenedIsAnError) {
  EXPECT_EQ(program({"view", "nowhere.obj"}, display_), 2);
  EXPECT_THAT(said_, HasSubstr("hpsdf: error: nowhere.obj"));
  EXPECT_EQ(std::ranges::count(said_, '\n'), 1) << said_;
}

TEST_F(WindowTest, anotherSizeIsRecorded) {
  ASSERT_NO_FATAL_FAILURE(open("analytic:torus"));
  desktop({"windowsize", id_, "700", "500"});
  desktop({"key", "F12"});  // takes a screenshot, so that the window has drawn a frame before it is closed
  ASSERT_TRUE(comesTrue([&] { return fs::exists(file("hpsdf-0001.png")); })) << window_->err();
  ASSERT_EQ(close(), 0) << window_->err();
  EXPECT_THAT(contents(file("session.hps")),
              HasSubstr("show size=960x640 scale=1 samples=2 gl=software\nshow size=700x500\n"));
  const render::Image last = render::loadPng(file("last.png"));
  EXPECT_EQ(last.width, 700);
  EXPECT_EQ(last.height, 500);
}

TEST_F(WindowTest, anInterruptionWritesTheFiles) {
  ASSERT_NO_FATAL_FAILURE(open("analytic:torus"));
  desktop({"key", "F12"});
  ASSERT_TRUE(comesTrue([&] { return fs::exists(file("hpsdf-0001.png")); })) << window_->err();
  window_->interrupt();
  EXPECT_EQ(window_->wait(), 0) << window_->err();
  EXPECT_THAT(contents(file("session.hps")), HasSubstr("shot output=hpsdf-0001.png"));
  EXPECT_TRUE(contents(file("last.png")) == contents(file("hpsdf-0001.png")));
}

TEST_F(WindowTest, aMissingDisplayIsAnError) {
  EXPECT_EQ(program({"view", "analytic:torus", "--record", "session.hps"}), 2);
  EXPECT_THAT(said_, HasSubstr("no window can be opened here"));
  // A mesh or a field in place of a command is opened in a window too.
  std::ofstream(file("corner.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  ASSERT_EQ(program({"build", "corner.obj", "-o", "corner.hpsdf", "--target-error", "1e-2"}), 0) << said_;
  for (const char* name : {"corner.obj", "corner.hpsdf"}) {
    EXPECT_EQ(program({name, "--size", "300x200"}), 2);
    EXPECT_THAT(said_, AllOf(HasSubstr("no window can be opened here"), HasSubstr("'hpsdf render'")));
    EXPECT_EQ(std::ranges::count(said_, '\n'), 1) << said_;
  }
  EXPECT_EQ(std::ranges::count(said_, '\n'), 1) << said_;
  EXPECT_FALSE(fs::exists(file("session.hps")));
}

}  // namespace window_test
}  // namespace hpsdf::app
