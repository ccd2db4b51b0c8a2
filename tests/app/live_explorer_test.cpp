// Tests the explorer's mouse and key input without a window: recordings repeat a session, and long work shows its
// progress and can be cancelled.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "commands/commands.h"
#include "console/long_work.h"
#include "explorer/explorer.h"
#include "language/script.h"
#include "window/live_work.h"
#include "window/recording.h"

namespace hpsdf::app {
namespace live_explorer_test {

using testing::HasSubstr;

constexpr const char* kField = "build analytic:torus target-error=1e-4";
constexpr const char* kFirst = "show size=900x560 cpu=true";

/// A session and its explorer.
class Desk {
 public:
  explicit Desk(const std::string& opening = kField) { run(opening); }
  void run(const std::string& lines) { runScript(session_, parseScript(registry_, "test", lines, {})); }
  Explorer& explorer() { return explorerOf(session_); }
  Session& session() { return session_; }

  void move(double x, double y) { explorer().input({.kind = Input::Kind::move, .at = {x, y}}); }
  void press(int button = 0, bool control = false) {
    explorer().input({.kind = Input::Kind::press, .button = button, .control = control});
  }
  void release(int button = 0) { explorer().input({.kind = Input::Kind::release, .button = button}); }
  void key(Key key, bool control = false) {
    explorer().input({.kind = Input::Kind::key, .key = key, .control = control});
  }
  void type(const std::string& text) { explorer().input({.kind = Input::Kind::type, .text = text}); }
  void moveTo(const std::string& widget) {
    const UiRect rect = explorer().widgets().at(widget).rect;
    move((rect.x0 + rect.x1) / 2, (rect.y0 + rect.y1) / 2);
  }
  void click(const std::string& widget, bool control = false) {
    moveTo(widget);
    press(0, control);
    release();
  }

