// Tests the explorer without a window: the effects of its commands, widgets and mouse on its state and pictures.

#include "explorer/explorer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "explorer/exact_outline.h"
#include "explorer_bench.h"
#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"
#include "language/script.h"
#include "session/field_summary.h"
#include "support/made_meshes.h"
#include "support/require_gl.h"
#include "support/temporary_directory.h"
#include "widgets/raster.h"

namespace hpsdf::app {
namespace explorer_test {

using ::testing::HasSubstr;

using Bench = ExplorerBench;

constexpr const char* kTorus =
    "build analytic:torus target-error=1e-4 estimator=embedded; show cpu=true size=900x600\n";

TEST(Explorer, aCopiedViewIsRestoredExactly) {
  Bench bench;
  bench.run(std::string(kTorus) +
            "camera 41.3,-17.25,0.7 target=0.1,0.2,-0.05 up=z projection=orthographic\n"
            "surface offset=0.03125 cracks=true defects=builtin:box clip=y clip-offset=0.1 shown=false\n"
            "cells boxes degrees=2,4-6 depths=0-2 ; arrows 31 ; plane in-space=true operands=builtin:box\n"
            "triangles shown=true tolerance=2.5% simplify=true\n"
            "plane through=0.1,0,0,1,0.5,0.25 zoom=2.5 target=0.1,-0.3,0.7\n"
            "color depth of=surface ; color slope of=slice range=1e-3,0.5 scale=linear map=heat\n"
            "worst by=gradient on=surface page=2 mark=0.1,0.25,-0.5 ; panel build=true worst=true shown=false "
            "bar=false left=false keys=true left-scroll=3\n"
            "show slice samples=2 size=640x400 scale=1.25");
  const ViewState wanted = bench.view();
  bench.out.str("");
  bench.run("copy-view");
  const std::string script = bench.out.str();

  Bench other;
  other.run(kTorus);
  EXPECT_FALSE(other.view() == wanted);
  const render::Image before = other.explorer().frame();
  other.run(script);
  EXPECT_TRUE(other.view() == wanted) << script << scriptOf(other.view());
  EXPECT_TRUE(same(other.explorer().frame(), bench.explorer().frame()));
  EXPECT_FALSE(same(other.explorer().frame(), before));

  // A copied view sets every part of the state, so that the previous state does not matter.
  other.run(
      "camera target=center ; plane axis=x offset=0.2 target=center ; surface clip=none ; color degree range=auto");
  other.run(script);
  EXPECT_TRUE(other.view() == wanted);
}

TEST(Explorer, theEstimateStandsBesideTheMeasuredErrors) {
  Bench bench;
  bench.run(kTorus);
  const Field& measured = bench.session.current().field;
  EXPECT_THAT(estimateLine(measured),
              testing::MatchesRegex("weighted estimate .τ. [0-9.e-]+, measured near the surface "
                                    "RMS [0-9.e-]+, greatest [0-9.e-]+"));
  bench.run("smooth");
  EXPECT_THAT(estimateLine(bench.session.current().field), testing::EndsWith(", not measured"));
}

TEST(Explorer, defectsOfTheMeshAreMarked) {
  Bench bench;
  const support::TemporaryDirectory folder;
  const std::string open = (folder.path() / "open.obj").string();
  saveMesh(support::openBox(), open);
  bench.run("build " + open + " target-error=1e-2; show cpu=true size=900x600; camera 30,40,1.1 up=z");
  const render::Image plain = bench.explorer().frame();
  bench.run("surface defects=own");
  const render::Image marked = bench.explorer().frame();
  EXPECT_FALSE(same(plain, marked));
  EXPECT_THAT(bench.explorer().picture()->details, testing::Contains("boundary edges: 4"));
  EXPECT_THAT(bench.failure("surface defects=nowhere.obj"), HasSubstr("nowhere.obj"));
  EXPECT_TRUE(same(bench.explorer().frame(), marked));
  bench.run("surface defects=none");
  EXPECT_TRUE(same(bench.explorer().frame(), plain));
  bench.run("build analytic:torus target-error=1e-3");
  EXPECT_THAT(bench.failure("surface defects=own"), HasSubstr("an analytic shape has no mesh"));
}

TEST(Explorer, undoAndRedoChangeTheStateStepByStep) {
  Bench bench;
  bench.run(kTorus);
  const ViewState first = bench.view();
  bench.run("show slice");
  const ViewState second = bench.view();
  bench.run("color depth");
  bench.run("color depth");  // changes nothing, so that it adds no step to the history
  bench.run("undo");
  EXPECT_TRUE(bench.view() == second);
  bench.run("undo");
  EXPECT_TRUE(bench.view() == first);
  bench.run("redo");
  EXPECT_TRUE(bench.view() == second);
  bench.run("show surface");
  EXPECT_THAT(bench.failure("redo"), HasSubstr("nothing to redo"));
  bench.run("undo; undo");  // undo never changes the size of the frame
  EXPECT_THAT(bench.failure("undo"), HasSubstr("test:1:1: there is nothing to undo"));
}

TEST(Explorer, undoTakesBackAWholeGesture) {
  Bench bench;
  bench.run(kTorus);
  const ViewState before = bench.view();
  std::vector<std::string> recorded;
  bench.explorer().onCommand = [&](const std::string& line, bool replaces) {
    if (replaces) recorded.pop_back();
    recorded.push_back(line);
  };
  bench.run("ui drag canvas 50,-25");
  EXPECT_NEAR(bench.view().camera.azimuthDegrees, 30 - 0.4 * 50, 1e-9);
  EXPECT_NEAR(bench.view().camera.elevationDegrees, 20 - 0.4 * 25, 1e-9);
  EXPECT_THAT(recorded, ::testing::ElementsAre("camera 10,10,1.1"));
  bench.run("undo");
  EXPECT_TRUE(bench.view() == before);

  bench.run("ui wheel canvas 2");
  EXPECT_NEAR(bench.view().camera.distance, 1.1 / (1.15 * 1.15), 1e-4);
  bench.run("ui drag canvas 40,0 button=right");
  ASSERT_TRUE(bench.view().camera.target);

  bench.run("show slice; ui wheel canvas 3; ui drag canvas 30,10");
  EXPECT_NEAR(bench.view().zoom, std::pow(1.15, 3), 1e-3);
  ASSERT_TRUE(bench.view().sliceTarget);
  const render::SlicePicture picture = slicePicture(bench.view(), bench.session.current().field);
  EXPECT_EQ(std::get<render::AxisPlane>(picture.plane).offset, 0) << "dragging moves within the plane";
}

TEST(Explorer, aPointStaysUnderTheMouseThatDragsIt) {
  for (const char* view : {"show slice", "show surface; camera 90,0,1", "camera projection=orthographic"}) {
    Bench bench;
    bench.run(std::string(kTorus) + view);
    const bool slice = bench.view().slice;
    bench.run("ui hover canvas");
    bench.explorer().frame();
    const auto [x, y] = bench.explorer().ui().pointer();
    const UiRect canvas = layoutOf(bench.view()).canvas;
    const auto before = render::pickAt(bench.session.current().field, *bench.explorer().picture(), int(x - canvas.x0),
                                       int(y - canvas.y0) - 80);
    bench.run(std::string("ui drag canvas 32,48") + (slice ? "" : " button=right"));
    bench.explorer().frame();
    const auto after = render::pickAt(bench.session.current().field, *bench.explorer().picture(),
                                      int(x - canvas.x0) + 32, int(y - canvas.y0) - 80 + 48);
    ASSERT_TRUE(before && after) << view;
    // In perspective, points that are not in the target's plane move by slightly more or less than the mouse.
    EXPECT_LT((before->position - after->position).norm(), slice ? 0.004 : 0.12) << view;
  }
}

TEST(Explorer, aClickExplainsTheCell) {
  Bench bench;
  bench.run("build builtin:torus,segments=24,sides=12 target-error=1e-5; show cpu=true size=900x600; show slice");
  bench.run("ui hover canvas");
  bench.explorer().frame();
  const render::Image before = bench.explorer().frame();
  bench.run("ui click canvas");
  ASSERT_TRUE(bench.session.explanation());
  const Vector3 point = bench.session.explanation()->point;
  const Cell cell = bench.session.current().field.cellAt(point);
  EXPECT_THAT(bench.session.explanation()->lines.front(), HasSubstr("cell " + std::to_string(cell.id)));
  EXPECT_THAT(bench.out.str(), HasSubstr("How the construction arrived at this cell"));
  EXPECT_FALSE(same(before, bench.explorer().frame())) << "the picture shows the reasons";
  bench.run("ui drag canvas 40,0");
  EXPECT_FALSE(bench.session.explanation()) << "a drag shows something else, and explains nothing";
  bench.run("why point=0.7,0,0; undo");
  EXPECT_FALSE(bench.session.explanation()) << "so does undo";
  EXPECT_EQ(bench.failure("why point=0.7,0,0; expect why(0.7,0,0).agrees == 1"), "nothing failed");
}

TEST(Explorer, eachKindOfWidgetRunsItsCommand) {
  Bench bench;
  bench.run(kTorus);
  bench.run("ui click bar/slice");
  EXPECT_TRUE(bench.view().slice);
  bench.run("ui click view/color; ui click view/color/value-jump");
  EXPECT_EQ(bench.view().sliceColors.by, render::ColorBy::valueJump);
  bench.run("ui click view/pinned");
  ASSERT_TRUE(bench.view().sliceColors.scale.limits) << "pinned to what was chosen";
  bench.run("ui type view/low 1e-5");
  EXPECT_EQ((*bench.view().sliceColors.scale.limits)[0], 1e-5);
  bench.run("ui type view/plane-offset 0.125");
  EXPECT_EQ(bench.view().planeOffset, 0.125);
  bench.run("panel camera=true; ui drag view/zoom 30,0");
  EXPECT_GT(bench.view().zoom, 2);
  bench.run("ui click view/whole");
  EXPECT_EQ(bench.view().zoom, 1);
  bench.run("ui click statistics/fold");
  EXPECT_TRUE(bench.view().isOpen(Panel::statistics));
  bench.run("ui click statistics/fold");
  EXPECT_FALSE(bench.view().isOpen(Panel::statistics));
  bench.run("panel histograms=false worst=true; ui click worst/next; ui click worst/2");
  EXPECT_EQ(bench.view().worstPage, 1);
  EXPECT_EQ(*bench.view().sliceTarget, bench.session.jumps().interfaces[bench.explorer().worst(10)[9]].worst);
  bench.run("ui key z control=true");
  EXPECT_FALSE(bench.view().sliceTarget);
  bench.run("panel all=false build=true; ui type build/target-error 1e-3; ui click build/rebuild");
  EXPECT_EQ(bench.session.current().field.metadata().settings.targetError.weighted(), 1e-3);
  EXPECT_THAT(bench.failure("ui type build/target-error abc; ui click build/rebuild"),
              HasSubstr("target-error: expected a number"));
}

TEST(Explorer, missingAndDisabledWidgetsAreErrors) {
  Bench bench;
  EXPECT_THAT(bench.failure("ui click bar/slice"), HasSubstr("the frame has no widget 'bar/slice'"));
  EXPECT_THAT(bench.failure("shot output=none.png"), HasSubstr("no field"));
  bench.run(kTorus);
  EXPECT_THAT(bench.failure("ui click view/colour"), HasSubstr("no widget 'view/colour'; did you mean 'view/color'?"));
  EXPECT_THAT(bench.failure("ui click view/color/depth"), HasSubstr("no widget 'view/color/depth'")) << "not open";
  EXPECT_THAT(bench.failure("panel camera=true; ui click view/center"), HasSubstr("takes no input now"));
  EXPECT_THAT(bench.failure("show size=400x200 ; ui click worst/8"), HasSubstr("widget"));
  EXPECT_THAT(bench.failure("ui clik view/color"), HasSubstr("did you mean 'click'?"));
  EXPECT_THAT(bench.failure("ui drag canvas 12"), HasSubstr("expected DX,DY"));
  EXPECT_THAT(bench.failure("ui drag canvas"), HasSubstr("a value is missing"));
  EXPECT_THAT(bench.failure("ui click canvas 3"), HasSubstr("takes no value"));
  EXPECT_THAT(bench.failure("ui key entr"), HasSubstr("did you mean 'enter'?"));
}

TEST(Explorer, theReadoutAgreesWithQueries) {
  Bench bench;
  bench.run(std::string(kTorus) + "show slice; ui hover canvas");
  bench.explorer().frame();
  const auto readout = bench.explorer().readout();
  ASSERT_TRUE(readout);
  const Field& field = bench.session.current().field;
  const Vector3 x = readout->pick.position;
  EXPECT_EQ(readout->value, field.value(x));
  EXPECT_EQ(readout->gradient, field.valueAndGradient(x).gradient);
  EXPECT_EQ(readout->pick.cell, field.cellAt(x).id);
  EXPECT_NEAR(readout->pick.value, readout->value, 1e-5);
  ASSERT_TRUE(readout->exact);
  EXPECT_NEAR(*readout->exact, 0.7 - 0.3, 0.01) << "in the middle of the torus";
  // The readout reports the distance to the nearest face of the cell.
  const Cell cell = field.cellAt(x);
  double nearest = 1e30;
  for (int axis = 0; axis < 3; ++axis)
    nearest = std::min({nearest, x[axis] - cell.box.min()[axis], cell.box.max()[axis] - x[axis]});
  EXPECT_NEAR(readout->toFace, nearest, 1e-9);

  bench.run("ui hover bar/slice");
  EXPECT_FALSE(bench.explorer().readout()) << "over a panel";
}

TEST(Explorer, picksOfAShotAgreeWithTheField) {
  HPSDF_REQUIRE_GL();
  Bench bench;
  const support::TemporaryDirectory folder;
  bench.run(std::string(kTorus) + "shot output=" + (folder / "a.png").string());
  const render::Image image = render::loadPng(folder / "a.png");
  EXPECT_TRUE(same(image, bench.explorer().frame()));
  EXPECT_FALSE(render::pickAt(bench.session.current().field, bench.session.picture(), 10, 300)) << "a panel";
  for (const char* backend : {"cpu=true", "cpu=false gl=software"}) {
    bench.run(std::string("show ") + backend + "; shot output=" + (folder / "b.png").string());
    int hits = 0;
    for (int x = 280; x < 620; x += 3)
      for (int y = 40; y < 540; y += 5) {
        const auto pick = render::pickAt(bench.session.current().field, bench.session.picture(), x, y);
        if (!pick) continue;
        ++hits;
        const Cell cell = bench.session.current().field.cellAt(pick->position);
        EXPECT_NEAR(bench.session.current().field.value(pick->position), pick->value, 1e-5);
        EXPECT_EQ(pick->cell, cell.id);
        EXPECT_EQ(pick->degree, cell.degree);
        EXPECT_EQ(pick->depth, cell.depth);
      }
    EXPECT_GT(hits, 2000) << backend;
  }
  bench.run("expect pick(450,200).jump.value < 1");
}

/// The list of places at the surface has fewer interfaces than the list of all, and all of them at the surface.
TEST(Explorer, worstPlacesCanBeThoseAtTheSurface) {
  Bench bench;
  bench.run(kTorus);
  const Field& field = bench.session.current().field;
  const auto farthest = [&] {
    double far = 0;
    for (const std::size_t index : bench.explorer().worst(8))
      far = std::max(far, std::abs(field.value(bench.session.jumps().interfaces[index].worst)));
    return far;
  };
  EXPECT_GT(farthest(), 0.2);
  bench.run("worst on=surface");
  EXPECT_LT(farthest(), 0.2);
  EXPECT_TRUE(bench.view().worstOnSurface);
  EXPECT_THAT(bench.failure("fly 7999"), HasSubstr("interfaces at the surface; give one of them"));
  const std::size_t worst = bench.explorer().worst(1)[0];
  bench.run("panel worst=true ; ui click worst/on ; ui click worst/on/all");
  EXPECT_FALSE(bench.view().worstOnSurface);
  EXPECT_NE(bench.explorer().worst(1)[0], worst);
}

TEST(Explorer, aMarkShowsTheSpotAScaleAndTheExactOutline) {
  Bench bench;
  bench.run(std::string(kTorus) + "panel all=false; show slice size=300x300");
  const render::Image plain = bench.explorer().frame();
  bench.run("worst mark=0.6,0.1,0");
  const render::Image marked = bench.explorer().frame();
  const render::SliceView view = render::sliceView(bench.session.current().field,
                                                   slicePicture(bench.view(), bench.session.current().field), 300, 300);
  int outline = 0, ring = 0;
  for (int y = 0; y < 300; ++y)
    for (int x = 0; x < 300; ++x) {
      const Vector3 p = render::pixelPoint(view, x, y, 300, 300);
      const double pixel = view.right.norm() / 300, toMark = (p - Vector3(0.6, 0.1, 0)).norm() / pixel;
      if (marked.at(x, y) == render::levelColor(kExactDegree) && toMark > 14) {
        ++outline;
        EXPECT_LT(std::abs(std::abs(std::hypot(p.x(), p.y()) - 0.7) - 0.3), 1.5 * pixel);
      }
      if (toMark > 7 && toMark < 13 && !(marked.at(x, y) == plain.at(x, y))) ++ring;
    }
  EXPECT_GT(outline, 300);
  EXPECT_GT(ring, 100);
  bench.run("worst mark=0.6,0.1,0.2");  // not in the plane
  const render::Image elsewhere = bench.explorer().frame();
  EXPECT_FALSE(same(elsewhere, marked));
  bench.run("worst mark=none");
  EXPECT_TRUE(same(bench.explorer().frame(), plain));
}

/// Runs a script and returns the point in the middle of the explorer's picture.
std::optional<render::Pick> middleAfter(Bench& bench, const std::string& kind, const std::string& script) {
  bench.run(kTorus + ("show " + kind + "; " + script));
  bench.explorer().frame();
  const auto& picture = *bench.explorer().picture();
  return render::pickAt(bench.session.current().field, picture, picture.image.width / 2, picture.image.height / 2);
}

TEST(Explorer, theTrianglesOfTheContourAreShownAndCounted) {
  Bench bench;
  bench.run(kTorus);
  const render::Image without = bench.explorer().frame();
  EXPECT_EQ(bench.explorer().shownContour(), nullptr);
  bench.run("triangles shown=true tolerance=1%");
  const Contour* coarse = bench.explorer().shownContour();
  ASSERT_NE(coarse, nullptr) << "the command made it";
  EXPECT_FALSE(same(bench.explorer().frame(), without));
  EXPECT_EQ(bench.explorer().shownContour(), coarse) << "it is kept from frame to frame";
  const std::size_t triangles = coarse->mesh.triangles.size();

  // It is that of the command `contour`.
  const support::TemporaryDirectory folder;
  bench.run("contour output=" + (folder / "t.ply").string() + " tolerance=1%");
  EXPECT_EQ(readMesh(folder / "t.ply").triangles.size(), triangles);

  // It can be simplified.
  bench.run("triangles simplify=true");
  EXPECT_LT(2 * bench.explorer().shownContour()->mesh.triangles.size(), triangles);
  bench.run("contour output=" + (folder / "s.ply").string() + " tolerance=1% simplify=true");
  EXPECT_EQ(readMesh(folder / "s.ply").triangles.size(), bench.explorer().shownContour()->mesh.triangles.size());
  bench.run("ui click view/simplify");
  EXPECT_EQ(bench.explorer().shownContour()->mesh.triangles.size(), triangles);

  // The commands that change the tolerance, the offset or the field make it anew, before they return.
  bench.run("triangles tolerance=0.3%");
  EXPECT_GT(bench.explorer().shownContour()->mesh.triangles.size(), triangles);
  const double area = surfaceArea(bench.explorer().shownContour()->mesh);
  for (const char* const line : {"surface offset=0.05", "build analytic:torus target-error=1e-3 estimator=embedded"}) {
    bench.run(line);
    ASSERT_NE(bench.explorer().shownContour(), nullptr) << line;
    EXPECT_GT(surfaceArea(bench.explorer().shownContour()->mesh), 1.05 * area) << line;
  }
  bench.run("undo");
  ASSERT_NE(bench.explorer().shownContour(), nullptr);
  EXPECT_NEAR(surfaceArea(bench.explorer().shownContour()->mesh), area, 0.02 * area);
  bench.run("redo; ui click view/tolerance; surface offset=0.02");  // a text field is open
  EXPECT_NE(bench.explorer().shownContour(), nullptr);
  EXPECT_THAT(bench.failure("triangles tolerance=0"), HasSubstr("tolerance"));
  EXPECT_THAT(bench.failure("triangles tolerance=1e-9"), HasSubstr("tolerance"));
  EXPECT_EQ(bench.view().trianglesTolerance, "0.3%") << "a tolerance that fails changes nothing";
}

TEST(Explorer, trianglesAreHiddenIfTheirContourCannotBeMade) {
  Bench bench;
  bench.run(kTorus);
  bench.run("triangles shown=true tolerance=0.02");
  bench.run("combine \"scale(builtin:box, 1000000)\" max-steps=1");
  EXPECT_FALSE(bench.view().triangles);
  EXPECT_THAT(bench.err.str(), HasSubstr("hpsdf: warning: the triangles are hidden: tolerance: must be at least"));
  EXPECT_NO_THROW(bench.explorer().frame());
  EXPECT_THAT(bench.failure("triangles shown=true"), HasSubstr("tolerance: must be at least"));
  bench.run("triangles shown=true tolerance=1%");
  EXPECT_NE(bench.explorer().shownContour(), nullptr);
}

TEST(Explorer, theFieldIsBlendedOnceForAllContours) {
  Bench bench;
  bench.run(kTorus);
  bench.run("triangles shown=true tolerance=2%");
  const Field* const blended = &bench.session.fieldOfContour(0);
  ASSERT_NE(blended, &bench.session.current().field);
  const auto* const nodes = blended->data().nodes.data();
  EXPECT_GT(blended->data().blend, 0);
  bench.run("surface offset=0.05");
  bench.run("triangles tolerance=3%");
  EXPECT_EQ(bench.session.fieldOfContour(0).data().nodes.data(), nodes) << "it is the same copy";
  bench.run("blend width=0.1");
  EXPECT_EQ(&bench.session.fieldOfContour(0), &bench.session.current().field) << "it is continuous already";
}

TEST(Explorer, slicesOutlineOperands) {
  Bench bench;
  bench.run(std::string(kTorus) + "show slice");
  EXPECT_THAT(bench.failure("plane operands=own"), HasSubstr("not built by 'combine'"));
  EXPECT_THAT(bench.failure("plane operands=union(builtin:box"), HasSubstr("column"));
  bench.run("combine \"union(builtin:torus, move(builtin:sphere,radius=0.3, 0, 0, 0.2))\" target-error=1e-2");
  const render::Image without = bench.explorer().frame();
  bench.run("plane operands=own");
  EXPECT_FALSE(same(bench.explorer().frame(), without));
  const auto& lines = bench.explorer().picture()->legend.lines;
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].name, "builtin:torus");
  EXPECT_EQ(lines[1].name, "move(builtin:sphere,radius=0.3, 0, 0, 0.2)");
  bench.run("plane operands=none");
  EXPECT_TRUE(same(bench.explorer().frame(), without));
}

