// Tests how the explorer opens and writes files, and that its frame follows the scale, without a window.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "explorer/explorer.h"
#include "explorer_bench.h"
#include "hpsdf/error.h"
#include "hpsdf/field_file.h"
#include "language/script.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace explorer_files_test {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

constexpr const char* kSphere = "build analytic:sphere target-error=1e-2; show cpu=true size=900x600\n";

/// An explorer with a folder of files.
struct Bench : ExplorerBench {
  support::TemporaryDirectory folder;

  std::string file(const std::string& name) const { return (folder.path() / name).string(); }
  void key(Key key, bool control = false) {
    explorer().input({.kind = Input::Kind::key, .key = key, .control = control});
  }
  std::vector<std::string> paths() {
    std::vector<std::string> paths;
    for (const auto& [path, widget] : explorer().widgets()) paths.push_back(path);
    return paths;
  }
  /// Lets the open dialog list the folder.
  void list(const std::string& path) { run("ui type files/name " + path); }
};

/// Returns the number of rows of a frame that have dark pixels, the ink of text, within a widget.
int textHeight(const render::Image& frame, const UiRect& rect) {
  int rows = 0;
  for (int y = int(rect.y0); y < int(rect.y1); ++y) {
    bool isInked = false;
    for (int x = int(rect.x0); x < int(rect.x1); ++x) isInked |= frame.at(x, y)[0] < 110;
    rows += isInked;
  }
  return rows;
}

/// Text, widgets and columns have the same size in points at each scale.
TEST(FrameScale, everySizeOfTheFrameIsProportionalToIt) {
  struct Sizes {
    int text;
    Layout layout;
    std::map<std::string, Widget> widgets;
  };
  std::map<double, Sizes> at;
  for (const double scale : {1.0, 1.5, 2.0}) {
    Bench bench;
    bench.run("build analytic:sphere target-error=1e-2");
    bench.run("show cpu=true scale=" + std::to_string(scale) + " size=" + std::to_string(int(1100 * scale)) + "x" +
              std::to_string(int(700 * scale)));
    const render::Image frame = bench.explorer().frame();
    const auto widgets = bench.explorer().widgets();
    at[scale] = {textHeight(frame, widgets.at("bar/slice").rect), layoutOf(bench.explorer().view()), widgets};
  }
  const Sizes& plain = at.at(1);
  EXPECT_GE(plain.text, 8);
  for (const double scale : {1.5, 2.0}) {
    const Sizes& scaled = at.at(scale);
    EXPECT_NEAR(scaled.text / scale, plain.text, 1) << scale;
    EXPECT_EQ(scaled.layout.canvas.x0, scale * plain.layout.canvas.x0);
    EXPECT_EQ(scaled.layout.canvas.y0, scale * plain.layout.canvas.y0);
    EXPECT_EQ(scaled.widgets.size(), plain.widgets.size());
    for (const auto& [path, widget] : plain.widgets) {
      ASSERT_TRUE(scaled.widgets.contains(path)) << path;
      const UiRect &small = widget.rect, large = scaled.widgets.at(path).rect.times(1 / scale);
      EXPECT_NEAR(large.x0, small.x0, 3 + 0.02 * small.x0) << path;  // the advances of glyphs are whole pixels
      EXPECT_NEAR(large.y0, small.y0, 2) << path;
      EXPECT_NEAR(large.height(), small.height(), 2) << path;
    }
  }
}

TEST(FrameScale, gesturesMoveAsFarInPoints) {
  Bench bench;
  bench.run(std::string(kSphere) + "show size=1800x1200 scale=2; ui drag canvas 100,0");
  EXPECT_NEAR(bench.explorer().view().camera.azimuthDegrees, 30 - 0.4 * 50, 1e-9);
  bench.run("undo");
  EXPECT_EQ(bench.explorer().view().scale, 2) << "undo never changes the frame";
  EXPECT_THAT(bench.failure("show scale=5"), HasSubstr("from 1 to 4"));
}

