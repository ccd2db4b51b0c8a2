// Tests `hpsdf compare` and `hpsdf study tradeoff`.
#include "hpsdf/render/compare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "files/svg_chart.h"
#include "files/text_file.h"
#include "hpsdf/build.h"
#include "hpsdf/detail/triangle_search.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/render/picture.h"
#include "hpsdf/shapes.h"
#include "hpsdf/verify.h"
#include "outcome.h"
#include "support/temporary_directory.h"
#include "text/json.h"

namespace hpsdf::app {
namespace compare_test {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr int kPageViews = 4;

std::size_t countOf(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

std::string bytesOfBase64(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | std::uint32_t(kDigits.find(c));
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 255);
  }
  return bytes;
}

/// The fields of a torus that all tests compare: a coarse one, a fine one, and one of a smaller domain.
class Compare : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new support::TemporaryDirectory;
    build("builtin:torus", "coarse", {"--target-error", "1e-3"});
    build("builtin:torus", "fine", {"--target-error", "1e-6"});
    build("builtin:torus", "box", {"--target-error", "1e-4", "--domain", "box", "--margin", "0.05"});
  }
  static void TearDownTestSuite() {
    delete shared_;
    shared_ = nullptr;
  }

  static void build(const std::string& surface, const std::string& name, std::vector<std::string> options) {
    options.insert(options.begin(), {"build", surface, "-o", field(name)});
    const Outcome built = runHere(options);
    ASSERT_EQ(built.status, 0) << built.err;
  }
  static std::string field(const std::string& name) { return (*shared_ / (name + ".hpsdf")).string(); }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }

  static Json compared(std::vector<std::string> words) {
    words.insert(words.begin(), "compare");
    words.insert(words.end(), {"--json", "--points", "20000"});
    const Outcome outcome = runHere(words);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.status == 0 ? Json::parse(outcome.out) : Json();
  }

  /// Writes a page with small pictures, which the CPU draws, and returns its text.
  std::string page(std::vector<std::string> words, const std::string& name = "page.html") const {
    words.insert(words.begin(), "compare");
    words.insert(words.end(),
                 {"-o", at(name), "--points", "20000", "--no-times", "--cpu", "--size", "96x80", "--samples", "1"});
    const Outcome outcome = runHere(words);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return readTextFile(at(name));
  }

  /// Returns the pictures of a page, in the order of the page.
  std::vector<render::Image> pictures(const std::string& html) const {
    const std::string before = "src=\"data:image/png;base64,";
    std::vector<render::Image> found;
    for (std::size_t n = html.find(before); n != std::string::npos; n = html.find(before, n + 1)) {
      const std::size_t from = n + before.size();
      writeTextFile(at("one.png"), bytesOfBase64(std::string_view(html).substr(from, html.find('"', from) - from)));
      found.push_back(render::loadPng(at("one.png")));
    }
    return found;
  }

  void expectRefused(std::vector<std::string> words, const std::string& message) const {
    const Outcome outcome = runHere(words);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, HasSubstr(message));
    EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_TRUE(fs::is_empty(folder_.path())) << "something was written";
  }

  support::TemporaryDirectory folder_;

 private:
  static inline support::TemporaryDirectory* shared_ = nullptr;
};