TEST(Explorer, flyingLooksAtTheInterface) {
  Bench bench;
  for (const char* kind : {"slice", "surface"}) {
    const bool slice =
        kind == std::string("slice");  // which shows any place; of the surface, only those at the surface
    const auto pick = middleAfter(bench, kind, slice ? "worst on=all ; fly 3" : "worst on=surface ; fly 3");
    ASSERT_TRUE(pick) << kind;
    const Interface& face = bench.session.jumps().interfaces[bench.explorer().worst(3)[2]];
    EXPECT_LT((pick->position - face.worst).norm(),
              slice ? 0.05 : std::abs(bench.session.current().field.value(face.worst)) + 0.05)
        << kind;
  }
  EXPECT_THAT(bench.failure("fly 7999"), HasSubstr("rank: the field has"));
}

TEST(Explorer, flyingToAPointPutsItInTheMiddle) {
  Bench bench;
  for (const char* kind : {"slice", "surface"}) {
    bench.run("surface clip=none");
    const auto pick = middleAfter(bench, kind, "surface clip=x ; fly to=0.71,-0.2,0.25");
    ASSERT_TRUE(pick) << kind;
    EXPECT_LT((pick->position - Vector3(0.71, -0.2, 0.25)).norm(), 0.06) << kind;
    EXPECT_EQ(bench.view().mark, Vector3(0.71, -0.2, 0.25));
    EXPECT_EQ(bench.view().clip.has_value(), bench.view().slice) << "no cut hides what is behind it";
  }
  EXPECT_THAT(bench.failure("fly to=5,0,0"), HasSubstr("to: the point lies outside the field's domain"));
  EXPECT_THAT(bench.failure("fly 1 to=0,0,0"), HasSubstr("either the rank of an interface or to=X,Y,Z"));
  EXPECT_THAT(bench.failure("fly"), HasSubstr("either the rank of an interface or to=X,Y,Z"));
}