/// While the view moves, frames have one sample a pixel; the finished frame has those that are asked for.
TEST(FrameSamples, aFrameIsFinishedInSteps) {
  Bench bench;
  bench.run(std::string(kSphere) + "show samples=2; surface shadows=false");
  Explorer& explorer = bench.explorer();
  const render::Image small = explorer.frame(2), plain = explorer.frame(1);
  EXPECT_TRUE(explorer.isStale());
  EXPECT_EQ(explorer.picture()->samples, 1);
  const render::Image finished = explorer.frame();
  EXPECT_FALSE(explorer.isStale());
  EXPECT_EQ(explorer.picture()->samples, 2);
  EXPECT_FALSE(plain.pixels == finished.pixels);
  EXPECT_FALSE(plain.pixels == small.pixels);
  EXPECT_TRUE(explorer.frame(3).pixels == finished.pixels) << "it is not drawn anew";
  bench.run("show samples=1");
  EXPECT_TRUE(explorer.frame(1).pixels == plain.pixels);
  EXPECT_FALSE(explorer.isStale());
}

TEST(ExplorerFiles, withoutAFieldTheFrameInvites) {
  Bench bench;
  bench.run("show cpu=true size=900x600");
  EXPECT_THAT(bench.paths(), IsSupersetOf({"start/open", "start/shape/torus"}));
  EXPECT_THAT(bench.paths(), Not(Contains("start/1"))) << "scripts know no recent files";
  bench.explorer().frame();
  bench.run("ui drag 450,100 30,0; ui wheel 450,100 1; ui hover 450,100");
  EXPECT_EQ(bench.explorer().view().camera.azimuthDegrees, 30) << "there is nothing to turn";
  bench.run("ui click start/shape/torus");
  EXPECT_EQ(bench.session.current().name, "builtin:torus");
  EXPECT_THAT(bench.paths(), IsSupersetOf({"bar/open", "bar/save", "canvas"}));
}

TEST(ExplorerFiles, recentFilesAreOffered) {
  Bench bench;
  bench.run(std::string(kSphere) + "save output=" + bench.file("one.hpsdf"));
  Bench other;
  other.run("show cpu=true size=900x600");
  other.explorer().recentFiles = {bench.file("one.hpsdf"), "two.obj"};
  EXPECT_THAT(other.paths(), IsSupersetOf({"start/1", "start/2"}));
  other.run("ui click start/1");
  EXPECT_EQ(other.session.current().name, bench.file("one.hpsdf"));
  other.run("ui click bar/open");
  EXPECT_THAT(other.paths(), Contains("files/entry/two.obj"));
}

TEST(ExplorerFiles, theDialogListsWhatCanBeOpened) {
  Bench bench;
  bench.run(std::string(kSphere) + "save output=" + bench.file("ball.hpsdf"));
  bench.run("contour output=" + bench.file("ball.obj") + " tolerance=5%");
  std::filesystem::create_directory(bench.file("inner"));
  std::filesystem::copy(bench.file("ball.hpsdf"), bench.file("inner/deep.hpsdf"));
  std::ofstream(bench.file("notes.txt")) << "notes";
  std::ofstream(bench.file(".hidden.obj")) << "v 0 0 0";
  const std::string before = bench.session.current().name;

  bench.run("ui click bar/open");
  bench.list(bench.folder.path().string());
  EXPECT_THAT(bench.paths(), IsSupersetOf({"files/entry/inner/", "files/entry/ball.hpsdf", "files/entry/ball.obj"}));
  EXPECT_THAT(bench.paths(), Not(Contains(HasSubstr("notes"))));
  EXPECT_THAT(bench.paths(), Not(Contains(HasSubstr("hidden"))));
  EXPECT_THAT(bench.failure("ui click bar/slice"), HasSubstr("takes no input now"));
  bench.run("ui key escape");
  EXPECT_THAT(bench.paths(), Not(Contains(HasSubstr("files/"))));
  EXPECT_EQ(bench.session.current().name, before);

  // The keyboard: down to the folder, into it, down to the file.
  bench.key(Key::o, true);
  bench.list(bench.folder.path().string());
  bench.key(Key::down);
  bench.key(Key::enter);
  EXPECT_THAT(bench.paths(), Contains("files/entry/deep.hpsdf"));
  bench.key(Key::up);
  bench.key(Key::enter);
  EXPECT_EQ(bench.session.current().name, bench.file("inner/deep.hpsdf"));

  // The mouse: the dialog begins in the folder of the last file; a second click on a file opens it.
  bench.run("ui click bar/open; ui click files/up");
  bench.run("ui click files/entry/ball.obj");
  EXPECT_EQ(bench.session.current().name, bench.file("inner/deep.hpsdf"));
  bench.run("ui click files/entry/ball.obj");
  EXPECT_EQ(bench.session.current().name, bench.file("ball.obj"));
  EXPECT_THAT(bench.failure("ui click bar/open; ui type files/name nowhere.obj"), HasSubstr("nowhere.obj"));
  EXPECT_EQ(bench.session.current().name, bench.file("ball.obj"));
}