TEST_F(Compare, figuresAreThoseOfVerifyAtTheSamePoints) {
  const Json json = compared({field("coarse"), field("fine"), "--no-times"});
  ASSERT_EQ(json["fields"].size(), 2u);
  const TriangleMesh mesh = loadMesh("builtin:torus");
  const ExactDistance exact(mesh);
  const DistanceFunction distance(exact);
  TriangleMesh sorted;  // the triangles in the order in which `measure` gets them
  const auto vertices = distance.triangleSearch()->vertices();
  const auto triangles = distance.triangleSearch()->triangles();
  sorted.vertices.assign(vertices.begin(), vertices.end());
  sorted.triangles.assign(triangles.begin(), triangles.end());
  for (const Json& figures : json["fields"]) {
    const Outcome verified = runHere({"verify", figures["field"], "--json", "--points", "20000"});
    const Json expected = Json::parse(verified.out);
    EXPECT_EQ(json["near"], expected["near"]);
    EXPECT_EQ(figures["near"]["rms"], expected["near_surface"]["error"]["rms"]);
    EXPECT_EQ(figures["near"]["max"], expected["near_surface"]["error"]["max"]);
    EXPECT_EQ(figures["domain"]["rms"], expected["uniform"]["error"]["rms"]);
    EXPECT_EQ(figures["domain"]["max"], expected["uniform"]["error"]["max"]);
    EXPECT_EQ(figures["wrong_signs"], expected["uniform"]["signs"]["mismatches"].get<std::size_t>() +
                                          expected["near_surface"]["signs"]["mismatches"].get<std::size_t>());
    const Field loaded = load(figures["field"].get<std::string>());
    EXPECT_EQ(figures["torn_share"], tornShare(loaded, mesh, {.count = 10000}));
    EXPECT_EQ(tornShare(loaded, sorted, {.count = 5000}), measure(loaded, exact, {.points = 20000}).tornShare);
    EXPECT_EQ(figures["bytes"], loaded.bytes());
    EXPECT_EQ(figures["file_bytes"], fs::file_size(figures["field"].get<std::string>()));
    EXPECT_TRUE(figures["query"].is_null());
  }
  // The figures are the right way round: the fine field is larger and more exact.
  const Json &coarse = json["fields"][0], &fine = json["fields"][1];
  EXPECT_EQ(coarse["field"], field("coarse"));
  EXPECT_GT(fine["bytes"], coarse["bytes"]);
  for (const char* where : {"near", "domain"}) EXPECT_LT(fine[where]["rms"], coarse[where]["rms"]);
  EXPECT_LT(fine["wrong_signs"], coarse["wrong_signs"]);
  EXPECT_LT(fine["torn_share"], coarse["torn_share"]);
  const Json swapped = compared({field("fine"), field("coarse"), "--no-times"});
  EXPECT_EQ(swapped["fields"][0]["near"], fine["near"]);
  EXPECT_EQ(swapped["fields"][1]["near"], coarse["near"]);
  EXPECT_EQ(swapped["fields"][0]["letter"], "A");
}

TEST_F(Compare, errorsByDistanceAddUp) {
  const Json json = compared({field("coarse"), field("fine"), "--no-times"});
  for (const Json& figures : json["fields"]) {
    double squares = 0, leftOut = 20000, greatest = 0;
    double end = 0;
    for (const Json& bin : figures["error_by_distance"]) {
      EXPECT_GE(bin["from"].get<double>(), end * (1 - 1e-12));
      end = bin["to"];
      EXPECT_LE(bin["rms"], bin["max"]);
      squares += numberIn(bin, "points") * std::pow(numberIn(bin, "rms"), 2);
      greatest = std::max(greatest, numberIn(bin, "max"));
      leftOut -= numberIn(bin, "points");
    }
    const double all =
        10000 * (std::pow(numberIn(figures["near"], "rms"), 2) + std::pow(numberIn(figures["domain"], "rms"), 2));
    const double most = std::max(numberIn(figures["near"], "max"), numberIn(figures["domain"], "max"));
    EXPECT_GE(leftOut, 0);
    EXPECT_LT(leftOut, 1000);
    EXPECT_LE(squares, all * (1 + 1e-9));
    EXPECT_GE(squares, all - leftOut * most * most);
    EXPECT_LE(greatest, most);
  }
}