TEST(Explorer, aRebuildDropsParametersOfAnotherContinuity) {
  Bench bench;
  bench.run("build analytic:sphere target-error=1e-3 continuity=both continuity-weight=0.5 blend-width=0.1");
  bench.run("settings continuity=weak ; apply");
  EXPECT_EQ(bench.session.current().field.data().blend, 0);
  EXPECT_EQ(bench.session.current().field.metadata().settings.continuityWeight, 0.5);
  bench.run("build analytic:sphere target-error=1e-3 continuity=both continuity-weight=0.5 blend-width=0.1");
  bench.run("settings continuity=exact ; apply");
  EXPECT_EQ(bench.session.current().field.data().blend, 0.1);
  EXPECT_EQ(bench.session.current().field.metadata().settings.continuityWeight, std::nullopt);
}

TEST(Explorer, aRebuildUnchangedIsTheSameField) {
  Bench bench;
  bench.run("build builtin:gear strategy=hp target-error=1e-3 margin=0.2 grid=3,4,5 nearness=2 max-depth=4");
  const FieldData before = bench.session.current().field.data();
  bench.run("apply");
  EXPECT_EQ(bench.session.current().field.data().nodes, before.nodes);
  EXPECT_EQ(bench.session.current().field.data().coefficients, before.coefficients);
  bench.run("apply max-steps=3");
  EXPECT_EQ(bench.session.current().field.metadata().steps, 3u);
  EXPECT_EQ(bench.explorer().allSteps(), before.metadata.steps) << "the slider keeps its length";
  bench.run("apply");
  EXPECT_EQ(bench.session.current().field.data().nodes, before.nodes);
  bench.run("settings mesh=builtin:torus ; apply");
  EXPECT_EQ(bench.session.current().field.metadata().source.name, "builtin:torus");
  bench.run("settings max-steps=9 ; apply max-steps=2");
  EXPECT_EQ(bench.session.current().field.metadata().steps, 2u) << "what apply is given wins";
  bench.run("build analytic:sphere target-error=1e-2 coefficients=double ; settings max-steps=9 mesh=analytic:sphere");
  bench.run("apply");
  EXPECT_FALSE(bench.session.current().field.singlePrecision());
}