TEST(ExplorerFiles, aPressOutsideTheDialogClosesIt) {
  Bench bench;
  bench.run(std::string(kSphere) + "ui click bar/open");
  bench.run("ui click 450,570");
  EXPECT_THAT(bench.paths(), Not(Contains(HasSubstr("files/"))));
  EXPECT_FALSE(bench.session.explanation()) << "the press does nothing else";
  bench.run("ui click bar/open");
  bench.explorer().releaseInput();
  EXPECT_THAT(bench.paths(), Not(Contains(HasSubstr("files/")))) << "no frame of a recording has it";
}

TEST(ExplorerFiles, theEndingTellsWhatIsWritten) {
  Bench bench;
  bench.run(kSphere);
  std::vector<std::string> lines;
  bench.explorer().onCommand = [&](const std::string& line, bool) { lines.push_back(line); };
  const auto save = [&](const std::string& name) {
    bench.key(Key::s, true);
    bench.run("ui type files/name " + bench.file(name));
    return lines.back();
  };
  EXPECT_EQ(save("frame.png"), "shot panels=false output=" + bench.file("frame.png"));
  EXPECT_TRUE(same(render::loadPng(bench.file("frame.png")), bench.explorer().picture()->image)) << "nothing over it";
  EXPECT_EQ(save("ball.hpsdf"), "save output=" + bench.file("ball.hpsdf"));
  bench.run("surface offset=0.125");
  EXPECT_EQ(save("ball.stl"), "contour output=" + bench.file("ball.stl") + " offset=0.125");
  EXPECT_EQ(save("ball.vti"), "export output=" + bench.file("ball.vti"));
  for (const char* name : {"frame.png", "ball.hpsdf", "ball.stl", "ball.vti"})
    EXPECT_TRUE(std::filesystem::exists(bench.file(name))) << name;

  // The buttons change the ending of the proposed name.
  std::filesystem::remove(bench.file("frame.png"));
  const auto proposed = [&] { return bench.explorer().widgets().contains("files/choose"); };
  bench.run("ui click bar/save; ui click files/as-field");
  EXPECT_TRUE(proposed());
  bench.run("ui key escape");
  EXPECT_FALSE(proposed());
}

TEST(ExplorerFiles, aPictureWithoutPanelsIsWhatTheCanvasShows) {
  Bench bench;
  bench.run(std::string(kSphere) + "save output=" + bench.file("ball.hpsdf"));
  bench.run("show size=1280x720; ui hover bar/save; shot panels=false output=" + bench.file("one.png"));
  EXPECT_TRUE(same(render::loadPng(bench.file("one.png")), bench.explorer().picture()->image)) << "no tooltip, no axes";
  EXPECT_EQ(bench.session.picture().corner, (std::array{0, 0})) << "for the command pick";
  bench.run("ui hover 640,715; show slice; beside " + bench.file("ball.hpsdf") +
            "; shot panels=false output=" + bench.file("two.png"));
  const render::Image two = render::loadPng(bench.file("two.png")), frame = bench.explorer().frame();
  const Layout layout = layoutOf(bench.view());
  ASSERT_EQ(two.width, int(layout.beside.x1 - layout.canvas.x0));
  ASSERT_EQ(two.height, int(layout.canvas.height()));
  int different = 0;
  for (int y = 0; y < two.height; ++y)
    for (int x = 0; x < two.width; ++x)
      different += two.at(x, y) != frame.at(int(layout.canvas.x0) + x, int(layout.canvas.y0) + y);
  EXPECT_EQ(different, 0) << "with the names of the fields";
}