TEST_F(Compare, worstPlacesTellTheErrorsOfAllFields) {
  const Json json = compared({field("coarse"), field("fine"), "--no-times", "--worst", "3"});
  ASSERT_EQ(json["worst"].size(), 6u);
  const Field fields[] = {load(field("coarse")), load(field("fine"))};
  for (std::size_t n = 0; n < 6; ++n) {
    const Json& place = json["worst"][n];
    const std::size_t own = n / 3;
    EXPECT_EQ(place["field"], own == 0 ? "A" : "B");
    const Vector3 x(place["position"][0], place["position"][1], place["position"][2]);
    for (std::size_t k = 0; k < 2; ++k)
      EXPECT_EQ(place["errors"][k].get<double>(), fields[k].value(x) - numberIn(place, "exact"));
    if (n % 3 == 0) {
      const Json& figures = json["fields"][own];
      EXPECT_EQ(std::abs(place["errors"][own].get<double>()),
                std::max(numberIn(figures["near"], "max"), numberIn(figures["domain"], "max")));
    } else {
      EXPECT_LE(std::abs(place["errors"][own].get<double>()),
                std::abs(json["worst"][n - 1]["errors"][own].get<double>()));
      EXPECT_NE(fields[own].cellAt(x).id,
                fields[own]
                    .cellAt(Vector3(json["worst"][n - 1]["position"][0], json["worst"][n - 1]["position"][1],
                                    json["worst"][n - 1]["position"][2]))
                    .id);
    }
  }
}

TEST_F(Compare, timesAreRatiosToTheFirstField) {
  const Json json = compared({field("coarse"), field("fine")});
  for (const char* kind : {"single", "batched"}) {
    const double first = numberIn(json["fields"][0]["query"][kind], "nanoseconds");
    const Json& second = json["fields"][1]["query"][kind];
    EXPECT_GT(first, 0);
    EXPECT_EQ(json["fields"][0]["query"][kind]["over_first"], 1.0);
    EXPECT_DOUBLE_EQ(numberIn(second, "over_first"), numberIn(second, "nanoseconds") / first);
  }
  const Outcome text = runHere({"compare", field("coarse"), field("fine"), "--points", "2000"});
  EXPECT_THAT(text.out, AllOf(HasSubstr("time of a single query"), HasSubstr("over A"), HasSubstr("worst places")));
  const Outcome untimed = runHere({"compare", field("coarse"), field("fine"), "--points", "2000", "--no-times"});
  EXPECT_THAT(untimed.out, AllOf(Not(HasSubstr("time of")), HasSubstr("torn share of the surface")));
}

TEST_F(Compare, pointsLieWhereAllFieldsAreDefined) {
  const Json json = compared({field("fine"), field("box"), "--no-times"});
  const Box domain = load(field("box")).domain();
  EXPECT_EQ(json["domain"], boxJson(domain));
  for (const Json& place : json["worst"])
    EXPECT_TRUE(domain.contains(Vector3(place["position"][0], place["position"][1], place["position"][2])));
  // Both pictures show the smaller domain: the same plane and the same camera, up to what the fields differ.
  const std::vector<render::Image> found = pictures(page({field("fine"), field("box")}));
  ASSERT_EQ(found.size(), 2u * kPageViews);
  const auto backdrop = [](const render::Image& image) {
    return double(std::ranges::count(image.pixels, image.pixels.front())) / double(image.pixels.size());
  };
  for (int view = 0; view < 2; ++view)
    EXPECT_NEAR(backdrop(found[2 * view]), backdrop(found[2 * view + 1]), 0.2) << "one frames a larger part";
  const render::Comparison surface = render::compare(found[4], found[5]);
  EXPECT_LT(double(surface.differing), 0.3 * double(surface.compared));
}