TEST(Explorer, aRebuildKeepsContinuity) {
  Bench bench;
  bench.run("build analytic:torus target-error=1e-3 enrich=true continuity=weak continuity-weight=0.5");
  const FieldData before = bench.session.current().field.data();
  bench.run("apply");
  const Field& again = bench.session.current().field;
  EXPECT_EQ(again.data().coefficients, before.coefficients);
  EXPECT_TRUE(again.metadata().settings.enrich);
  EXPECT_EQ(again.metadata().settings.continuityWeight, 0.5);
  bench.run("settings continuity=none enrich=false ; apply");
  EXPECT_FALSE(bench.session.current().field.metadata().settings.enrich);
  EXPECT_EQ(bench.session.current().field.metadata().settings.continuityWeight, std::nullopt);
}

TEST(Explorer, rebuildsWithinATolerance) {
  Bench bench;
  bench.run("build builtin:gear,teeth=3 tolerance=1% ; show size=900x1100 ; panel build=true");
  const auto settings = [&] { return bench.session.current().field.metadata().settings; };
  const double tolerance = settings().tolerance;
  EXPECT_TRUE(bench.explorer().widgets().contains("build/tolerance"));
  EXPECT_FALSE(bench.explorer().widgets().contains("build/strategy"));
  bench.run("settings grid=5 ; apply");
  EXPECT_EQ(settings().tolerance, tolerance);
  EXPECT_EQ(bench.session.current().field.grid()[0], 5U);
  bench.run("settings tolerance=2% ; apply");
  EXPECT_EQ(settings().tolerance, 2 * tolerance);
  bench.run("settings target-error=1e-3 ; apply");
  EXPECT_EQ(settings().tolerance, 0);
  EXPECT_EQ(settings().targetError.weighted(), 1e-3);
  bench.run("settings tolerance=2% ; apply");
  EXPECT_EQ(settings().tolerance, 2 * tolerance);
}

