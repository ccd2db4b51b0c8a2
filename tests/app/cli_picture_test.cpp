// Tests `hpsdf slice` and `hpsdf render`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <sstream>

#include "cli_fixture.h"
#include "hpsdf/field_file.h"
#include "hpsdf/render/image.h"
#include "hpsdf/render/vector_picture.h"
#include "support/require_gl.h"

namespace hpsdf::app {
namespace cli_picture_test {

using namespace cli;
using cli::Call;  // a call of the program, not app::Call (a command in a script)
using Pictures = Cli;

TEST_F(Pictures, drawsOnTheCpu) {
  const Outcome slice = run({{"slice", field(), "-o", at("s.png"), "--size", "200x120", "--cpu", "--json"}});
  ASSERT_EQ(slice.status, 0) << slice.err;
  EXPECT_THAT(Json::parse(slice.out).at("renderer").get<std::string>(), HasSubstr("CPU"));
  const render::Image image = render::loadPng(at("s.png"));
  EXPECT_EQ(image.width, 200);
  EXPECT_EQ(image.height, 120);
  const Outcome surface = run({{"render", field(), "-o", at("r.png"), "--size", "160x90", "--cpu"}});
  ASSERT_EQ(surface.status, 0) << surface.err;
  EXPECT_EQ(render::loadPng(at("r.png")).width, 160);
}

TEST_F(Pictures, rawSlicesHoldTheFieldsValues) {
  ASSERT_EQ(run({{"slice", field(), "-o", at("s.csv"), "--size", "40x20", "--cpu"}}).status, 0);
  const Field torus = load(field());
  std::istringstream rows(readFile(at("s.csv")));
  std::string row;
  std::getline(rows, row);
  EXPECT_EQ(row, "x,y,z,value,degree,depth");
  std::size_t count = 0;
  std::vector<float> values;
  std::vector<Vector3> points;
  std::set<long> across, down;  // distances between neighbouring pixels along x and y
  while (std::getline(rows, row)) {
    Vector3 x;
    double value = 0;
    int degree = 0, depth = 0;
    ASSERT_EQ(std::sscanf(row.c_str(), "%lf,%lf,%lf,%lf,%d,%d", &x[0], &x[1], &x[2], &value, &degree, &depth), 6)
        << row;
    EXPECT_EQ(x.z(), 0);
    EXPECT_NEAR(value, torus.value(x), 1e-6);
    EXPECT_EQ(degree, torus.cellAt(x).degree);
    EXPECT_EQ(depth, torus.cellAt(x).depth);
    if (!points.empty() && points.back().y() == x.y()) across.insert(std::lround((x.x() - points.back().x()) * 1e9));
    if (!points.empty() && points.back().y() != x.y()) down.insert(std::lround((points.back().y() - x.y()) * 1e9));
    points.push_back(x);
    values.push_back(static_cast<float>(value));
    ++count;
  }
  EXPECT_GT(count, 100u);
  ASSERT_EQ(across.size(), 1u);
  EXPECT_EQ(across, down) << "pixels are square";

  ASSERT_EQ(run({{"slice", field(), "-o", at("s.pfm"), "--size", "40x20", "--cpu"}}).status, 0);
  const std::string pfm = readFile(at("s.pfm"));
  const std::string header = "Pf\n40 20\n-1.0\n";
  ASSERT_THAT(pfm, StartsWith(header));
  ASSERT_EQ(pfm.size(), header.size() + 40 * 20 * sizeof(float));
  std::vector<float> inside;  // values in the order of the CSV file, with the top row first
  for (int y = 20; y-- > 0;)
    for (int x = 0; x < 40; ++x) {
      float value = 0;
      std::memcpy(&value, pfm.data() + header.size() + sizeof(float) * (std::size_t(y) * 40 + std::size_t(x)),
                  sizeof value);
      if (!std::isnan(value)) inside.push_back(value);
    }
  EXPECT_EQ(inside, values);
}

TEST_F(Pictures, theExtensionChoosesVectors) {
  const std::vector<std::vector<std::string>> commands = {
      {"slice", field(), "--cpu"},
      {"slice", field(), "--cpu", "--color", "distance", "--transparent"},
      {"render", field(), "--cpu"},
      {"probe", field(), "--from", "-1,0,0", "--to", "1,0,0"}};
  std::vector<std::string> kinds = {".svg"};
  if (render::writesPdf()) kinds.emplace_back(".pdf");
  for (const auto& command : commands)
    for (const std::string& kind : kinds) {
      std::vector<std::string> files;
      for (const char* name : {"first", "second"}) {
        std::vector<std::string> words = command;
        words.insert(words.end(), {"-o", at(name + kind), "--size", "320x200", "--dpi", "192"});
        const Outcome outcome = run({words});
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        files.push_back(readFile(at(name + kind)));
      }
      EXPECT_EQ(files[0], files[1]) << command[0] << " writes other bytes each time";
      EXPECT_THAT(files[0], StartsWith(kind == ".svg" ? "<svg" : "%PDF"));
      if (kind == ".pdf") continue;
      EXPECT_THAT(files[0], HasSubstr("width=\"320\" height=\"200\" viewBox=\"0 0 640 400\""));
      EXPECT_THAT(files[0], HasSubstr("</text>"));
    }
}

TEST_F(Pictures, theResolutionEnlargesPixels) {
  const Outcome outcome =
      run({{"slice", field(), "--cpu", "-o", at("s.png"), "--size", "320x200", "--dpi", "240", "--json"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(Json::parse(outcome.out).at("width"), 800);
  EXPECT_EQ(render::loadPng(at("s.png")).height, 500);
  expectRefused({{"slice", field(), "-o", at("s.csv"), "--dpi", "192"}}, "only pictures have dpi");
  expectRefused({{"probe", field(), "--from", "0,0,0", "--to", "1,0,0", "-o", at("l.csv"), "--transparent"}},
                "only a plot has transparent");
  expectRefused({{"slice", field(), "-o", at("s.png"), "--size", "1600x900", "--dpi", "2400"}}, "out of range");
  expectRefused({{"render", field(), "-o", at("s.gif")}}, "pictures are written as .png, .svg or .pdf");
}

TEST_F(Pictures, quantitiesColourSlicesAndSurfaces) {
  for (const char* color : {"value-jump", "gradient-jump", "slope", "error", "cell-error"}) {
    EXPECT_EQ(run({{"slice", field(), "-o", at("s.png"), "--color", color, "--cpu", "--size", "200x150"}}).status, 0);
    EXPECT_EQ(run({{"render", field(), "-o", at("r.png"), "--color", color, "--cpu", "--size", "200x150"}}).status, 0);
    EXPECT_GT(render::loadPng(at("s.png")).width, 0);
  }
  // The raw values of a slice are the errors themselves.
  ASSERT_EQ(run({{"slice", field(), "-o", at("e.pfm"), "--color", "error", "--cpu", "--size", "16x16"}}).status, 0);
  const std::string pfm = readFile(at("e.pfm"));
  std::array<float, 256> values{};
  ASSERT_GE(pfm.size(), sizeof values);
  std::memcpy(values.data(), pfm.data() + pfm.size() - sizeof values, sizeof values);
  float greatest = 0;
  for (const float value : values) greatest = std::max(greatest, value);
  EXPECT_GT(greatest, 1e-6F);
  EXPECT_LT(greatest, 0.1F);

  expectRefused({{"slice", field(), "-o", at("x.png"), "--map", "heat"}}, "map: color degree has no map",
                namesIn(folder_.path()));
  expectRefused({{"slice", field(), "-o", at("x.png"), "--color", "distance", "--map", "heat"}},
                "map: heat does not suit color distance; choose one of blue-red, purple-green, brown-teal",
                namesIn(folder_.path()));
  expectRefused({{"slice", field(), "-o", at("x.png"), "--range", "1,2"}}, "range", namesIn(folder_.path()));
  expectRefused({{"slice", field(), "-o", at("x.png"), "--color", "slope", "--range", "2,1", "--cpu"}}, "range",
                namesIn(folder_.path()));
  expectRefused({{"render", field(), "-o", at("x.png"), "--color", "distance"}}, "normal", namesIn(folder_.path()));
  expectRefused({{"slice", field(), "-o", at("x.png"), "--mesh", "builtin:box"}}, "mesh", namesIn(folder_.path()));
  const Outcome other =
      run({{"slice", field(), "-o", at("x.png"), "--color", "error", "--mesh", "builtin:box", "--cpu"}});
  EXPECT_EQ(other.status, 0);
  EXPECT_THAT(other.err, HasSubstr("not what the field was made from"));
}

TEST_F(Pictures, twoFieldsAreCompared) {
  for (const auto& [name, radius] : {std::pair("small", "0.5"), std::pair("large", "0.6")})
    ASSERT_EQ(run({{"build", std::string("analytic:sphere,radius=") + radius, "-o", at(name), "--domain",
                    "-1,-1,-1,1,1,1", "--target-error", "1e-6"}})
                  .status,
              0);
  const auto differences = [&](const std::string& other) {
    EXPECT_EQ(run({{"slice", at("small"), "-o", at("d.pfm"), "--color", "difference", "--other", at(other), "--cpu",
                    "--size", "16x16"}})
                  .status,
              0);
    std::vector<float> values(256);
    const std::string pfm = readFile(at("d.pfm"));
    std::memcpy(values.data(), pfm.data() + pfm.size() - sizeof(float) * 256, sizeof(float) * 256);
    return values;
  };
  EXPECT_THAT(differences("small"), testing::Each(0.0F));
  // The median excludes the points near the centre, where no polynomial approximates the kink of the distance.
  std::vector<float> sorted = differences("large");
  std::ranges::sort(sorted);
  EXPECT_NEAR(sorted[128], 0.1, 1e-3);
  EXPECT_EQ(run({{"render", at("small"), "-o", at("r.png"), "--color", "difference", "--other", at("large"), "--cpu",
                  "--size", "100x80"}})
                .status,
            0);
  expectRefused({{"slice", at("small"), "-o", at("x.png"), "--color", "difference"}}, "needs other");
  expectRefused({{"slice", at("small"), "-o", at("x.png"), "--other", at("large")}}, "is for color difference");
  expectRefused({{"slice", at("small"), "-o", at("x.png"), "--color", "difference", "--other", at("none")}},
                "none: no such file");
}

TEST_F(Pictures, planesGoThroughTheMiddleOfTheSurfaceUnlessToldOtherwise) {
  writeFile(at("floor.obj"), kTetrahedron);  // from 0 to 1 along each axis, within a domain that reaches further down
  ASSERT_EQ(run({{"build", at("floor.obj"), "-o", at("f.hpsdf"), "--target-error", "1e-3", "--domain",
                  "-3,-3,-3,1.5,1.5,1.5"}})
                .status,
            0);
  for (const std::string axis : {"x", "y", "z"}) {
    const auto slice = [&](const std::vector<std::string>& words) {
      std::vector<std::string> all = {"slice", at("f.hpsdf"), "-o",     at("s.csv"), "--axis",
                                      axis,    "--cpu",       "--size", "40x20"};
      all.insert(all.end(), words.begin(), words.end());
      EXPECT_EQ(run({all}).status, 0);
      return readFile(at("s.csv"));
    };
    EXPECT_EQ(slice({}), slice({"--offset", "0.5"}));
    EXPECT_NE(slice({}), slice({"--offset", "0"}));
    const auto surface = [&](const std::vector<std::string>& words) {
      std::vector<std::string> all = {"render", at("f.hpsdf"), "-o", at("v.png"), "--cpu", "--size", "120x90"};
      all.insert(all.end(), words.begin(), words.end());
      EXPECT_EQ(run({all}).status, 0);
      return readFile(at("v.png"));
    };
    for (const std::string what : {"plane", "clip"}) {
      const std::string offset = "--" + what + "-offset";
      EXPECT_EQ(surface({"--" + what, axis}), surface({"--" + what, axis, offset, "0.5"}));
      EXPECT_NE(surface({"--" + what, axis}), surface({"--" + what, axis, offset, "0.25"}));
    }
  }
  const Outcome script =
      run({{"run", "-e", "load " + at("f.hpsdf") + " ; show slice size=400x300 cpu=true", "-e",
            "panel all=false ; shot output=" + at("a.png"), "-e", "plane offset=0.5 ; shot output=" + at("b.png"), "-e",
            "plane offset=0 ; shot output=" + at("c.png"), "-e",
            "show surface ; surface clip=y ; shot output=" + at("d.png"), "-e",
            "surface clip-offset=0.5 ; shot output=" + at("e.png")}});
  ASSERT_EQ(script.status, 0) << script.err;
  EXPECT_EQ(readFile(at("a.png")), readFile(at("b.png")));
  EXPECT_NE(readFile(at("a.png")), readFile(at("c.png")));
  EXPECT_EQ(readFile(at("d.png")), readFile(at("e.png")));
}

TEST_F(Pictures, viewsAreNamedOrAimed) {
  const auto surface = [&](const std::vector<std::string>& words) {
    std::vector<std::string> all = {"render", field(), "-o", at("v.png"), "--cpu", "--size", "120x90"};
    all.insert(all.end(), words.begin(), words.end());
    const Outcome outcome = run({all});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return readFile(at("v.png"));
  };
  EXPECT_EQ(surface({"--view", "left"}), surface({"--camera=-90,0,1.1"}));
  EXPECT_EQ(surface({"--view", "top", "--up", "z"}), surface({"--camera", "0,90,1.1", "--up", "z"}));
  EXPECT_NE(surface({"--view", "left"}), surface({"--view", "top"}));
  EXPECT_NE(surface({"--target", "0.5,0,0"}), surface({}));
  EXPECT_NE(surface({"--projection", "orthographic"}), surface({}));
  EXPECT_EQ(surface({"--projection", "perspective"}), surface({}));
  EXPECT_NE(surface({"--cracks"}), surface({}));
  EXPECT_NE(surface({"--clip", "z"}), surface({}));
  EXPECT_NE(surface({"--clip", "z", "--clip-offset", "0.1"}), surface({"--clip", "z"}));
  EXPECT_EQ(surface({"--clip", "z", "--clip-offset", "50"}), surface({"--clip", "z", "--clip-offset", "40"}));
  expectRefused({{"render", field(), "-o", at("x.png"), "--clip-offset", "0.1"}}, "clip", {"v.png"});
  EXPECT_NE(surface({"--plane", "x"}), surface({}));
  EXPECT_EQ(surface({"--plane", "x"}), surface({"--plane", "x", "--plane-offset", "0"}));
  EXPECT_NE(surface({"--plane", "x"}), surface({"--plane", "x", "--plane-offset", "0.1"}));
  EXPECT_NE(surface({"--plane", "0,0,0,1,2,3"}), surface({"--plane", "x"}));
  EXPECT_NE(surface({"--surface=false", "--plane", "x"}), surface({"--plane", "x"}));
  EXPECT_NE(surface({"--cells", "lines"}), surface({}));
  EXPECT_NE(surface({"--cells", "boxes"}), surface({"--cells", "lines"}));
  EXPECT_NE(surface({"--cells", "boxes", "--degrees", "4"}), surface({"--cells", "boxes"}));
  EXPECT_NE(surface({"--cells", "boxes", "--depths", "20"}), surface({"--cells", "boxes"}));
  EXPECT_EQ(surface({"--cells", "boxes", "--degrees", "2,4-6"}), surface({"--cells", "boxes", "--degrees", "6,2,4-5"}));
  EXPECT_NE(surface({"--arrows", "20"}), surface({}));
  for (const char* list : {"x", "4,", "4-2", "31", "-1", "1.5"})
    expectRefused({{"render", field(), "-o", at("x.png"), "--cells", "boxes", std::string("--degrees=") + list}},
                  "degrees: expected whole numbers and ranges from 0 to 30", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--cells", "boxes", "--depths", "21"}}, "0 to 20", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--degrees", "4"}}, "degrees: needs cells", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--plane-offset", "0.1"}}, "needs plane", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--plane", "0,0,0,1,0,0", "--plane-offset", "0.1"}},
                "plane-offset", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--plane", "w"}}, "x, y, z or 6 numbers", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--plane", "z", "--plane-offset", "9"}}, "outside", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--view", "left", "--camera", "0,0,1"}}, "camera", {"v.png"});
  expectRefused({{"render", field(), "-o", at("x.png"), "--view", "lefd"}}, "left", {"v.png"});
}