TEST_F(Compare, pageHoldsAllPicturesAndNothingExternal) {
  const std::string html = page({field("coarse"), field("fine"), field("fine")});
  EXPECT_EQ(html, page({field("coarse"), field("fine"), field("fine")}, "again.html")) << "a page without times";
  const std::vector<render::Image> found = pictures(html);
  ASSERT_EQ(found.size(), 3u * kPageViews);
  for (const render::Image& image : found) {
    EXPECT_EQ(image.width, 96);
    EXPECT_EQ(image.height, 80);
  }
  EXPECT_EQ(countOf(html, "<img src="), found.size()) << "every picture is embedded";
  EXPECT_EQ(countOf(html, "http"), countOf(html, "xmlns=\"http://www.w3.org/2000/svg\""));
  for (const char* external : {"<link", "<iframe", "@import", "url(", "fetch(", "script src"})
    EXPECT_THAT(html, Not(HasSubstr(external)));
  EXPECT_EQ(countOf(html, "<div class=\"slider\">"), std::size_t(kPageViews));
  EXPECT_EQ(countOf(html, "<select>"), 2u * kPageViews) << "three fields: the reader chooses two";
  EXPECT_EQ(countOf(html, "class=\"chart\""), 1u);
  EXPECT_THAT(html, AllOf(HasSubstr("Worst places"), HasSubstr("[mesh units]"), HasSubstr("torn share")));
  EXPECT_THAT(page({field("coarse"), field("fine")}), Not(HasSubstr("<select>"))) << "there is nothing to choose";
}

TEST_F(Compare, coloursMeanTheSameInAllPictures) {
  const std::vector<render::Image> found = pictures(page({field("coarse"), field("fine")}));
  ASSERT_EQ(found.size(), 2u * kPageViews);
  const Field fields[] = {load(field("coarse")), load(field("fine"))};
  const auto drawn = [](const Field& loaded) {
    const auto renderer = render::makeCpuRenderer(loaded);
    return render::drawSlice(*renderer, loaded, {.width = 96, .height = 80, .bare = true}).image;
  };
  for (std::size_t n = 0; n < 2; ++n)
    EXPECT_EQ(render::problem(render::compare(drawn(fields[n]), found[n]), render::kPixelBudget), "");
  EXPECT_NE(render::problem(render::compare(drawn(fields[1]), found[0]), render::kPixelBudget), "");
  // A field beside itself has equal pictures. Beside the coarse one, the colours of its errors stand for other values.
  const std::vector<render::Image> alike = pictures(page({field("fine"), field("fine")}, "alike.html"));
  for (std::size_t n = 0; n < alike.size(); n += 2) EXPECT_EQ(alike[n].pixels, alike[n + 1].pixels);
  EXPECT_NE(render::problem(render::compare(alike[2], found[3]), render::kPixelBudget), "");
}

/// A listener that cancels the work after some questions whether it wants to, counted from the first report of the task
/// "comparing".
class CancelsAfter : public WorkListener {
 public:
  explicit CancelsAfter(int questions) : left_(questions) {}
  void report(std::string_view task, double) override { reports_ += task == "comparing" ? 1 : 0; }
  bool wantsCancel() override { return reports_ > 0 && --left_ < 0; }
  void ended() override {}
  int reports() const { return reports_; }

 private:
  std::atomic<int> reports_ = 0;
  std::atomic<int> left_;
};

/// The evaluation of a field at these points asks four times, its errors and their worst places eight times more.
TEST_F(Compare, canBeCancelledWhileErrorsAreMeasured) {
  for (const int questions : {5, 8, 11}) {
    CancelsAfter listener(questions);
    std::istringstream in;
    std::ostringstream out, err;
    const std::vector<std::string> words = {"compare",  field("coarse"), field("coarse"),
                                            "--points", "200000",        "--no-times"};
    EXPECT_EQ(runProgram(words, Console{in, out, err, false, &listener}), 130) << questions;
    EXPECT_EQ(listener.reports(), 1) << "the second field was begun";
  }
}