TEST(Explorer, rebuildsWhatWasSmoothedAfterATolerance) {
  Bench bench;
  bench.run("build builtin:gear,teeth=3 tolerance=2% grid=3 ; smooth ; show size=900x1100 ; panel build=true");
  const auto field = [&]() -> const Field& { return bench.session.current().field; };
  EXPECT_FALSE(bench.explorer().widgets().contains("build/tolerance"));
  EXPECT_TRUE(bench.explorer().widgets().contains("build/target-error"));
  bench.run("settings tolerance=2% ; apply");
  EXPECT_GT(field().metadata().settings.tolerance, 0);
  EXPECT_EQ(field().metadata().settings.continuityWeight, std::nullopt);
  bench.run("smooth ; settings target-error=1e-3 ; apply");
  EXPECT_EQ(field().metadata().settings.targetError.weighted(), 1e-3);
  EXPECT_TRUE(field().metadata().settings.continuityWeight);
  EXPECT_EQ(field().metadata().settings.quadrature, BuildOptions().quadrature);
  EXPECT_EQ(field().grid()[0], 3U);
}

TEST(Explorer, thePanelSetsCriterionContinuityAndBounds) {
  Bench bench;
  bench.run("build analytic:torus target-error=1e-2 ; show size=900x1100 ; panel build=true");
  const auto current = [&]() -> const Field& { return bench.session.current().field; };
  const auto offers = [&](const char* control) { return bench.explorer().widgets().contains(control); };
  EXPECT_FALSE(offers("build/continuity-weight"));
  EXPECT_FALSE(offers("build/blend-width"));
  bench.run("ui click build/criterion ; ui click build/criterion/optimal");
  bench.run("ui click build/estimator ; ui click build/estimator/residual");
  bench.run("ui click build/continuity ; ui click build/continuity/both");
  bench.run("ui type build/continuity-weight 0.7 ; ui type build/blend-width 0.1 ; ui click build/bounds");
  bench.run("ui click build/rebuild");
  EXPECT_EQ(current().metadata().settings.criterion, Criterion::optimal);
  EXPECT_EQ(current().metadata().settings.estimator, Estimator::residual);
  EXPECT_EQ(current().metadata().settings.continuityWeight, 0.7);
  EXPECT_EQ(current().data().blend, 0.1);
  EXPECT_FALSE(current().data().bounds.empty());
  // Without weak continuity, a continuity weight that was set earlier is ignored.
  bench.run("ui click build/continuity ; ui click build/continuity/none ; ui click build/bounds");
  EXPECT_FALSE(offers("build/continuity-weight"));
  EXPECT_FALSE(offers("build/blend-width"));
  bench.run("ui click build/rebuild");
  EXPECT_EQ(current().metadata().settings.continuityWeight, std::nullopt);
  EXPECT_EQ(current().data().blend, 0);
  EXPECT_TRUE(current().data().bounds.empty());
  EXPECT_EQ(current().metadata().settings.criterion, Criterion::optimal);
  // The panel shows the settings of the current field.
  bench.run("build analytic:torus target-error=1e-2 continuity=exact blend-width=0.05 bounds=true");
  EXPECT_TRUE(offers("build/blend-width"));
  EXPECT_FALSE(offers("build/continuity-weight"));
  bench.run("ui click build/rebuild");
  EXPECT_EQ(current().data().blend, 0.05);
  EXPECT_FALSE(current().data().bounds.empty());
}

