// Tests `hpsdf check` and `hpsdf accept` on small folders: each kind of failure must be found and named.
#include "check/check.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <vector>

#include "check/baseline.h"
#include "files/data_table.h"
#include "files/text_file.h"
#include "hpsdf/error.h"
#include "hpsdf/render/image.h"
#include "outcome.h"
#include "support/temporary_directory.h"

namespace hpsdf::app {
namespace check_test {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::string readFile(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  EXPECT_TRUE(stream) << file;
  return {std::istreambuf_iterator<char>(stream), {}};
}

void writeFile(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

const std::string kBuild = "build analytic:sphere target-error=1e-2 grid=2\n";
const std::string kLook = "slice cpu=true size=96x64 ";

/// Returns true if the elements of an XML or HTML text are closed in the right order.
bool isWellFormed(const std::string& xml) {
  static const std::regex tag(R"(<(/?)([a-z]+)((?:\s+[a-z]+="[^"<>]*")*)\s*(/?)>)");
  std::vector<std::string> open;
  for (std::sregex_iterator at(xml.begin(), xml.end(), tag), end; at != end; ++at) {
    if ((*at)[4] == "/") continue;
    if ((*at)[1] != "/") {
      open.push_back((*at)[2]);
      continue;
    }
    if (open.empty() || open.back() != (*at)[2]) return false;
    open.pop_back();
  }
  const std::string rest = std::regex_replace(xml, tag, "");
  return open.empty() && rest.starts_with("<?xml ") && std::ranges::count(rest, '<') == 1;
}

/// A test folder for scripts and baseline pictures, and a folder for the results.
class Check : public testing::Test {
 protected:
  void script(const std::string& text, const std::string& name = "looks") {
    writeFile(pictures_ / "scripts" / (name + ".hps"), text);
  }
  Outcome check(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {"check", pictures_, "--out", results_};
    words.insert(words.end(), more.begin(), more.end());
    return runHere(words);
  }
  Outcome accept(const std::vector<std::string>& names) const {
    std::vector<std::string> words = {"accept", pictures_, "--from", results_};
    words.insert(words.end(), names.begin(), names.end());
    return runHere(words);
  }
  /// Returns lines "SCRIPT/PICTURE: RESULT" in order; "!" marks a negative control, an intentionally wrong picture.
  std::vector<std::string> results(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {"--json"};
    words.insert(words.end(), more.begin(), more.end());
    std::vector<std::string> found;
    const Json json = Json::parse(check(words).out);
    for (const Json& item : json.at("items"))
      found.push_back(item.at("script").get<std::string>() + "/" + item.at("picture").get<std::string>() +
                      (item.at("control_line").is_null() ? "" : "!") + ": " + item.at("result").get<std::string>());
    return found;
  }
  /// Runs the scripts once and accepts the named pictures as baselines.
  void take(const std::vector<std::string>& names) const {
    EXPECT_EQ(check().status, 1);
    const Outcome accepted = accept(names);
    ASSERT_EQ(accepted.status, 0) << accepted.err;
  }
  fs::path baseline(const std::string& name) const { return pictures_ / "baselines" / name; }
  std::string page() const { return readFile(results_ / "index.html"); }