TEST_F(Compare, scriptsCompareToo) {
  const Outcome outcome =
      runHere({"run", "-e",
               "compare " + field("coarse") + " " + field("fine") + " mesh=builtin:torus points=2000 no-times=true"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("near the surface, RMS error"));
}

TEST_F(Compare, foreignFieldsAreRefused) {
  build("builtin:gear", "gear", {"--target-error", "1e-3"});
  build("builtin:gear", "far", {"--target-error", "1e-2", "--domain", "8,8,8,9,9,9"});
  build("builtin:torus", "far-torus", {"--target-error", "1e-2", "--domain", "8,8,8,9,9,9"});
  build("builtin:torus", "normalized", {"--target-error", "1e-3", "--normalize"});
  build("builtin:torus", "shell", {"--target-error", "1e-3", "--sign", "unsigned-shell", "--thickness", "0.1"});
  const std::string torus = field("fine");
  expectRefused({"compare", torus}, "needs two fields or more");
  expectRefused({"compare", torus, field("gear"), "-o", at("x.html")}, "from another mesh, builtin:gear");
  expectRefused({"compare", torus, field("gear"), "--mesh", "builtin:torus"}, "from another mesh");
  expectRefused({"compare", torus, field("far")}, "from another mesh");
  expectRefused({"compare", torus, field("far-torus")}, "its domain does not overlap");
  expectRefused({"compare", torus, field("coarse"), "--mesh", "builtin:gear"}, "not from builtin:gear");
  expectRefused({"compare", torus, field("normalized")}, "different units");
  expectRefused({"compare", torus, field("shell")}, "different surfaces");
  expectRefused({"compare", torus, torus, "--any-mesh"}, "any-mesh: needs mesh");
  expectRefused({"compare", torus, torus, "-o", at("x.png")}, ".html");
  expectRefused({"compare", torus, torus, "-o", at("x.html"), "--offset", "9", "--points", "1e8"}, "9");
  std::vector<std::string> nine(9, torus);
  nine.insert(nine.begin(), "compare");
  expectRefused(nine, "8 fields at most");
  const Json any =
      compared({torus, field("coarse"), "--mesh", "builtin:torus,segments=64", "--any-mesh", "--no-times"});
  EXPECT_EQ(any["mesh"], "builtin:torus,segments=64");
}

TEST_F(Compare, differentInsideTestsAreTold) {
  build("builtin:torus", "winding", {"--target-error", "1e-2", "--sign", "winding"});
  const Outcome outcome =
      runHere({"compare", field("coarse"), field("winding"), field("fine"), "--points", "2000", "--no-times"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(countOf(outcome.err, "hpsdf: note:"), 1u) << outcome.err;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr(field("winding")), HasSubstr("signs are compared with those of")));
}

TEST_F(Compare, theMeshIsFoundBesideAField) {
  TriangleMesh mesh = loadMesh("builtin:torus");
  saveMesh(mesh, at("ring.obj"));
  for (const char* name : {"a", "b"})
    ASSERT_EQ(
        runHere({"build", at("ring.obj"), "-o", at(std::string(name) + ".hpsdf"), "--target-error", "1e-2"}).status, 0);
  EXPECT_EQ(compared({at("a.hpsdf"), at("b.hpsdf"), "--no-times"})["mesh"], at("ring.obj"));
  fs::remove(at("ring.obj"));
  const Outcome outcome = runHere({"compare", at("a.hpsdf"), at("b.hpsdf")});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.err, HasSubstr("give --mesh, ring.obj"));
}

TEST(SvgChart, holdsAllPointsOnLogarithmicAxes) {
  const Chart chart{.xLabel = "x <m>",
                    .yLabel = "y",
                    .solid = "RMS",
                    .dashed = "greatest",
                    .curves = {{"a", "#112233", false, {{1e-3, 1}, {1e-1, 10}, {1e1, 100}}},
                               {"a", "#112233", true, {{1e-3, 0}, {1e1, 1e4}}}}};
  const std::string svg = chartSvg(chart);
  EXPECT_EQ(countOf(svg, "<title>"), 4u) << "0 has no place on a logarithmic axis";
  EXPECT_EQ(countOf(svg, "font-size=\"12\" fill=\"currentColor\">a<"), 1u) << "one entry for each name";
  EXPECT_THAT(svg, AllOf(HasSubstr("x &lt;m&gt;"), HasSubstr(">greatest<"), HasSubstr("10⁻³"), HasSubstr("#112233")));
  // The middle point lies in the middle: 0.1 between 0.001 and 10.
  std::vector<double> x;
  for (std::size_t n = svg.find("><title>"); n != std::string::npos; n = svg.find("><title>", n + 1))
    x.push_back(std::stod(svg.substr(svg.rfind("d=\"m", n) + 4)));
  EXPECT_NEAR(x[1], (x[0] + x[2]) / 2, 0.02);
  EXPECT_EQ(x[3], x[2]);
  EXPECT_THAT(chartSvg({}), HasSubstr("</svg>"));
}