TEST(Explorer, aFieldBesideHasTheSameView) {
  Bench bench;
  const support::TemporaryDirectory folder;
  const std::string same = folder / "same.hpsdf", coarse = folder / "coarse.hpsdf";
  bench.run("build analytic:torus target-error=1e-2 estimator=embedded output=" + coarse);
  bench.run(std::string(kTorus) + "save output=" + same + "; panel all=false; show size=800x300");
  const auto halves = [&] {
    const render::Image frame = bench.explorer().frame();
    std::size_t differing = 0;
    for (int y = 100; y < frame.height; ++y)  // the rows above show the names of the fields and the axes
      for (int x = 1; x < 400; ++x) differing += frame.at(x, y) != frame.at(400 + x, y);
    return differing;
  };
  for (const char* view :
       {"show slice; color degree", "color value-jump", "color error", "show surface; color depth"}) {
    bench.run(view);
    bench.run("beside " + same);
    EXPECT_EQ(halves(), 0u) << view;
    bench.run("beside " + coarse);
    EXPECT_GT(halves(), 1000u) << view;
  }
  bench.run("show slice; color degree; ui hover beside");
  bench.explorer().frame();
  const auto readout = bench.explorer().readout();
  ASSERT_TRUE(readout);
  const Field& other = bench.session.other(coarse).field;
  EXPECT_EQ(readout->value, other.value(readout->pick.position));
  EXPECT_EQ(readout->pick.cell, other.cellAt(readout->pick.position).id);
  EXPECT_THAT(bench.failure("beside " + (folder / "none.hpsdf").string()), HasSubstr("no such file"));
  bench.run("beside none");
  EXPECT_GT(halves(), 1000u) << "one picture over the whole width";
}