  support::TemporaryDirectory folder_;
  fs::path pictures_ = folder_ / "pictures";
  fs::path results_ = folder_ / "results";
};

TEST_F(Check, picturesThatAgreePass) {
  script(kBuild + kLook + "output=$out/a.png\n" + kLook + "color=$color output=$out/b.png\n");
  EXPECT_EQ(check({"color=depth"}).status, 1) << "no baselines yet";
  ASSERT_EQ(accept({"looks/a.png", "looks/b.png"}).status, 0);
  const Outcome outcome = check({"color=depth"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, testing::ContainsRegex("looks +a.png +ok +0 +0\n"));
  EXPECT_THAT(page(), HasSubstr("All 2 comparisons are as they should be"));
  EXPECT_THAT(page(), Not(HasSubstr("data:image")));
  EXPECT_EQ(check({"color=distance"}).status, 1);
  EXPECT_THAT(results({"color=distance"}), ElementsAre("looks/a.png: ok", "looks/b.png: differs"));
}

TEST_F(Check, aWrongPictureIsShownWithItsDifference) {
  script(kBuild + kLook + "output=$out/a.png\n");
  take({"looks/a.png"});
  script(kBuild + kLook + "offset=0.2 output=$out/a.png\n");
  const Outcome outcome = check();
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.out, HasSubstr("pixels differ by more than 3/255"));
  EXPECT_THAT(outcome.err, HasSubstr("1 of 1 comparisons failed; " + (results_ / "index.html").string()));
  EXPECT_EQ(render::loadPng(results_ / "difference/looks/a.png").width, 96);
  EXPECT_EQ(render::loadPng(results_ / "actual/looks/a.png").width, 96);
  EXPECT_THAT(page(), AllOf(HasSubstr("looks/a.png: differs"), HasSubstr("class=\"slider\""), HasSubstr("x "),
                            HasSubstr("Renderer of the baseline"), HasSubstr("looks.hps:2:1"),
                            HasSubstr("--only looks"), HasSubstr("hpsdf accept")));
}

TEST_F(Check, thePageHoldsItsPictures) {
  script(kBuild + kLook + "output=$out/a.png\n" + kLook + "output=\"$out/<b>&.png\"\n", "a&b");
  take({"a&b/a.png", "a&b/<b>&.png"});
  script(kBuild + kLook + "offset=0.2 output=$out/a.png\n" + kLook + "offset=0.2 output=\"$out/<b>&.png\"\n", "a&b");
  EXPECT_EQ(check({"--junit", folder_ / "junit.xml", "note=<i>"}).status, 1);
  const std::string html = page();
  const std::regex image("<img src=\"([^\"]{0,30})");
  std::size_t images = 0;
  for (std::sregex_iterator at(html.begin(), html.end(), image), end; at != end; ++at, ++images)
    EXPECT_THAT((*at)[1].str(), testing::StartsWith("data:image/png;base64,"));
  EXPECT_EQ(images, 6u) << "baseline, actual and difference, each once";
  EXPECT_THAT(html, AllOf(Not(HasSubstr("http")), Not(HasSubstr("<b>")), Not(HasSubstr("<i>")), Not(HasSubstr("a&b")),
                          HasSubstr("a&amp;b/&lt;b&gt;&amp;.png: differs"),
                          HasSubstr("<a href=\"live/a%26b/%3Cb%3E%26.png.html\"")));
  const std::string png = readFile(results_ / "actual/a&b/a.png");
  EXPECT_EQ(png.substr(1, 3), "PNG");
  EXPECT_THAT(html, HasSubstr("base64,iVBORw0KGgo")) << "how every PNG begins";
  EXPECT_TRUE(isWellFormed(readFile(folder_ / "junit.xml"))) << readFile(folder_ / "junit.xml");
  EXPECT_THAT(readFile(folder_ / "junit.xml"), HasSubstr("name=\"&lt;b&gt;&amp;.png\""));
}

/// Returns the view that a page of a field shows first.
std::string firstView(const std::string& page) {
  const std::size_t begin = page.find("data-view=\"") + std::string_view("data-view=\"").size();
  return page.substr(begin, page.find('"', begin) - begin);
}

TEST_F(Check, failedPicturesHaveAPageOfTheirFieldInTheirView) {
  script(kBuild + kLook + "output=$out/good.png\n" + kLook + "axis=x offset=$at color=depth output=$out/slice.png\n" +
         kLook + "output=$out/values.csv\n" +
         "render cpu=true size=96x64 camera=40,20,1.1 clip=y clip-offset=$at output=$out/surface.png\n"
         "probe from=0,0,0 to=$at,0,0 size=96x64 output=$out/line.png\n"
         "build analytic:torus target-error=1e-1 grid=2\nshow slice size=160x120 cpu=true\nplane axis=y offset=$at\n"
         "color slope\nshot output=$out/shot.png\nbuild analytic:box target-error=1e-1 grid=2\n");
  EXPECT_EQ(check({"at=0.25"}).status, 1);
  ASSERT_EQ(accept({"looks/good.png", "looks/slice.png", "looks/values.csv", "looks/surface.png", "looks/line.png",
                    "looks/shot.png"})
                .status,
            0);
  ASSERT_EQ(check({"at=0.25"}).status, 0);
  EXPECT_FALSE(fs::exists(results_ / "live")) << "no picture failed";
  EXPECT_THAT(page(), Not(HasSubstr("<details class=\"live\"")));
  std::map<std::string, std::string> live;
  const Json json = Json::parse(check({"at=0.5", "--json"}).out);
  for (const Json& item : json.at("items"))
    if (!item.at("live").is_null()) live[item.at("picture")] = readFile(item.at("live").get<std::string>());
  ASSERT_EQ(live.size(), 3u) << "the line is no view of the field, and the others agree";
  EXPECT_EQ(firstView(live.at("slice.png")),
            "show slice\nplane axis=x offset=0.5 zoom=1 target=center\ncolor depth of=slice\n");
  EXPECT_EQ(firstView(live.at("surface.png")),
            "show surface\ncamera 40,20,1.1 target=center up=y projection=perspective\n"
            "surface offset=0 clip=y clip-offset=0.5\ncells none depths=all\ncolor normal of=surface\n");
  EXPECT_THAT(firstView(live.at("shot.png")), AllOf(HasSubstr("show slice "), HasSubstr("plane axis=y offset=0.5 ")));
  EXPECT_THAT(live.at("slice.png"), HasSubstr("data-name=\"sphere\""));
  EXPECT_THAT(live.at("shot.png"), HasSubstr("data-name=\"torus\"")) << "the field may be replaced later";
  EXPECT_THAT(page(), HasSubstr("<a href=\"live/looks/shot.png.html\""));
  EXPECT_EQ(check({"at=0.25"}).status, 0);
  EXPECT_FALSE(fs::exists(results_ / "live")) << "results of an earlier check are removed";
}

TEST_F(Check, noMoreThanFourPagesOfFieldsAScript) {
  std::string text = kBuild;
  for (int n = 0; n < 6; ++n) text += kLook + fmt::format("output=$out/{}.png\n", n);
  script(text);
  EXPECT_EQ(check().status, 1);
  EXPECT_EQ(std::distance(fs::directory_iterator(results_ / "live/looks"), fs::directory_iterator()), 4);
}

TEST_F(Check, anotherSizeAndMissingAndOrphanedBaselinesFail) {
  script(kBuild + kLook + "output=$out/a.png\n" + kLook + "output=$out/gone.png\n");
  script(kBuild + kLook + "output=$out/c.png\n", "removed");
  take({"looks/a.png", "looks/gone.png", "removed/c.png"});
  script(kBuild + "slice cpu=true size=96x65 output=$out/a.png\n" + kLook + "output=$out/new.png\n");
  fs::remove(pictures_ / "scripts/removed.hps");
  EXPECT_THAT(results(), ElementsAre("looks/a.png: another size", "looks/gone.png: no picture",
                                     "looks/new.png: no baseline", "removed/c.png: no picture"));
  EXPECT_THAT(page(), AllOf(HasSubstr("96x64 and 96x65"), HasSubstr("If it is right now")));
  EXPECT_EQ(check({"--only", "looks"}).status, 1);
  EXPECT_EQ(results({"--only", "looks"}).size(), 3u);
}

TEST_F(Check, aScriptThatFailsIsNamedAndTheOthersRun) {
  script(kBuild + kLook + "output=$out/a.png\n" + kLook + "output=$out/b.png\n", "one");
  script(kBuild + kLook + "output=$out/a.png\n", "two");
  take({"one/a.png", "one/b.png", "two/a.png"});
  script(kBuild + kLook + "output=$out/a.png\nload none.hpsdf\n" + kLook + "output=$out/b.png\n", "one");
  const Outcome outcome = check({"--junit", results_ / "junit.xml"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("one.hps:3:1"), HasSubstr("none.hpsdf")));
  EXPECT_THAT(results(), ElementsAre("one/a.png: ok", "one/: script failed", "two/a.png: ok"));
  script(kBuild + "slice colour=degree output=$out/a.png\n", "one");
  EXPECT_THAT(results(), ElementsAre("one/: script failed", "two/a.png: ok"));
  EXPECT_THAT(check().out, HasSubstr("did you mean 'color'?"));
  EXPECT_THAT(readFile(results_ / "junit.xml"), AllOf(HasSubstr("<error "), HasSubstr("errors=\"1\"")));
  script("check " + pictures_.string() + "\n", "two");
  EXPECT_THAT(check().out, HasSubstr("a script cannot run it"));
}

TEST_F(Check, anExpectationThatDoesNotHoldIsAFailureAndNoMistake) {
  script(kBuild + kLook + "output=$out/a.png\nexpect stats.leaves > 0\n");
  take({"looks/a.png"});
  EXPECT_EQ(check().status, 0);
  script(kBuild + kLook + "output=$out/a.png\nexpect stats.leaves < 0\n");
  const Outcome outcome = check({"--junit", results_ / "junit.xml"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("looks.hps:3:1"), HasSubstr("expected stats.leaves < 0, found")));
  EXPECT_THAT(results(), ElementsAre("looks/a.png: ok", "looks/: expected otherwise"));
  EXPECT_THAT(readFile(results_ / "junit.xml"), AllOf(HasSubstr("<failure "), HasSubstr("errors=\"0\"")));
}

TEST_F(Check, negativeControlsMustFailAsStated) {
  const std::string right = kBuild + kLook + "output=$out/a.png\n";
  script(right);
  take({"looks/a.png"});
  script(right + "# wrong pixels: " + kLook + "offset=0.2 output=$wrong/a.png\n" +
         "# wrong size: slice cpu=true size=96x65 output=$wrong/a.png\n");
  EXPECT_EQ(check().status, 0);
  EXPECT_THAT(results(), ElementsAre("looks/a.png: ok", "looks/a.png!: ok", "looks/a.png!: ok"));
  EXPECT_EQ(render::loadPng(results_ / "wrong/looks/4/a.png").height, 65);

  script(right + "# wrong pixels: " + kLook + "output=$wrong/a.png\n");
  EXPECT_EQ(check().status, 1);
  EXPECT_THAT(results(), ElementsAre("looks/a.png: ok", "looks/a.png!: wrong, not noticed"));
  script(right + "# wrong size: " + kLook + "offset=0.2 output=$wrong/a.png\n");
  EXPECT_THAT(results(), ElementsAre("looks/a.png: ok", "looks/a.png!: wrong otherwise"));
  script(right + "# wrong pixels: " + kLook + "output=$wrong/b.png\n");
  EXPECT_THAT(results(), ElementsAre("looks/a.png: ok", "looks/b.png!: no baseline"));

  script(right + "# wrong pixels: info\n");
  EXPECT_THAT(check().out, HasSubstr("looks.hps:3:17: expected a control to write a picture into $wrong"));
  for (const char* typo : {"# wrong pixel: info\n", "# wrong: info\n", "#wrong pixels: info\n"}) {
    script(right + typo);
    EXPECT_THAT(check().out, HasSubstr("looks.hps:3:1: expected '# wrong pixels: COMMAND'")) << typo;
  }
  script(right + "# wrong pixels:\n");
  EXPECT_THAT(check().out, HasSubstr("looks.hps:3: expected a command after the colon"));
  script(right + "# wrong pixels: slice colour=degree\n");
  EXPECT_THAT(check().out, HasSubstr("looks.hps:3:23: slice: unknown option 'colour'")) << "the column in the file";
}

TEST_F(Check, controlsOfIncludedScriptsAreComments) {
  script("# a comment\nset axis=z\n" + kBuild + "include parts/look.hps\n# wrong pixels: include parts/wrong.hps\n");
  writeFile(pictures_ / "scripts/parts/look.hps",
            kLook + "output=$out/a.png axis=$axis\n\n\n\n# wrong nonsense\n" + kLook + "output=$out/b.png\n");
  writeFile(pictures_ / "scripts/parts/wrong.hps", "set color=distance\n" + kLook +
                                                       "color=$color output=$wrong/a.png\n" + kLook +
                                                       "color=$color output=$wrong/b.png\n");
  take({"looks/a.png", "looks/b.png"});
  EXPECT_THAT(results(), ElementsAre("looks/a.png: ok", "looks/b.png: ok", "looks/a.png!: ok", "looks/b.png!: ok"));
}

TEST_F(Check, acceptTakesOnlyNamedPictures) {
  script(kBuild + kLook + "output=$out/a.png\n" + kLook + "output=$out/b.png\n");
  EXPECT_EQ(check().status, 1);
  EXPECT_THAT(accept({"looks/a.pgn"}).err, HasSubstr("did you mean 'looks/a.png'?"));
  EXPECT_EQ(accept({"looks/a.png", "looks/c.png"}).status, 2);
  EXPECT_FALSE(fs::exists(pictures_ / "baselines"));
  EXPECT_EQ(accept({}).status, 2);

  const Outcome first = accept({"looks/a.png"});
  EXPECT_EQ(first.status, 0);
  EXPECT_THAT(first.out, AllOf(HasSubstr("CPU"), HasSubstr("none: a new baseline")));
  EXPECT_FALSE(fs::exists(baseline("looks/b.png")));
  EXPECT_EQ(readFile(baseline("looks/a.png")), readFile(results_ / "actual/looks/a.png"));
  const BaselineFacts facts = loadFacts(baseline("looks/a.png"));
  EXPECT_THAT(facts.size, ElementsAre(96u, 64u));
  EXPECT_THAT(facts.renderer, HasSubstr("CPU"));
  EXPECT_THAT(facts.version, HasSubstr("hpsdf "));
  EXPECT_EQ(facts.budget, std::nullopt);

  EXPECT_EQ(runHere({"accept", pictures_, "looks/a.png", "--from", results_, "--budget", "0.5"}).status, 0);
  const Outcome again = accept({"looks/a.png"});
  EXPECT_THAT(again.out, Not(HasSubstr("a new baseline")));
  EXPECT_EQ(loadFacts(baseline("looks/a.png")).budget, 0.5) << "kept";
}

TEST_F(Check, budgetsAreThoseOfTheBaseline) {
  script(kBuild + kLook + "output=$out/a.png\n");
  take({"looks/a.png"});
  script(kBuild + kLook + "offset=0.2 output=$out/a.png\n");
  EXPECT_EQ(check().status, 1);
  BaselineFacts facts = loadFacts(baseline("looks/a.png"));
  facts.budget = 1;
  saveFacts(facts, baseline("looks/a.png"));
  EXPECT_EQ(check().status, 0);
  for (const char* bad : {R"({"budgett": 1})", R"({"budget": 2})", R"({"budget": "all"})", R"({"size": [3, 1e300]})",
                          R"({"size": [3, -1]})", R"({"size": [3]})", R"({"a\nb": 1})", "x", "3"}) {
    writeFile(factsFile(baseline("looks/a.png")), bad);
    EXPECT_THAT(results(), ElementsAre("looks/a.png: unreadable")) << bad;
    EXPECT_THAT(check().out, HasSubstr("a.json")) << bad;
  }
  fs::remove(factsFile(baseline("looks/a.png")));
  EXPECT_THAT(results(), ElementsAre("looks/a.png: unreadable"));
  take({"looks/a.png"});
  writeFile(baseline("looks/a.png"), "no picture");
  EXPECT_THAT(results(), ElementsAre("looks/a.png: unreadable"));
}

TEST_F(Check, rawValuesAreComparedToo) {
  const std::string right = kBuild +
                            "slice cpu=true size=20x20 output=$out/v.csv\nslice cpu=true size=20x20 "
                            "output=$out/v.pfm\n";
  script(right + "# wrong values: slice cpu=true size=20x20 offset=1e-3 output=$wrong/v.pfm\n" +
         "# wrong size: slice cpu=true size=19x20 output=$wrong/v.csv\n");
  take({"looks/v.csv", "looks/v.pfm"});
  EXPECT_THAT(results(), ElementsAre("looks/v.csv: ok", "looks/v.pfm: ok", "looks/v.pfm!: ok", "looks/v.csv!: ok"));
  EXPECT_TRUE(fs::exists(baseline("looks/v.csv.json")));
  script(kBuild + "slice cpu=true size=20x20 offset=0.1 output=$out/v.csv\n");
  EXPECT_THAT(check().out, HasSubstr("values differ by more than 1e-6"));
  EXPECT_THAT(page(), AllOf(HasSubstr("row 1, column 3"), Not(HasSubstr("data:image"))));
}

TEST_F(Check, badCallsAreRefused) {
  EXPECT_THAT(check().err, HasSubstr("has no scripts"));
  script(kBuild + kLook + "output=$out/a.png\n");
  EXPECT_THAT(check({"--only", "loks"}).err, HasSubstr("did you mean 'looks'?"));
  EXPECT_THAT(check({"out=x"}).err, HasSubstr("set by check itself"));
  EXPECT_THAT(check({"x"}).err, HasSubstr("expected name=value"));
  EXPECT_THAT(accept({"looks/a.png"}).err, HasSubstr("run 'hpsdf check"));
  EXPECT_FALSE(fs::exists(results_));
  EXPECT_EQ(check({"--junit", folder_ / "none/junit.xml"}).status, 2);

  writeFile(folder_ / "mine/thesis.txt", "years of work");
  const Outcome mine = runHere({"check", pictures_, "--out", folder_ / "mine"});
  EXPECT_EQ(mine.status, 2);
  EXPECT_THAT(mine.err, HasSubstr("holds files that are not earlier results"));
  EXPECT_EQ(readFile(folder_ / "mine/thesis.txt"), "years of work");
  EXPECT_EQ(runHere({"check", pictures_, "--out", folder_ / "mine/thesis.txt"}).status, 2);

  EXPECT_EQ(check().status, 1);
  writeFile(folder_ / "other/scripts/looks.hps", "");
  EXPECT_THAT(runHere({"accept", folder_ / "other", "looks/a.png", "--from", results_}).err, HasSubstr("a check of"));
}

TEST_F(Check, everyScriptAndPictureIsReported) {
  script(kBuild + kLook + "output=$out/a.PNG\nslice cpu=true size=20x20 output=$out/v.CSV\n");
  script(kBuild, "quiet");
  EXPECT_THAT(results(), ElementsAre("looks/a.PNG: no baseline", "looks/v.CSV: no baseline", "quiet/: ok"));
  EXPECT_THAT(check().out, testing::ContainsRegex("quiet +\\(script\\) +ok"));
  take({"looks/a.PNG", "looks/v.CSV"});
  EXPECT_EQ(check().status, 0);
}

TEST_F(Check, resultsOfAnEarlierCheckAreRemoved) {
  script(kBuild + kLook + "output=$out/a.png\n" + kLook + "output=$out/b.png\n");
  take({"looks/a.png", "looks/b.png"});
  script(kBuild + kLook + "output=$out/a.png\n");
  EXPECT_THAT(results(), ElementsAre("looks/a.png: ok", "looks/b.png: no picture"));
  EXPECT_THAT(accept({"looks/b.png"}).err, HasSubstr("wrote no picture 'looks/b.png'"));
}

TEST(DataTable, valuesWithinTheBoundAgree) {
  const DataTable table{.columns = 2, .rows = 2, .values = {1, 2, 3, 4}};
  DataTable other = table;
  other.values = {1 + 1e-7, 2, 3, 4};
  EXPECT_EQ(problem(compare(table, other, 1e-6), 1e-6, 0), "");
  other.values = {1, 2, 3.5, 4.25};
  const DataComparison comparison = compare(table, other, 1e-6);
  EXPECT_EQ(problem(comparison, 1e-6, 0.25), "2 of 4 values differ by more than 1e-6, at most by 0.5");
  EXPECT_EQ(problem(comparison, 1e-6, 0.5), "");
  ASSERT_EQ(comparison.worst.size(), 2u);
  EXPECT_EQ(comparison.worst[0].row, 1u);
  EXPECT_EQ(comparison.worst[0].column, 0u);
  other = table;
  other.header = "x,y";
  EXPECT_NE(problem(compare(table, other, 1e-6), 1e-6, 1), "");
}

TEST(DataTable, nanAgreesWithNanOnly) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const DataTable table{.columns = 1, .rows = 2, .values = {nan, 1}};
  EXPECT_EQ(compare(table, table, 0).differing, 0u);
  DataTable other = table;
  other.values = {1, nan};
  EXPECT_EQ(compare(table, other, 1e9).differing, 2u);
}

TEST(DataTable, readsTheDegreeOfExactLeaves) {
  const support::TemporaryDirectory folder;
  writeTextFile(folder / "a.csv", "value,degree,depth\n0.5,exact,3\n0.25,4,exact\n");
  EXPECT_EQ(loadData(folder / "a.csv").values, (std::vector<double>{0.5, kExactDegree, 3, 0.25, 4, kExactDegree}));
  writeTextFile(folder / "a.csv", "0.5,exactly,3\n1,exactly,3\n");
  EXPECT_THROW(loadData(folder / "a.csv"), Error);
}

TEST(DataTable, brokenFilesAreRefusedByName) {
  const support::TemporaryDirectory folder;
  for (const char* text : {"x,y\n1,2\n1\n", "1,2\n1,b\n", "x\n1,2\n", "x\n\n", "x\n1,\n"}) {
    writeFile(folder / "a.csv", text);
    EXPECT_THROW(loadData(folder / "a.csv"), Error) << text;
  }
  for (const char* text : {"", "Pf\n1 1\n-1.0\n12", "PF\n1 1\n-1.0\n1234", "Pf\n1 1\n1.0\n1234", "Pf\n1 1\n-1.0\n12345",
                           "Pf\n-1 -1\n-1.0\n1234", "Pf\n9223372036854775808 2\n-1.0\n"}) {
    writeFile(folder / "a.pfm", text);
    EXPECT_THROW(loadData(folder / "a.pfm"), Error) << text;
  }
  writeFile(folder / "a.csv", "x,y\n1,nan\n-2e3,4\n");
  const DataTable table = loadData(folder / "a.csv");
  EXPECT_EQ(table.header, "x,y");
  EXPECT_EQ(table.rows, 2u);
  EXPECT_EQ(table.values[2], -2e3);
}

TEST(JUnit, invalidXmlCharactersAreReplaced) {
  CheckOutcome outcome;
  CheckedItem item{
      .script = "a", .picture = "b\x01\xff.png", .verdict = Verdict::differs, .problem = "x < \"y\" & z\n"};
  outcome.items.push_back(item);
  const std::string xml = junitXml(outcome);
  EXPECT_TRUE(isWellFormed(xml)) << xml;
  EXPECT_THAT(xml, HasSubstr("message=\"x &lt; &quot;y&quot; &amp; z \""));
  EXPECT_THAT(xml, Not(HasSubstr("\x01")));
  EXPECT_THAT(xml, Not(HasSubstr("\xff")));
  EXPECT_FALSE(isWellFormed(xml + "</x>")) << "this test's own check";
  EXPECT_FALSE(isWellFormed("<?xml ?><a b=\"<\"></a>"));
}

}  // namespace check_test
}  // namespace hpsdf::app