TEST_F(Pictures, errorsNeedTheMeshUnlessItWasBuiltInTheScript) {
  writeFile(at("mesh.obj"), kTetrahedron);
  const std::string build = "build " + at("mesh.obj") + " output=" + at("m.hpsdf") + " target-error=1e-4";
  const std::string slice = "slice output=" + at("s.png") + " color=error size=100x80 cpu=true";
  const Outcome together = run({{"run", "-e", build, "-e", slice}});
  EXPECT_EQ(together.status, 0) << together.err;
  const Outcome alone = run({{"slice", at("m.hpsdf"), "-o", at("a.png"), "--color", "error", "--cpu"}});
  EXPECT_EQ(alone.status, 2);
  EXPECT_THAT(alone.err, HasSubstr("mesh=mesh.obj"));
  EXPECT_EQ(run({{"slice", at("m.hpsdf"), "-o", at("a.png"), "--color", "error", "--cpu", "--size", "100x80", "--mesh",
                  at("mesh.obj")}})
                .status,
            0);
  EXPECT_EQ(readFile(at("a.png")), readFile(at("s.png")));
}

TEST_F(Pictures, notesViewsThatShowLittle) {
  const auto render = [&](const std::string& offset) {
    const Outcome outcome =
        run({{"render", field(), "-o", at("r.png"), "--size", "160x90", "--cpu", "--offset", offset}});
    EXPECT_EQ(outcome.status, 0);
    return outcome.err;
  };
  EXPECT_THAT(render("0"), IsEmpty());
  EXPECT_THAT(render("5"), HasSubstr("no surface in view"));
  EXPECT_THAT(render("0.9"), HasSubstr("domain"));
}