TEST(Explorer, fieldsBesideEachOtherHaveOneColourScaleAndFiguresOfTheirOwn) {
  Bench bench;
  const support::TemporaryDirectory folder;
  const std::string coarse = folder / "coarse.hpsdf", fine = folder / "fine.hpsdf";
  bench.run("build analytic:torus target-error=1e-2 estimator=embedded output=" + coarse);
  bench.run(std::string(kTorus) + "save output=" + fine + "; panel all=false; show size=800x300");
  const auto halves = [&] {
    bench.explorer().frame();
    return std::array{bench.explorer().picture()->image, bench.explorer().pictureBeside()->image};
  };
  for (const char* view : {"show slice; color degree", "color depth", "color error", "color value-jump", "color slope",
                           "show surface; color degree", "color error"}) {
    bench.run("load " + fine + "; color error mesh=analytic:torus; " + std::string(view) + "; beside " + coarse);
    const auto fineFirst = halves();
    bench.run("load " + coarse + "; beside " + fine);
    const auto coarseFirst = halves();
    EXPECT_TRUE(same(fineFirst[0], coarseFirst[1])) << view << ": the fine field has the same colours on either side";
    EXPECT_TRUE(same(fineFirst[1], coarseFirst[0])) << view;
    EXPECT_FALSE(same(fineFirst[0], fineFirst[1])) << view;
  }

  const auto column = [&] {
    const render::Image frame = bench.explorer().frame();
    std::vector<render::Color> pixels;
    for (int y = 40; y < 540; ++y)
      for (int x = 635; x < 900; ++x) pixels.push_back(frame.at(x, y));
    return pixels;
  };
  for (const char* panel : {"statistics", "histograms"}) {
    bench.run("show surface size=900x600; color normal; panel all=false " + std::string(panel) + "=true bar=true");
    bench.run("load " + fine + "; beside none");
    const auto alone = column();
    bench.run("beside " + fine);
    const auto twins = column();
    bench.run("beside " + coarse);
    EXPECT_NE(alone, twins) << panel;
    EXPECT_NE(column(), twins) << panel << ": the figures of the other field";
  }
}

TEST(Explorer, theFieldBesideMayDifferFromTheFieldOfColorDifference) {
  Bench bench;
  const support::TemporaryDirectory folder;
  const std::string twin = folder / "twin.hpsdf", sphere = folder / "sphere.hpsdf";
  bench.run("build analytic:sphere target-error=1e-2 output=" + sphere);
  bench.run(std::string(kTorus) + "save output=" + twin + "; panel all=false; show slice size=800x300");
  bench.run("color difference other=" + sphere + "; beside " + twin);
  for (const char* view : {"plane offset=0", "plane offset=0.1"}) {
    bench.run(view);
    const render::Image frame = bench.explorer().frame();
    std::size_t differing = 0;
    for (int y = 40; y < frame.height; ++y)  // the rows above show the names of the fields
      for (int x = 1; x < 400; ++x) differing += frame.at(x, y) != frame.at(400 + x, y);
    EXPECT_EQ(differing, 0u) << "left the field, right its twin, both against the sphere";
  }
}

TEST(Explorer, aChangedFileBesideIsReadAgain) {
  Bench bench;
  const support::TemporaryDirectory folder;
  const std::string other = folder / "other.hpsdf";
  bench.run("build analytic:sphere target-error=1e-2 output=" + other);
  bench.run(std::string(kTorus) + "show slice; beside " + other);
  const render::Image before = bench.explorer().frame();
  EXPECT_TRUE(same(bench.explorer().frame(), before));
  bench.run("build builtin:gear target-error=1e-2 output=" + other);
  bench.run(kTorus);
  EXPECT_FALSE(same(bench.explorer().frame(), before));
  std::filesystem::remove(other);
  bench.run("color depth");
  bench.explorer().frame();  // draws the field that was read before the file was removed
}

TEST(Explorer, aViewThatCannotBeDrawnIsReportedAndUndone) {
  Bench bench;
  const support::TemporaryDirectory folder;
  const std::string thin = folder / "thin.hpsdf";
  bench.run("build analytic:sphere target-error=1e-2 domain=-1.2,-1.2,-0.3,1.2,1.2,0.3 output=" + thin);
  bench.run(std::string(kTorus) + "show slice size=1280x720; beside " + thin);
  bench.explorer().frame();
  const render::Image before = bench.explorer().picture()->image;
  const std::string shot = "shot output=" + (folder / "a.png").string();
  bench.run("plane offset=0.5");
  EXPECT_THAT(bench.failure(shot), HasSubstr(thin + ": slice offset 0.5 lies outside")) << "which of the two";
  bench.run("ui click bar/undo");
  bench.explorer().frame();
  EXPECT_TRUE(same(bench.explorer().picture()->image, before));
}

TEST(Explorer, panelsSetTheFileThatAPictureNeeds) {
  Bench bench;
  const support::TemporaryDirectory folder;
  const std::string mesh = folder / "corner.obj", file = folder / "corner.hpsdf";
  std::ofstream(mesh) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  bench.run("build " + mesh + " target-error=1e-2 output=" + file);
  bench.run("load " + file + " ; show cpu=true size=1280x720");
  bench.run("ui click view/color; ui click view/color/error");
  EXPECT_THAT(bench.failure("shot output=" + (folder / "a.png").string()), HasSubstr("give mesh=corner.obj"));
  bench.run("ui type view/mesh " + mesh);
  bench.run("shot output=" + (folder / "a.png").string());
}

TEST(Explorer, theExactDistanceOfAnotherSurfaceIsNotTheFieldsOwn) {
  Bench bench;
  const support::TemporaryDirectory folder;
  bench.run(std::string(kTorus) + "expect at(0,0,0).exact == 0.4 within 1e-9");
  bench.run("color error mesh=builtin:gear; shot output=" + (folder / "a.png").string());
  bench.run("expect at(0,0,0).exact == 0.4 within 1e-9");
}