/// The dialog asks before it replaces a file, and names that it cannot write stay in it.
TEST(ExplorerFiles, theDialogStaysOpenUntilAFileCanBeWritten) {
  Bench bench;
  bench.run(kSphere);
  const auto isOpen = [&] { return bench.explorer().widgets().contains("files/name"); };
  const auto save = [&](const std::string& name) {
    bench.key(Key::s, true);
    bench.run("ui type files/name " + bench.file(name));
  };
  save("ball.foo");
  ASSERT_TRUE(isOpen()) << "nothing is written with this ending";
  bench.run("ui click files/as-field; ui click files/choose");
  EXPECT_FALSE(isOpen());
  EXPECT_TRUE(std::filesystem::exists(bench.file("ball.hpsdf"))) << "the name was kept";
  EXPECT_EQ(bench.explorer().message.text, bench.file("ball.hpsdf") + " written");
  EXPECT_FALSE(bench.explorer().message.isProblem);
  save("view");
  EXPECT_FALSE(isOpen());
  EXPECT_TRUE(std::filesystem::exists(bench.file("view.png"))) << "a name without an ending is a picture's";

  std::ofstream(bench.file("kept.png")) << "not yet";
  const auto size = [&] { return std::filesystem::file_size(bench.file("kept.png")); };
  save("kept.png");
  ASSERT_TRUE(isOpen());
  EXPECT_EQ(size(), 7u) << "the dialog asks first";
  bench.key(Key::escape);
  save("kept.png");
  ASSERT_TRUE(isOpen()) << "it asks each time";
  bench.key(Key::enter);
  EXPECT_FALSE(isOpen());
  EXPECT_GT(size(), 7u);
}

TEST(ExplorerFiles, aCopiedViewIsTold) {
  Bench bench;
  bench.run(std::string(kSphere) + "ui click bar/copy-view");
  EXPECT_THAT(bench.explorer().message.text, testing::MatchesRegex("view copied as [0-9]+ lines of script"));
  bench.explorer().input({.kind = Input::Kind::press});
  EXPECT_EQ(bench.explorer().message.text, "") << "the next press ends it";
}

TEST(ExplorerFiles, besideAndOtherPickAFile) {
  Bench bench;
  bench.run(std::string(kSphere) + "save output=" + bench.file("ball.hpsdf"));
  bench.run("show size=1280x720; show slice; color difference other=" + bench.file("ball.hpsdf"));
  bench.run("panel build=false; ui click view/beside-file; ui type files/name " + bench.file("ball.hpsdf"));
  EXPECT_EQ(bench.explorer().view().beside, bench.file("ball.hpsdf"));
  bench.run("ui click view/other-file");
  EXPECT_THAT(bench.paths(), Contains("files/entry/ball.hpsdf")) << "the folder of the last file";
}

TEST(ExplorerFiles, anotherFileIsSeenAsAWhole) {
  Bench bench;
  bench.run(std::string(kSphere) + "camera target=0.5,0,0 up=z; surface offset=0.1 clip=x; worst mark=0.1,0,0");
  const ViewState before = bench.explorer().view();
  EXPECT_THAT(bench.failure("open nowhere.hpsdf"), HasSubstr("nowhere.hpsdf"));
  EXPECT_TRUE(bench.explorer().view() == before) << "a file that cannot be opened changes nothing";
  EXPECT_THAT(bench.failure("open notes.txt"), HasSubstr("neither a field nor a mesh"));
  bench.run("open builtin:torus");
  EXPECT_EQ(bench.session.current().name, "builtin:torus");
  const ViewState& view = bench.explorer().view();
  EXPECT_FALSE(view.camera.target || view.clip || view.mark);
  EXPECT_EQ(view.surfaceOffset, 0);
  EXPECT_EQ(view.camera.up, render::UpAxis::z) << "the user's choices stay";
  EXPECT_EQ(view.width, 900);
  EXPECT_FALSE(bench.explorer().canUndo());
}

TEST(ExplorerFiles, aRebuiltFieldIsComparedWithTheOneBeforeIt) {
  Bench bench;
  EXPECT_THAT(bench.failure(std::string(kSphere) + "beside kept"), HasSubstr("no field is kept"));
  bench.run(
      "panel questions=false shown=false colors=false build=true; ui type build/target-error 1e-4; "
      "ui click build/compare");
  const auto error = [](const Field& field) { return field.metadata().settings.targetError.weighted(); };
  EXPECT_EQ(error(bench.session.current().field), 1e-4);
  EXPECT_EQ(bench.explorer().view().beside, "kept");
  EXPECT_EQ(error(bench.session.other("kept").field), 1e-2);
  bench.explorer().frame();
  ASSERT_TRUE(bench.explorer().pictureBeside());
  bench.run("color difference other=kept ; beside none");
  EXPECT_NO_THROW(bench.explorer().frame());
  bench.run("apply");
  EXPECT_EQ(error(bench.session.other("kept").field), 1e-2) << "it is kept until another one is";
}

}  // namespace explorer_files_test
}  // namespace hpsdf::app