class Tradeoff : public Compare {
 protected:
  Json studied(std::vector<std::string> options) const {
    options.insert(options.begin(), {"study", "tradeoff", "builtin:torus", "-o", at("out"), "--target-errors",
                                     "1e-5,1e-3,1e-4", "--points", "20000", "--json"});
    const Outcome outcome = runHere(options);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.status == 0 ? Json::parse(outcome.out)["meshes"][0] : Json();
  }
};

TEST_F(Tradeoff, theRangeIsMeasured) {
  const Json torus = studied({});
  ASSERT_EQ(torus["points"].size(), 3u);
  EXPECT_TRUE(torus["recommended"].is_null()) << "no limit is given";
  const TriangleMesh mesh = loadMesh("builtin:torus");
  const ExactDistance exact(mesh);
  double before = 1;
  for (const Json& point : torus["points"]) {
    const double target = point["target_error"];
    EXPECT_LT(target, before) << "the greatest target error comes first";
    before = target;
    const Field same = hpsdf::build(exact, domainAround(mesh), {.targetError = target});
    EXPECT_EQ(point["bytes"], same.bytes());
    const Measurement measured = measure(same, exact, {.points = 20000});
    EXPECT_EQ(point["near_rms"], measured.near.rms);
    EXPECT_EQ(point["domain_max"], measured.domain.max);
    EXPECT_GT(point["seconds"], 0);
  }
  EXPECT_LT(torus["points"][2]["near_rms"], torus["points"][0]["near_rms"]);
  const std::string csv = readTextFile(at("out/tradeoff.csv"));
  EXPECT_EQ(std::ranges::count(csv, '\n'), 4);
  EXPECT_THAT(csv, HasSubstr("\ntorus,0.001,"));
  const std::string html = readTextFile(at("out/index.html"));
  EXPECT_EQ(countOf(html, "class=\"chart\""), 2u);
  EXPECT_EQ(countOf(html, "http"), countOf(html, "xmlns=\"http://www.w3.org/2000/svg\""));
  EXPECT_THAT(html, Not(HasSubstr("class=\"chosen\"")));
}

TEST_F(Tradeoff, tolerancesAreMeasured) {
  const auto study = [&](const std::vector<std::string>& options) {
    std::vector<std::string> words = {"study",   "tradeoff", "builtin:torus,segments=24,sides=12",
                                      "-o",      at("out"),  "--tolerances",
                                      "4%,0.04", "--points", "20000",
                                      "--json"};
    words.insert(words.end(), options.begin(), options.end());
    const Outcome outcome = runHere(words);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.status == 0 ? Json::parse(outcome.out)["meshes"][0] : Json();
  };
  const Json points = study({})["points"];
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0]["tolerance"], "4%");
  EXPECT_EQ(points[1]["tolerance"], "0.04");
  EXPECT_LE(points[0]["near_max"], 0.08);
  EXPECT_GT(points[0]["near_max"], 0.01) << "the tolerance is made use of";
  EXPECT_LE(points[1]["near_max"], 0.04);
  EXPECT_GT(points[1]["bytes"], points[0]["bytes"]);
  for (const Json& point : points) {
    EXPECT_GT(point["tolerance_ratio"], 0.5);
    EXPECT_LE(point["tolerance_ratio"], 1);
    EXPECT_EQ(point["kept"], true);
  }
  EXPECT_THAT(readTextFile(at("out/tradeoff.csv")), HasSubstr("mesh,tolerance,bytes"));
  EXPECT_THAT(readTextFile(at("out/tradeoff.csv")), HasSubstr(",torn_share,tolerance_ratio,kept\n"));
  EXPECT_EQ(countOf(readTextFile(at("out/index.html")), "<td>yes</td>"), 2u);
  EXPECT_THAT(readTextFile(at("out/index.html")), HasSubstr("for a range of tolerances"));
  const Json recommended = study({"--budget", points[0]["bytes"].dump()})["recommended"];
  EXPECT_EQ(recommended["tolerance"], "4%");
  EXPECT_THAT(recommended["command"].get<std::string>(), HasSubstr("--tolerance=4%"));
}