TEST(Explorer, aCopiedViewForgetsFilesThatItDoesNotName) {
  Bench bench;
  bench.run("copy-view");
  const ViewState wanted = bench.view();
  const std::string script = bench.out.str();
  bench.run("color difference other=a.hpsdf of=slice ; color error mesh=b.obj of=surface");
  bench.run(script);
  EXPECT_TRUE(bench.view() == wanted) << scriptOf(bench.view());
}

TEST(Explorer, scriptLinesAreStepsWhileATextFieldIsEdited) {
  Bench bench;
  bench.run(std::string(kTorus) + "show size=1280x720; panel build=true; ui click build/mesh; show slice");
  const ViewState slice = bench.view();
  bench.run("color depth; undo");
  EXPECT_TRUE(bench.view() == slice) << scriptOf(bench.view());
}

TEST(Explorer, aFrameThatFailsIsEnded) {
  Ui ui;
  const auto widgets = [&](bool fails) {
    ui.frame({300, 200}, nullptr, [&] {
      ui.column("left", {0, 0, 300, 200}, 0.0, [&] {
        ui.button("a", "a");
        ui.enable(false);
        ui.button("b", "b");
        if (fails) throw Error("halfway");
        ui.enable(true);
      });
    });
  };
  const auto painted = [&] {
    render::Image image(300, 200, {250, 250, 248});
    ui.paint(image);
    return image;
  };
  for (int i = 0; i < 3; ++i) widgets(false);
  const render::Image before = painted();
  EXPECT_THROW(widgets(true), Error);
  for (int i = 0; i < 3; ++i) widgets(false);
  EXPECT_TRUE(same(painted(), before));
}

TEST(Explorer, typedTextIsCheckedByTheCommand) {
  Bench bench;
  bench.run(std::string(kTorus) + "show slice size=1280x720; color slope range=0.5,2");
  EXPECT_THAT(bench.failure("ui type view/low abc"), HasSubstr("range: expected"));
  EXPECT_THAT(bench.failure("ui type view/low 3"), HasSubstr("LOW below HIGH"));
  EXPECT_THAT(bench.failure("ui type bar/slice abc"), HasSubstr("'bar/slice' takes no text"));
  bench.run("ui type view/low 0.25");
  EXPECT_EQ((*bench.view().sliceColors.scale.limits)[0], 0.25);
}

TEST(Explorer, everyLayoutHasRoomForThePicture) {
  for (const int width : {64, 200, 400, 700, 1280})
    for (const int height : {64, 150, 240, 720}) {
      ViewState view;
      view.width = width;
      view.height = height;
      const Layout layout = layoutOf(view);
      EXPECT_GE(layout.canvas.width(), 64);
      EXPECT_GE(layout.canvas.height(), 64);
      Bench bench;
      bench.run("build analytic:sphere target-error=1e-2; show cpu=true size=" + std::to_string(width) + "x" +
                std::to_string(height));
      EXPECT_EQ(bench.explorer().frame().width, width);
    }
}

TEST(Explorer, framesAreTheSameOnAGraphicsDevice) {
  HPSDF_REQUIRE_GL();
  Bench bench;
  bench.run("build analytic:torus target-error=1e-4; show slice cpu=true size=900x600");
  const render::Image cpu = bench.explorer().frame();
  bench.run("show cpu=false gl=software");
  const render::Image gl = bench.explorer().frame();
  std::size_t differing = 0;
  for (std::size_t i = 0; i < cpu.pixels.size(); ++i) differing += cpu.pixels[i] != gl.pixels[i];
  EXPECT_LT(differing, cpu.pixels.size() / 500);
}

/// Adds a polygon as a triangle fan with its own draw command.
void addFan(ImDrawList& list, const std::vector<ImVec2>& corners, ImU32 color, const ImVec4& clip) {
  ImDrawCmd command;
  command.ClipRect = clip;
  command.VtxOffset = static_cast<unsigned>(list.VtxBuffer.Size);
  command.IdxOffset = static_cast<unsigned>(list.IdxBuffer.Size);
  for (const ImVec2& corner : corners) list.VtxBuffer.push_back({corner, {0.5F, 0.5F}, color});
  for (std::size_t i = 2; i < corners.size(); ++i)
    for (const std::size_t vertex : {std::size_t{0}, i - 1, i})
      list.IdxBuffer.push_back(static_cast<ImDrawIdx>(vertex));
  command.ElemCount = static_cast<unsigned>(3 * (corners.size() - 2));
  list.CmdBuffer.push_back(command);
}

TEST(Raster, aPixelBelongsToOneOfTheTrianglesThatShareAnEdge) {
  ImDrawList list(nullptr);
  // The colour is half transparent, so that pixels that are drawn twice become too dark.
  addFan(list, {{4, 4}, {60, 4}, {60, 60}, {4, 60}}, IM_COL32(0, 0, 0, 128), {0, 0, 64, 64});
  addFan(list, {{1, 1}, {20, 1}, {20, 20}}, IM_COL32(255, 0, 0, 255), {0, 0, 10, 64});
  ImDrawList* lists[] = {&list};
  ImDrawData data;
  data.CmdLists = lists;
  data.CmdListsCount = 1;
  const Coverage white{1, 1, {255}};
  render::Image image(64, 64, {200, 200, 200});
  paint(image, data, white);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const bool inSquare = x >= 4 && x < 60 && y >= 4 && y < 60;
      const bool inTriangle = x >= 1 && x < 10 && y >= 1 && y < x;  // below the diagonal and within the clip rectangle
      if (y == x && x < 10) continue;  // the edge passes through these pixel centres: either result is right
      const render::Color expected = inTriangle ? render::Color{255, 0, 0}
                                     : inSquare ? render::Color{100, 100, 100}
                                                : render::Color{200, 200, 200};
      ASSERT_EQ(image.at(x, y), expected) << x << ", " << y;
    }
}

}  // namespace explorer_test
}  // namespace hpsdf::app