TEST_F(Pictures, drawsWithOpenGl) {
  HPSDF_REQUIRE_GL();
  const Outcome slice = run({{"slice", field(), "-o", at("s.png"), "--size", "200x120", "--gl", "software"}});
  EXPECT_EQ(slice.status, 0) << slice.err;
  const Outcome surface = run({{"render", field(), "-o", at("r.png"), "--size", "200x120", "--gl", "software"}});
  EXPECT_EQ(surface.status, 0) << surface.err;
  EXPECT_THAT(namesIn(folder_.path()), ElementsAre("r.png", "s.png"));
}

TEST_F(Pictures, withoutEglPicturesAreRefusedAndTheCpuStillDraws) {
  const std::map<std::string, std::string> noEgl = {{"__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent"}};
  expectRefused({.words = {"slice", field(), "-o", at("s.png")}, .environment = noEgl}, "render with --cpu");
  expectRefused({.words = {"render", field(), "-o", at("r.png")}, .environment = noEgl}, "render with --cpu");
  expectRefused({.words = {"report", field(), "-o", at("report")}, .environment = noEgl}, "render with --cpu");
  expectRefused(
      {.words = {"frames", "analytic:torus", "-o", at("frames"), "--target-error", "1e-2"}, .environment = noEgl},
      "libgl1-mesa-dri, or render with --of 'slice cpu'");
  const Outcome shot =
      run({.words = {"run", "-e", "load \"" + field() + "\"; shot output=" + at("shot.png")}, .environment = noEgl});
  EXPECT_EQ(shot.status, 2);
  EXPECT_EQ(lineCount(shot.err), 1u) << shot.err;
  EXPECT_THAT(shot.err, EndsWith("libgl1-mesa-dri, or render with 'show cpu=true'\n"));
  const Outcome doctor = run({.words = {"doctor", "--json"}, .environment = noEgl});
  EXPECT_EQ(doctor.status, 0) << doctor.err;
  EXPECT_TRUE(Json::parse(doctor.out).at("renderer").is_null());
  EXPECT_THAT(Json::parse(doctor.out).at("renderer_problem").get<std::string>(), EndsWith("or render with --cpu"));
  EXPECT_EQ(
      run({.words = {"slice", field(), "-o", at("s.png"), "--cpu", "--size", "64x64"}, .environment = noEgl}).status,
      0);
}

/// Mesa itself would write several warnings before the program's message.
TEST_F(Pictures, aBrokenMesaIsToldInOneLine) {
  const Call call{.words = {"slice", field(), "-o", at("s.png"), "--gl", "software", "--size", "64x64"},
                  .environment = {{"LIBGL_DRIVERS_PATH", "/nonexistent"}}};
  if (run(call).status == 0) GTEST_SKIP() << "this Mesa finds its drivers all the same";
  expectRefused(call, "no OpenGL 4.5 through EGL on a software device");
}

TEST_F(Pictures, slicesOfFieldsAwayFromTheOriginCutTheirMiddle) {
  ASSERT_EQ(run({{"build", "analytic:sphere", "-o", at("far.hpsdf"), "--domain", "10,10,10,11,12,13", "--target-error",
                  "1e-2"}})
                .status,
            0);
  const Outcome outcome = run({{"slice", at("far.hpsdf"), "-o", at("s.csv"), "--cpu", "--size", "16x16"}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(readFile(at("s.csv")), HasSubstr(",11.5,"));
}

}  // namespace cli_picture_test
}  // namespace hpsdf::app