TEST_F(Tradeoff, theRecommendationRespectsTheBudget) {
  const Json points = studied({})["points"];
  const auto bytes = [&](int n) { return points[n]["bytes"].get<std::size_t>(); };
  const auto within = [&](std::size_t budget) { return studied({"--budget", std::to_string(budget)})["recommended"]; };
  EXPECT_EQ(within(bytes(1))["target_error"], 1e-4) << "exactly the budget is allowed";
  EXPECT_EQ(within(bytes(1) - 1)["target_error"], 1e-3);
  EXPECT_EQ(within(100 * bytes(2))["target_error"], 1e-5);
  EXPECT_TRUE(within(bytes(0) - 1).is_null());
  EXPECT_TRUE(studied({"--within-seconds", "1e-9"})["recommended"].is_null());
  EXPECT_EQ(studied({"--within-seconds", "1e9"})["recommended"]["target_error"], 1e-5);

  // The command line that is recommended builds a field of that size.
  const std::string line = studied({"--budget", std::to_string(bytes(1)), "--grid", "3"})["recommended"]["command"];
  EXPECT_THAT(line, HasSubstr("--grid=3"));
  std::istringstream words(line);
  std::vector<std::string> command;
  for (std::string word; words >> word;) command.push_back(word == "torus.hpsdf" ? at(word) : word);
  ASSERT_EQ(command.front(), "hpsdf");
  command.erase(command.begin());
  ASSERT_EQ(runHere(command).status, 0) << line;
  EXPECT_LE(load(at("torus.hpsdf")).bytes(), bytes(1));

  const Outcome text = runHere({"study", "tradeoff", "builtin:torus", "-o", at("out"), "--target-errors", "1e-3,1e-2",
                                "--points", "2000", "--budget", "1"});
  EXPECT_THAT(text.out, HasSubstr("No field of the range keeps within 1 bytes: the smallest, that of τ = 0.01"));
}

TEST_F(Tradeoff, mistakesAreRefused) {
  const auto refused = [&](const std::vector<std::string>& options, const std::string& message) {
    std::vector<std::string> words = {"study", "tradeoff", "builtin:torus", "-o", at("out")};
    words.insert(words.end(), options.begin(), options.end());
    expectRefused(words, message);
  };
  refused({"--target-errors", "1e-3,0"}, "target-errors");
  refused({"--tolerances", "1%,much"}, "tolerances: expected 1 to 20");
  for (const char* text : {"5%,,2%", "-1", "0%"}) refused({"--tolerances", text}, "tolerances: expected 1 to 20");
  refused({"--tolerances", "5%", "--target-errors", "1e-3"}, "tolerances and target-errors are two ranges");
  refused({"--target-error", "1e-3"}, "target-error: is for");
  refused({"--max-bytes", "1000"}, "max-bytes: is for");
  refused({"--budget", "0"}, "budget");
  refused({"--max-degree", "3"}, "leave out max-degree, or give target-errors");
}

}  // namespace compare_test
}  // namespace hpsdf::app
