// Tests the explorer's panels: sections, questions, tooltips, the keyboard, the gizmo, the guessed up axis.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <sstream>

#include "explorer/explorer.h"
#include "explorer/explorer_commands.h"
#include "explorer_bench.h"
#include "hpsdf/error.h"
#include "language/script.h"
#include "pictures/up_axis.h"
#include "support/made_meshes.h"

namespace hpsdf::app {
namespace panels_test {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kSphere = "build analytic:sphere target-error=1e-2 ; show cpu=true size=900x600\n";

struct Bench : ExplorerBench {
  explicit Bench(const std::string& script = kSphere) { run(script); }

  const std::string& focus() { return explorer().ui().focus(); }
  void key(Key key, bool shift = false) { explorer().input({.kind = Input::Kind::key, .key = key, .shift = shift}); }
  void type(const std::string& text) { explorer().input({.kind = Input::Kind::type, .text = text}); }
  /// Presses Tab until the control has the focus.
  void tabTo(const std::string& path) {
    for (int i = 0; i < 200 && focus() != path; ++i) key(Key::tab);
    ASSERT_EQ(focus(), path);
  }
};

/// Returns the paths of the controls that take input.
std::set<std::string> controls(Bench& bench) {
  std::set<std::string> paths;
  for (const auto& [path, widget] : bench.explorer().widgets())
    if (widget.isControl && widget.enabled) paths.insert(path);
  return paths;
}

TEST(Panels, sectionsFoldToTheirHeadings) {
  Bench bench;
  EXPECT_FALSE(bench.explorer().widgets().contains("view/azimuth")) << "the camera is folded at first";
  bench.run("ui click camera/fold");
  EXPECT_TRUE(bench.view().isUnfolded(Panel::camera));
  EXPECT_TRUE(bench.explorer().widgets().contains("view/azimuth"));
  bench.run("undo");
  EXPECT_FALSE(bench.view().isOpen(Panel::camera));
  bench.run("ui click bar/columns");
  EXPECT_EQ(layoutOf(bench.view()).canvas.width(), 900);
  bench.run("panel camera=true");
  EXPECT_TRUE(bench.view().isOpen(Panel::left)) << "a section that is unfolded opens its column";
  EXPECT_FALSE(bench.view().isOpen(Panel::right));
  bench.run("panel left=false camera=true");
  EXPECT_FALSE(bench.view().isOpen(Panel::left)) << "a copied view says both";
  bench.run("panel all=true");
  EXPECT_FALSE(bench.view().isOpen(Panel::keys)) << "the list of keys would hide the picture";
}

TEST(Panels, eachQuestionIsOneStepAndShowsAnotherView) {
  Bench bench("build analytic:torus target-error=1e-3 estimator=embedded ; show cpu=true size=900x600");
  bench.run("show slice ; plane zoom=3 ; surface offset=0.1 clip=x ; cells lines");
  const ViewState before = bench.view();
  std::set<std::string> scripts;
  for (const Preset& preset : presets()) {
    bench.run(std::string("ui click questions/") + preset.name);
    scripts.insert(scriptOf(bench.view()));
    EXPECT_NO_THROW(bench.explorer().frame()) << preset.name;
    bench.run("undo");
    EXPECT_TRUE(bench.view() == before) << preset.name;
    bench.run("redo ; undo");
  }
  EXPECT_EQ(scripts.size(), presets().size());
  bench.run("preset worst");
  const Interface& worst = bench.session.jumps().interfaces[bench.explorer().worst(1)[0]];
  EXPECT_EQ(bench.view().mark, worst.worst);
  EXPECT_EQ(bench.view().surfaceColors.by, render::ColorBy::valueJump);
  EXPECT_TRUE(bench.view().worstOnSurface);
  EXPECT_TRUE(bench.view().isUnfolded(Panel::worst));
  bench.run("preset whole");
  EXPECT_FALSE(bench.view().mark || bench.view().clip || bench.view().slice);
}

TEST(Panels, aQuestionThatFailsChangesNothing) {
  // Cells of a field that is continuous everywhere have no interfaces at which it jumps; one cell has none at all.
  Bench bench("build analytic:sphere target-error=1 grid=1 max-depth=0 ; show cpu=true size=900x600 ; show slice");
  const ViewState before = bench.view();
  EXPECT_THAT(bench.failure("preset worst"), HasSubstr("the field has 0 interfaces"));
  EXPECT_TRUE(bench.view() == before);
  EXPECT_THAT(bench.failure("undo; undo"), HasSubstr("nothing to undo")) << "only 'show slice' can be undone";
}

TEST(Panels, everyControlHasATooltip) {
  Bench bench;
  std::set<std::string> without;
  for (const char* view : {"show surface", "show slice", "color value-jump range=0,1 scale=linear", "show surface",
                           "cells lines ; triangles shown=true ; plane in-space=true ; surface clip=x"}) {
    bench.run(std::string("panel all=true ; ") + view);
    for (const auto& [path, widget] : bench.explorer().widgets())
      if (widget.isControl && widget.help.find_first_not_of(" \n") == std::string::npos) without.insert(path);
  }
  EXPECT_THAT(without, IsEmpty());
  EXPECT_THAT(bench.explorer().widgets().at("view/cells").help, HasSubstr("Lines along their edges"));
  EXPECT_THAT(bench.explorer().widgets().at("view/cells").help, HasSubstr("In scripts: cells "));
}

/// Returns the rectangle that holds all pixels in which the pictures differ.
UiRect difference(const render::Image& a, const render::Image& b) {
  UiRect rect{1e9, 1e9, -1, -1};
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x)
      if (a.at(x, y) != b.at(x, y))
        rect = {std::min(rect.x0, double(x)), std::min(rect.y0, double(y)), std::max(rect.x1, x + 1.0),
                std::max(rect.y1, y + 1.0)};
  return rect;
}

constexpr render::Color kTip = {42, 45, 56};  // nearly: the colour of tooltips over the light of a frame

TEST(Panels, tooltipsAreWithinTheFrameAndBesideTheirControls) {
  Bench bench;
  for (const char* size : {"900x600", "640x420"}) {
    bench.run(std::string("panel all=true ; panel histograms=false ; show size=") + size);
    for (const std::string& path : controls(bench)) {
      const Widget widget = bench.explorer().widgets().at(path);
      if (!(widget.rect.width() > 0 && widget.rect.height() > 0)) continue;
      bench.run("ui hover " + path);
      const render::Image with = bench.explorer().frame();
      int dark = 0, covered = 0;
      for (int y = 0; y < with.height; ++y)
        for (int x = 0; x < with.width; ++x) {
          const render::Color& c = with.at(x, y);
          if (std::abs(c[0] - kTip[0]) > 8 || std::abs(c[1] - kTip[1]) > 8 || std::abs(c[2] - kTip[2]) > 8) continue;
          ++dark;
          covered += widget.rect.contains(x, y);
        }
      EXPECT_GT(dark, 800) << path << " at " << size;
      EXPECT_LT(covered, 0.3 * widget.rect.width() * widget.rect.height()) << path << " is covered by its tooltip";
      const render::Image again = bench.explorer().frame();
      EXPECT_TRUE(same(with, again));
    }
  }
  bench.run("show size=900x600 ; ui hover bar/slice");
  const render::Image with = bench.explorer().frame();
  bench.explorer().input({.kind = Input::Kind::press});
  const UiRect gone = difference(with, bench.explorer().frame());
  EXPECT_GT(gone.width(), 100) << "no tooltip while a button is down";
}

TEST(Panels, tabReachesEveryControl) {
  for (const char* kind : {"surface", "slice"})
    for (const char* size : {"1000x1400", "900x420"}) {
      Bench bench;
      bench.run(std::string("panel all=true ; show size=") + size + " ; show " + kind);
      bench.run("worst page=2 ; color value-jump range=0.1,1 ; surface clip=x ; cells lines ; undo");
      const std::set<std::string> expected = controls(bench);
      std::set<std::string> reached;
      for (std::size_t i = 0; i < expected.size(); ++i) {
        bench.key(Key::tab);
        reached.insert(bench.focus());
        const UiRect rect = bench.explorer().widgets().at(bench.focus()).rect;
        EXPECT_TRUE(rect.width() > 0 && rect.height() > 0) << bench.focus() << " is scrolled out of sight";
      }
      EXPECT_EQ(reached, expected) << kind << ' ' << size;
      const std::string last = bench.focus();
      bench.key(Key::tab);
      EXPECT_NE(bench.focus(), last);
      bench.key(Key::tab, true);
      EXPECT_EQ(bench.focus(), last) << "Shift goes back";
    }
}

TEST(Panels, keysUseTheControlWithTheFocus) {
  Bench bench;
  bench.run("panel camera=true ; show size=900x1000");
  bench.tabTo("bar/slice");
  bench.key(Key::enter);
  EXPECT_TRUE(bench.view().slice);
  bench.run("show surface");
  bench.tabTo("view/cracks");
  bench.key(Key::space);
  EXPECT_TRUE(bench.view().cracks);
  bench.key(Key::space);
  EXPECT_FALSE(bench.view().cracks);
  bench.tabTo("view/cells");
  bench.key(Key::down);
  EXPECT_EQ(bench.view().cells.style, render::CellStyle::lines);
  bench.key(Key::down);
  bench.key(Key::down);
  EXPECT_EQ(bench.view().cells.style, render::CellStyle::boxes) << "the list ends";
  bench.key(Key::left);
  EXPECT_EQ(bench.view().cells.style, render::CellStyle::lines);
  bench.tabTo("view/degrees");
  bench.type("2-4");
  bench.key(Key::enter);
  EXPECT_EQ(bench.view().cells.degrees, (std::vector{2, 3, 4})) << "a field takes text as soon as it is chosen";
  bench.tabTo("view/arrows");
  bench.key(Key::right);
  EXPECT_EQ(bench.view().arrows, 1);
  bench.key(Key::enter);
  bench.type("60");
  bench.key(Key::enter);
  EXPECT_EQ(bench.view().arrows, 60) << "Enter types the number of a slider";
  bench.tabTo("camera/fold");
  bench.key(Key::enter);
  EXPECT_FALSE(bench.view().isOpen(Panel::camera));
  bench.key(Key::escape);
  EXPECT_EQ(bench.focus(), "");
  bench.tabTo("view/cells");
  bench.run("ui click canvas");
  EXPECT_EQ(bench.focus(), "") << "the mouse takes the focus away";
}

TEST(Panels, aTextIsEnteredWhenItsFieldLosesTheKeyboard) {
  Bench bench;
  bench.run("panel questions=false shown=false colors=false build=true ; show size=900x1000");
  const auto wanted = [&] {
    const auto& settings = bench.explorer().settings();
    const auto found = settings.find("target-error");
    return found == settings.end() ? "" : found->second;
  };
  const auto error = [&] { return bench.session.current().field.metadata().settings.targetError.weighted(); };
  bench.run("ui click build/target-error");
  bench.type("1e-3");
  bench.run("ui click build/rebuild");
  EXPECT_EQ(error(), 1e-3) << "the field is entered before the button is pressed";
  bench.run("ui click build/target-error");
  bench.type("1e-4");
  bench.run("ui click build/mesh");  // a field above it
  EXPECT_EQ(wanted(), "1e-4");
  bench.tabTo("build/target-error");
  bench.type("1e-5");
  bench.key(Key::tab);
  EXPECT_EQ(wanted(), "1e-5");
  bench.run("ui click build/target-error");
  bench.type("1e-6");
  bench.key(Key::escape);
  bench.run("ui click canvas");
  EXPECT_EQ(wanted(), "1e-5") << "Escape discards the text";
  bench.run("ui click build/target-error");
  bench.type("1e-6");
  bench.explorer().releaseInput();
  EXPECT_EQ(wanted(), "1e-5") << "no line of a recording enters it";
  bench.run("ui click build/target-error");
  bench.type("none");
  EXPECT_THAT(bench.failure("ui click build/rebuild"), HasSubstr("target-error"));
  bench.explorer().input({.kind = Input::Kind::release});
  EXPECT_EQ(error(), 1e-3) << "a click that fails to enter a text does nothing else";
}

TEST(Panels, tellThatSettingsAreNotThoseOfTheField) {
  Bench bench;
  bench.run("build analytic:sphere target-error=1e-3 grid=4 ; panel build=true");
  const auto below = [&] { return bench.explorer().widgets().at("build/steps").rect.y0; };
  const double without = below();
  bench.run("settings target-error=0.001 grid=4,4,4");
  EXPECT_EQ(below(), without) << "the field has these settings already";
  bench.run("settings target-error=1e-4");
  EXPECT_GT(below(), without + 5) << "a line stands above the slider";
  bench.run("apply");
  EXPECT_EQ(below(), without);
}

TEST(Panels, escapeClosesAnOpenList) {
  Bench bench;
  bench.run("ui click view/cells");
  EXPECT_TRUE(bench.explorer().widgets().contains("view/cells/lines"));
  bench.run("ui key escape");
  EXPECT_FALSE(bench.explorer().widgets().contains("view/cells/lines"));
  bench.run("ui click bar/slice");
  EXPECT_TRUE(bench.view().slice) << "the list has not taken the click";
}

TEST(Panels, tabGoesOnFromTheControlThatTheMouseHasPressed) {
  Bench bench;
  bench.run("panel camera=true build=true ; show size=900x1200");
  const auto next = [&](const std::string& path, bool shift = false) {
    bench.run("ui click " + path);
    EXPECT_EQ(bench.focus(), "") << "the mouse shows no ring";
    bench.key(Key::tab, shift);
    return bench.focus();
  };
  EXPECT_EQ(next("view/azimuth"), "view/elevation");
  EXPECT_EQ(next("view/elevation", true), "view/azimuth");
  EXPECT_EQ(next("build/target-error"), "build/grid");
  EXPECT_EQ(next("bar/surface"), "bar/slice");
  bench.run("ui click view/cells");
  EXPECT_EQ(next("view/cells/none"), "view/offset") << "an entry stands for its list";
  EXPECT_EQ(next("canvas"), "bar/open");
}

TEST(Panels, theFocusIsSeenAndEndsWithTheInput) {
  Bench bench;
  const render::Image without = bench.explorer().frame();
  bench.key(Key::tab);
  EXPECT_FALSE(same(bench.explorer().frame(), without));
  bench.explorer().releaseInput();  // a recording does not hold the focus
  EXPECT_TRUE(same(bench.explorer().frame(), without));
}

/// Returns the number of reddish pixels of the panel below the picture.
int reddish(Bench& bench) {
  const render::Image frame = bench.explorer().frame();
  const UiRect rect = layoutOf(bench.view()).readout;
  int count = 0;
  for (int y = int(rect.y0); y < int(rect.y1); ++y)
    for (int x = int(rect.x0); x < int(rect.x1); ++x) count += frame.at(x, y)[0] > frame.at(x, y)[2] + 80;
  return count;
}

/// Returns the first control of a section of levels, such as "degrees/3".
std::string firstLevel(Bench& bench, const std::string& section) {
  for (const auto& [path, widget] : bench.explorer().widgets())
    if (path.starts_with(section + "/") && path != section + "/fold") return path;
  ADD_FAILURE() << "no level in " << section;
  return "bar/keys";
}

TEST(Panels, aLevelThatIsPressedShowsItsCellsAndHidesThemAgain) {
  Bench bench;
  bench.run("panel histograms=true worst=false statistics=false ; color degree");
  for (const std::string section : {"degrees", "depths", "legend"}) {
    const std::string path = firstLevel(bench, section);
    const std::vector<int> level = {std::stoi(path.substr(path.find('/') + 1))};
    const auto shown = [&] { return section == "depths" ? bench.view().cells.depths : bench.view().cells.degrees; };
    EXPECT_THAT(bench.explorer().widgets().at(path).help, HasSubstr("Show the cells of"));
    bench.run("ui click " + path);
    EXPECT_EQ(bench.view().cells.style, render::CellStyle::lines) << path;
    EXPECT_EQ(shown(), level) << path;
    EXPECT_THAT(bench.explorer().widgets().at(path).help, HasSubstr("Hide the cells of"));
    bench.run("ui click " + path);
    EXPECT_EQ(bench.view().cells.style, render::CellStyle::none) << path;
    EXPECT_THAT(shown(), IsEmpty()) << path;
  }
  bench.run("ui click " + firstLevel(bench, "degrees") + " ; ui click " + firstLevel(bench, "depths"));
  EXPECT_THAT(bench.view().cells.degrees, IsEmpty()) << "a depth shows its cells of all degrees";
  bench.run("cells boxes depths=all");
  bench.run("ui click " + firstLevel(bench, "degrees"));
  EXPECT_EQ(bench.view().cells.style, render::CellStyle::boxes) << "boxes stay boxes";
  bench.run("cells none degrees=all ; show slice ; ui click " + firstLevel(bench, "degrees"));
  EXPECT_FALSE(bench.view().slice) << "cells stand in the picture of the surface";
  EXPECT_EQ(bench.view().cells.style, render::CellStyle::lines);
  bench.run("undo");
  EXPECT_TRUE(bench.view().slice) << "a press is one step";
}

TEST(Panels, problemsHaveAnInkOfTheirOwn) {
  Bench bench;
  bench.explorer().message = {"view copied as 12 lines of script"};
  EXPECT_EQ(reddish(bench), 0);
  for (const char* script : {"open", "panel", "preset"}) {
    bench.explorer().tellProblem(std::string("panel:1:1: ") + script + ":1:7: bunny.obj:3:1: not a number");
    EXPECT_EQ(bench.explorer().message.text, "bunny.obj:3:1: not a number") << "without the explorer's scripts";
  }
  EXPECT_GT(reddish(bench), 100);
}

TEST(Panels, aLongPathShowsTheNameOfItsFile) {
  Bench bench;
  bench.run("panel questions=false shown=false colors=false build=true");
  const auto drawn = [&](const std::string& path) {
    bench.run("settings mesh=" + path);
    const render::Image frame = bench.explorer().frame();
    const UiRect rect = bench.explorer().widgets().at("build/mesh").rect;
    std::vector<render::Color> pixels;
    for (int y = int(rect.y0); y < int(rect.y1); ++y)
      for (int x = int(rect.x0); x < int(rect.x1); ++x) pixels.push_back(frame.at(x, y));
    return pixels;
  };
  const std::string folder = "/a/folder/whose/name/is/longer/than/the/field/";
  EXPECT_NE(drawn(folder + "bunny.obj"), drawn(folder + "horse.obj"));
  EXPECT_EQ(drawn("/other" + folder + "bunny.obj"), drawn("/there" + folder + "bunny.obj"));
  bench.run("ui click build/mesh");
  bench.type("x.obj");
  bench.key(Key::enter);
  EXPECT_EQ(bench.explorer().settings().at("mesh"), "x.obj") << "the whole path is edited";
}

TEST(Panels, keysChangeTheView) {
  Bench bench;
  bench.type("p");
  EXPECT_TRUE(bench.view().slice);
  bench.type("3");
  bench.type("s");
  EXPECT_FALSE(bench.view().slice);
  EXPECT_EQ(bench.view().camera.azimuthDegrees, 30) << "a slice has no camera";
  bench.type("3");
  EXPECT_EQ(bench.view().camera.azimuthDegrees, -90);
  bench.run("ui click view/beside");
  bench.type("p");
  EXPECT_FALSE(bench.view().slice) << "a text takes the letter";
}

TEST(Panels, theListOfKeysIsOpenedAndClosed) {
  Bench bench;
  const render::Image without = bench.explorer().frame();
  const auto isShown = [&] {
    EXPECT_EQ(same(bench.explorer().frame(), without), !bench.view().isOpen(Panel::keys));
    return bench.view().isOpen(Panel::keys);
  };
  bench.type("?");
  EXPECT_TRUE(isShown());
  EXPECT_THAT(controls(bench), IsEmpty()) << "a click on the list must not press what lies below it";
  bench.type("?");
  EXPECT_FALSE(isShown());
  bench.key(Key::f1);
  EXPECT_TRUE(isShown());
  bench.key(Key::escape);
  EXPECT_FALSE(isShown());
  bench.key(Key::f1);
  const ViewState before = bench.view();
  bench.run("ui drag canvas 50,0");
  EXPECT_FALSE(bench.view().isOpen(Panel::keys));
  EXPECT_EQ(bench.view().camera.azimuthDegrees, before.camera.azimuthDegrees) << "the click only closes the list";
}

TEST(Panels, theGizmoLooksAlongTheAxes) {
  for (const char* up : {"y", "z"}) {
    Bench bench;
    bench.run(std::string("panel all=false ; show size=240x240 ; camera up=") + up);
    for (const char* end : {"x", "-x", "y", "-y", "z", "-z"}) {
      bench.run(std::string("camera 30,20,1.1 ; ui click gizmo/") + end);
      const render::Camera camera =
          render::cameraOf(bench.view().camera, Box(Vector3(-1, -1, -1), Vector3(1, 1, 1)), 9, 9);
      const std::string name = end;
      Vector3 axis = Vector3::Unit(name.back() - 'x');
      if (name.size() == 2) axis = -axis;
      EXPECT_LT((camera.forward + axis).norm(), 1e-9) << "up " << up << ": seen from " << end;
      bench.run(std::string("ui click gizmo/") + end);
      const render::Camera other =
          render::cameraOf(bench.view().camera, Box(Vector3(-1, -1, -1), Vector3(1, 1, 1)), 9, 9);
      EXPECT_LT((other.forward - axis).norm(), 1e-9) << "the end that points to the viewer turns the view around";
    }
  }
  Bench bench;
  bench.run("ui drag gizmo/x 50,0");
  EXPECT_NEAR(bench.view().camera.azimuthDegrees, 10, 1e-9) << "a drag turns";
  bench.run("show slice");
  EXPECT_FALSE(bench.explorer().widgets().contains("gizmo/x"));
}

TEST(Panels, theUpAxisIsGuessedByTheBase) {
  Bench bench("build builtin:torus target-error=1e-3 ; show cpu=true size=900x600");
  EXPECT_EQ(bench.view().camera.up, render::UpAxis::y) << "scripts ask for a guess";
  bench.run("camera up=auto");
  EXPECT_EQ(bench.view().camera.up, render::UpAxis::z) << "the torus lies on its flat side";
  bench.run("build analytic:sphere target-error=1e-2");
  EXPECT_EQ(bench.view().camera.up, render::UpAxis::y) << "without a larger base";
  bench.run("build builtin:box target-error=1e-2");
  EXPECT_EQ(bench.view().camera.up, render::UpAxis::y);
  bench.run("build builtin:gear target-error=1e-3");
  EXPECT_EQ(bench.view().camera.up, render::UpAxis::z);
  bench.run("camera up=y");
  bench.run("build builtin:torus target-error=1e-3");
  EXPECT_EQ(bench.view().camera.up, render::UpAxis::y) << "an axis that was chosen stays";
  bench.run("camera up=auto ; copy-view");
  EXPECT_THAT(bench.out.str(), HasSubstr(" up=z ")) << "a copied view names the axis";
}

/// A table of four legs, which stands along z.
TriangleMesh table() {
  TriangleMesh mesh = support::boxBetween({-1, -0.6, 0.8}, {1, 0.6, 0.9});
  for (const double x : {-0.8, 0.7})
    for (const double y : {-0.5, 0.4})
      mesh = support::joined(std::move(mesh), support::boxBetween({x, y, 0}, {x + 0.1, y + 0.1, 0.8}));
  return mesh;
}

TEST(Panels, theAreaBetweenFeetIsPartOfTheBase) {
  TriangleMesh mesh = table();
  EXPECT_EQ(guessedUp(mesh), render::UpAxis::z);
  for (Vector3& v : mesh.vertices) v = Vector3(v.x(), v.z(), -v.y());
  EXPECT_EQ(guessedUp(mesh), render::UpAxis::y);
}

}  // namespace panels_test
}  // namespace hpsdf::app