 private:
  std::istringstream in_;
  std::ostringstream out_, err_;
  Registry registry_ = makeRegistry();
  Session session_{registry_, {in_, out_, err_}};
};

/// Undoes every change and returns the scripts of all states, the most recent first.
std::vector<std::string> history(Explorer& explorer) {
  std::vector<std::string> states = {scriptOf(explorer.view())};
  while (explorer.undo()) states.push_back(scriptOf(explorer.view()));
  return states;
}

TEST(Recording, holdsOneLinePerGesture) {
  Desk desk;
  Recording recording(desk.explorer(), {});
  desk.explorer().run(kFirst);
  desk.moveTo("canvas");
  desk.press();
  for (int i = 0; i < 5; ++i) desk.move(450 + 10 * i, 280);
  desk.release();
  EXPECT_EQ(recording.lines(), 2u) << recording.script();
  desk.press(1);
  desk.move(470, 300);
  desk.explorer().input({.kind = Input::Kind::wheel, .turn = 1});  // another command within the gesture
  desk.move(480, 300);
  desk.release(1);
  EXPECT_EQ(recording.lines(), 5u) << recording.script();
}

TEST(Recording, anUndoReplacesNoLine) {
  Desk desk;
  desk.run("camera 1,2,1 ; camera 3,4,1 ; camera 5,6,1");
  Recording recording(desk.explorer(), {});
  desk.moveTo("canvas");
  desk.press();
  desk.key(Key::z, true);
  desk.key(Key::z, true);
  desk.release();
  EXPECT_EQ(recording.script(), "undo\nundo\n");
}

TEST(Recording, aGestureThatEndsWhereItBeganLeavesNoHistory) {
  Desk desk;
  desk.run("camera 1,2,1 ; camera 3,4,1 ; undo");
  desk.moveTo("canvas");
  const auto [x, y] = desk.explorer().ui().pointer();
  desk.press();
  desk.move(x + 50, y);
  EXPECT_FALSE(desk.explorer().canRedo());
  desk.move(x, y);
  desk.release();
  EXPECT_TRUE(desk.explorer().canRedo());
  EXPECT_EQ(history(desk.explorer()).size(), 2u);
}

TEST(Recording, theFramesSizeIsNotUndone) {
  Desk desk;
  desk.run("camera 1,2,1 ; show size=700x500 ; undo");
  EXPECT_EQ(desk.explorer().view().width, 700);
  EXPECT_FALSE(desk.explorer().canUndo());
}

/// Moves the mouse to a random widget and clicks, drags or types there.
void doAnything(Desk& desk, std::mt19937& random) {
  const auto below = [&](int n) { return int(random() % unsigned(n)); };
  std::vector<std::string> targets;
  for (const auto& [path, widget] : desk.explorer().widgets())
    if (widget.enabled && widget.rect.width() > 2 && widget.rect.height() > 2 && path != "build/rebuild" &&
        path != "build/compare" && path != "build/steps" && path != "bar/copy-view" && path != "bar/save" &&
        !path.starts_with("files/entry"))
      targets.push_back(path);
  for (int i = 0; i < 4; ++i) targets.emplace_back("canvas");
  desk.moveTo(targets[std::size_t(below(int(targets.size())))]);
  const auto [x, y] = desk.explorer().ui().pointer();
  const int button = below(2);
  switch (below(8)) {
    case 0:
      desk.explorer().input({.kind = Input::Kind::wheel, .turn = double(below(5) - 2)});
      break;
    case 1:
    case 2:
      desk.press(button);
      for (int i = 0; i < 3; ++i) desk.move(x + below(61) - 30, y + below(61) - 30);
      if (below(4) == 0) desk.explorer().input({.kind = Input::Kind::wheel, .turn = 1});
      if (below(4) == 0) desk.key(Key::z, true);
      if (below(8) != 0) desk.release(button);
      break;
    case 3:
      desk.press(0, true);
      desk.release();
      desk.type(std::to_string(below(9)));
      if (below(3) != 0) desk.key(Key::enter);
      break;
    case 4:
      desk.key(below(2) == 0 ? Key::z : Key::y, true);
      break;
    default:
      desk.press();
      desk.release();
  }
}

TEST(Recording, randomInputReplaysToTheSameFrameAndHistory) {
  std::size_t lines = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Desk desk;
    Recording recording(desk.explorer(), {});
    desk.explorer().run(kFirst);
    std::mt19937 random(seed);
    for (int i = 0; i < 60; ++i) try {
        doAnything(desk, random);
      } catch (const Error&) {  // a value out of range; the window would show this error
      }
    desk.explorer().releaseInput();
    for (bool drawn = false; !drawn;) try {
        desk.explorer().frame();
        drawn = true;
      } catch (const Error&) {  // a plane outside of the domain cannot be drawn
        desk.explorer().run("undo");
      }
    desk.explorer().message = {};
    recording.notePointer();
    Desk again;
    again.run(recording.script());
    ASSERT_EQ(scriptOf(again.explorer().view()), scriptOf(desk.explorer().view())) << recording.script();
    const render::Image shown = desk.explorer().frame(), replayed = again.explorer().frame();
    EXPECT_EQ(shown.pixels, replayed.pixels) << recording.script();
    EXPECT_EQ(history(desk.explorer()), history(again.explorer())) << recording.script();
    lines += recording.lines();
  }
  EXPECT_GT(lines, 100u);  // ensures that the random gestures had effects
}

TEST(Recording, anotherScriptGivesAnotherFrame) {
  Desk desk, other;
  desk.run(std::string(kFirst) + "\ncamera 30,20,1.1");
  other.run(std::string(kFirst) + "\ncamera 31,20,1.1");
  EXPECT_NE(desk.explorer().frame().pixels, other.explorer().frame().pixels);
}

TEST(Explorer, aTextThatIsNoNumberIsAnErrorOfTheCommand) {
  Desk desk;
  desk.run(std::string(kFirst) +
           "\nshow slice ; color value-jump range=1e-6,1e-2 ; panel questions=false right-scroll=0");
  desk.explorer().frame();
  desk.click("view/low");
  desk.type("many");
  EXPECT_THROW(desk.key(Key::enter), Error);
  desk.explorer().releaseInput();
  EXPECT_NO_THROW(desk.explorer().frame());
}

TEST(LiveWork, showsAConstructionAndCancelsIt) {
  Desk desk;
  desk.run(std::string(kFirst) + "\npanel shown=false build=true");
  desk.explorer().frame();
  const std::uint64_t cells = desk.explorer().figures().leaves;
  const auto places = desk.explorer().widgets();
  int frames = 0;
  double furthest = 0;
  {
    LiveWork work(desk.explorer(), [&] {
      Explorer& explorer = desk.explorer();
      const render::Image frame = explorer.frame();
      EXPECT_EQ(frame.width, 900);
      const auto widgets = explorer.widgets();
      ASSERT_TRUE(widgets.contains("build/progress"));
      ASSERT_TRUE(widgets.contains("build/cancel"));
      for (const auto& [path, widget] : widgets)
        EXPECT_EQ(widget.enabled, path == "build/cancel" || path == "canvas") << path;
      for (const char* button : {"build/rebuild", "build/compare"}) {  // a double click must not cancel
        const UiRect &a = places.at(button).rect, &b = widgets.at("build/cancel").rect;
        EXPECT_TRUE(a.x1 <= b.x0 || b.x1 <= a.x0 || a.y1 <= b.y0 || b.y1 <= a.y0) << button;
      }
      furthest = std::max(furthest, explorer.work->fraction);
      // During the work, no other widget has an effect.
      const ViewState before = explorer.view();
      desk.click("bar/slice");
      desk.moveTo("canvas");
      explorer.input({.kind = Input::Kind::wheel, .turn = 1});
      EXPECT_TRUE(explorer.view() == before);
      if (++frames == 3) desk.click("build/cancel");
    });
    desk.run("settings target-error=1e-30");
    EXPECT_THROW(desk.click("build/rebuild"), Cancelled);
  }
  EXPECT_EQ(frames, 3);
  EXPECT_GT(furthest, 0);
  EXPECT_FALSE(desk.explorer().work);
  EXPECT_EQ(desk.explorer().figures().leaves, cells);
  EXPECT_TRUE(desk.explorer().widgets().contains("build/rebuild"));
}

/// Returns the share of the pixels of the explorer's picture that differ clearly between two frames.
double shareOfDifferent(const Explorer& explorer, const render::Image& a, const render::Image& b) {
  const UiRect canvas = layoutOf(explorer.view()).canvas;
  int different = 0;
  for (int y = int(canvas.y0); y < int(canvas.y1); ++y)
    for (int x = int(canvas.x0); x < int(canvas.x1); ++x) {
      int sum = 0;
      for (std::size_t channel = 0; channel < 3; ++channel) sum += std::abs(a.at(x, y)[channel] - b.at(x, y)[channel]);
      different += sum > 30;
    }
  return different / (canvas.width() * canvas.height());
}

/// Returns the frame that is shown while the first field is on its way.
render::Image frameWithoutField(Explorer& explorer) {
  explorer.work = Explorer::Work{.task = "opening"};
  render::Image frame = explorer.frame();
  explorer.work.reset();
  return frame;
}

TEST(LiveWork, showsTheMeshAtOnceAndTurnsIt) {
  constexpr const char* kOpening = "build builtin:torus target-error=1e-4";
  const std::string setting = std::string(kFirst) + "\nsurface shadows=false";  // the mesh throws none
  Desk desk(setting);
  Explorer& explorer = desk.explorer();
  Recording recording(explorer, {kOpening});
  const render::Image empty = frameWithoutField(explorer);
  std::optional<render::Image> first, turned;
  LiveWork work(explorer, [&] {
    if (first) return;
    first = explorer.frame();
    desk.moveTo("canvas");
    desk.press();
    for (int i = 1; i <= 3; ++i) {
      const auto [x, y] = explorer.ui().pointer();
      desk.move(x + 20, y + 40);
    }
    desk.release();
    explorer.input({.kind = Input::Kind::wheel, .turn = 1e6});  // too near for a camera: nothing happens
    turned = explorer.frame();
  });
  EXPECT_FALSE(desk.session().hasField());
  explorer.open(kOpening);
  ASSERT_TRUE(first && turned);
  EXPECT_GT(shareOfDifferent(explorer, empty, *first), 0.2) << "the mesh is shown";
  EXPECT_GT(shareOfDifferent(explorer, *first, *turned), 0.05) << "it was turned";
  const render::Image field = explorer.frame();
  EXPECT_LT(shareOfDifferent(explorer, *turned, field), 0.04) << "the field's surface is where the mesh was";
  recording.notePointer();
  Desk again(setting + "\n" + recording.script());
  EXPECT_TRUE(again.explorer().frame().pixels == field.pixels);
  EXPECT_EQ(history(again.explorer()), history(explorer));
  EXPECT_THAT(recording.script(), testing::MatchesRegex("build [^\n]*\ncamera [^\n]*\nui hover [^\n]*\n"));
}

TEST(LiveWork, showsTheFieldAsItGrows) {
  constexpr const char* kOpening = "build analytic:torus target-error=1e-6 grid=2,2,2";
  Desk desk(kFirst);
  Explorer& explorer = desk.explorer();
  Recording recording(explorer, {kOpening});
  const render::Image empty = frameWithoutField(explorer);
  std::vector<render::Image> surfaces, slices;
  const auto refresh = [&] {
    if (!explorer.showsUnfinished()) return;
    EXPECT_FALSE(desk.session().hasField());
    if (surfaces.empty()) {
      surfaces.push_back(explorer.frame());
      desk.click("bar/slice");
      desk.moveTo("canvas");
      explorer.input({.kind = Input::Kind::wheel, .turn = 1});
    }
    slices.push_back(explorer.frame());
  };
  LiveWork work(explorer, refresh, {.seconds = 0, .share = 1});
  explorer.open(kOpening);
  ASSERT_GE(slices.size(), 2U);
  EXPECT_GT(shareOfDifferent(explorer, empty, surfaces[0]), 0.2) << "the surface is shown";
  EXPECT_GT(shareOfDifferent(explorer, surfaces[0], slices[0]), 0.2) << "a slice was asked for";
  EXPECT_GT(shareOfDifferent(explorer, slices.front(), slices.back()), 0.05) << "the cells change";
  EXPECT_TRUE(explorer.view().slice);
  recording.notePointer();
  Desk again(std::string(kFirst) + "\n" + recording.script());
  EXPECT_TRUE(again.explorer().frame().pixels == explorer.frame().pixels);
  EXPECT_THAT(recording.script(),
              testing::MatchesRegex("build [^\n]*\nshow slice\nplane zoom=1.15\nui hover [^\n]*\n"));
}

/// A file that is opened while there is a field is shown as it grows, too. Gestures meanwhile are recorded after it.
TEST(LiveWork, showsTheMeshOfAFileThatIsOpenedLater) {
  Desk desk("build analytic:sphere target-error=1e-2\ncamera target=0.3,0,0\n" + std::string(kFirst));
  Explorer& explorer = desk.explorer();
  Recording recording(explorer, {});
  const render::Image before = explorer.frame();
  std::optional<render::Image> shown;
  bool cancels = true;
  LiveWork work(explorer, [&] {
    if (cancels) return desk.key(Key::escape);
    if (shown) return;
    shown = explorer.frame();
    desk.moveTo("canvas");
    const auto [x, y] = explorer.ui().pointer();
    desk.press();
    desk.move(x + 20, y + 40);
    desk.move(x + 30, y + 50);
    desk.release();
  });
  const std::string view = scriptOf(explorer.view());
  EXPECT_THROW(explorer.run("open builtin:torus"), Cancelled);
  EXPECT_EQ(scriptOf(explorer.view()), view);
  EXPECT_EQ(shareOfDifferent(explorer, before, explorer.frame()), 0) << "the field before it is shown again";
  cancels = false;
  explorer.run("open builtin:torus");
  ASSERT_TRUE(shown);
  EXPECT_GT(shareOfDifferent(explorer, before, *shown), 0.2);
  recording.notePointer();
  EXPECT_THAT(recording.script(), testing::MatchesRegex("open builtin:torus\ncamera [^\n]*\nui hover [^\n]*\n"));
  Desk again("build analytic:sphere target-error=1e-2\n" + std::string(kFirst) + "\n" + recording.script());
  EXPECT_TRUE(again.explorer().frame().pixels == explorer.frame().pixels);
}

/// A rebuild shows the field before it until the new one is finished.
TEST(LiveWork, showsTheFieldBeforeDuringARebuild) {
  Desk desk(std::string(kField) + "\n" + kFirst);
  Explorer& explorer = desk.explorer();
  const render::Image before = explorer.frame();
  int frames = 0;
  const auto refresh = [&] {
    ++frames;
    EXPECT_FALSE(explorer.showsUnfinished());
    EXPECT_EQ(shareOfDifferent(explorer, before, explorer.frame()), 0);
    if (frames == 3) desk.key(Key::escape);
  };
  LiveWork work(explorer, refresh, {.seconds = 0, .share = 1});
  desk.run("settings target-error=1e-30");
  EXPECT_THROW(explorer.run("apply"), Cancelled);
}

TEST(LiveWork, aConstructionThatFailsLeavesNoMesh) {
  Desk desk(kFirst);
  Explorer& explorer = desk.explorer();
  const render::Image empty = frameWithoutField(explorer);
  LiveWork work(explorer, [&] { desk.key(Key::escape); });
  EXPECT_THROW(explorer.open("build builtin:torus target-error=1e-30"), Cancelled);
  EXPECT_EQ(shareOfDifferent(explorer, empty, frameWithoutField(explorer)), 0);
}

TEST(LiveWork, tellsTheForecast) {
  Desk desk(kFirst);
  Explorer& explorer = desk.explorer();
  std::optional<Forecast> told;
  LiveWork work(explorer, [&] {
    if (explorer.work->forecast) told = explorer.work->forecast;
  });
  withProgress(desk.session().console(), [](const Progress& progress) {
    progress.forecast({.bytes = 1e6, .seconds = 30});
    for (int i = 0; i < 8; ++i) {
      progress.update("working", i / 8.0);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return 0;
  });
  ASSERT_TRUE(told);
  EXPECT_EQ(told->seconds, 30);
  EXPECT_EQ(forecastText(*told), "the field will take about 1.00 MB and about 30 s");
}

TEST(LiveWork, escapeCancelsWhileThePanelIsClosed) {
  Desk desk;
  desk.run(std::string(kFirst) + "\npanel all=false\nsettings target-error=1e-30");
  desk.explorer().frame();
  bool cancels = true;
  LiveWork work(desk.explorer(), [&] {
    if (cancels) desk.key(Key::escape);
  });
  EXPECT_THROW(desk.explorer().run("apply"), Cancelled);
  // After the cancelled construction, the next one runs to its end.
  cancels = false;
  desk.run("settings target-error=1e-3");
  EXPECT_NO_THROW(desk.explorer().run("apply"));
}

TEST(LiveWork, measurementsForAFrameCannotBeCancelled) {
  Desk desk;
  desk.run(kFirst);
  desk.explorer().frame();
  int frames = 0;
  LiveWork work(desk.explorer(), [&] {
    ++frames;
    desk.key(Key::escape);
    EXPECT_FALSE(desk.explorer().widgets().contains("build/cancel"));
  });
  const auto measure = [](const Progress& progress) {
    for (int i = 0; i < 8; ++i) {
      progress.report("measuring", i / 8.0);
      if (progress.cancelled()) throw Cancelled();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return 0;
  };
  EXPECT_NO_THROW(withProgress(desk.session().console(), measure));
  EXPECT_GE(frames, 1);
}

/// Notes whether a contour was made, and cancels contours if asked to.
class ContourListener final : public WorkListener {
 public:
  explicit ContourListener(Session& session) : session_(session) { session.setListener(this); }
  ~ContourListener() override { session_.setListener(nullptr); }
  void report(std::string_view task, double) override {
    if (task == "meshing") isContour_ = true;
  }
  bool wantsCancel() override { return isContour_ && cancels; }
  void ended() override {
    contours += isContour_ ? 1 : 0;
    isContour_ = false;
  }
  std::atomic<bool> cancels = true;
  int contours = 0;  ///< number of contours that were begun

 private:
  Session& session_;
  std::atomic<bool> isContour_ = false;
};

TEST(LiveWork, theContourOfShownTrianglesCanBeCancelled) {
  Desk desk;
  desk.run(kFirst);
  ContourListener listener(desk.session());
  EXPECT_THROW(desk.run("triangles shown=true"), Cancelled);
  EXPECT_FALSE(desk.explorer().view().triangles) << "nothing has changed";
  listener.cancels = false;
  desk.run("triangles shown=true tolerance=1%");
  EXPECT_NE(desk.explorer().shownContour(), nullptr);

  listener.cancels = true;
  EXPECT_THROW(desk.run("surface offset=0.05"), Cancelled);
  EXPECT_EQ(desk.explorer().view().surfaceOffset, 0);
  EXPECT_NE(desk.explorer().shownContour(), nullptr) << "the former one is kept";

  // A cancelled contour of a new field leaves the field, without triangles.
  desk.explorer().run("build analytic:torus target-error=1e-3");
  EXPECT_FALSE(desk.explorer().view().triangles);
  EXPECT_THAT(desk.explorer().message.text, HasSubstr("the triangles are hidden: their contour was cancelled"));
  const int before = listener.contours;
  desk.explorer().frame();
  EXPECT_EQ(listener.contours, before) << "no frame makes a contour";
}

TEST(LiveWork, theContourIsMadeWhenAGestureHasEnded) {
  Desk desk;
  desk.run(kFirst);
  desk.run("triangles shown=true tolerance=1%");
  Recording recording(desk.explorer(), {});
  ContourListener listener(desk.session());
  listener.cancels = false;
  const auto drag = [&](double by) {
    desk.moveTo("view/offset");
    const auto [x, y] = desk.explorer().ui().pointer();
    desk.press();
    for (int i = 1; i <= 4; ++i) {
      desk.move(x + by * i / 4, y);
      desk.explorer().frame(i);
    }
    EXPECT_EQ(desk.explorer().shownContour(), nullptr);
    EXPECT_EQ(listener.contours, 0);
    desk.release();
  };
  drag(20);
  EXPECT_EQ(listener.contours, 1);
  EXPECT_NE(desk.explorer().shownContour(), nullptr);
  EXPECT_TRUE(desk.explorer().isStale()) << "the picture is drawn again, with the triangles";
  EXPECT_THAT(recording.script(), HasSubstr("surface offset="));
  const double offset = desk.explorer().view().surfaceOffset;

  listener.contours = 0;
  listener.cancels = true;
  EXPECT_THROW(drag(40), Cancelled);
  EXPECT_EQ(desk.explorer().view().surfaceOffset, offset) << "the gesture is undone";
  EXPECT_NE(desk.explorer().shownContour(), nullptr);
  EXPECT_THAT(recording.script(), HasSubstr("undo"));
}

TEST(Registry, theWindowIsForTheCommandLine) {
  const Registry registry = makeRegistry();
  try {
    parseScript(registry, "test", "view builtin:torus", {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("test:1:1: 'view' is a command of the command line"));
  }
}

}  // namespace live_explorer_test
}  // namespace hpsdf::app
