// The pages that show fields in a browser, as files; tests/web opens them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include "cli_fixture.h"
#include "pictures/field_page.h"

namespace hpsdf::app {
namespace cli_page_test {

using namespace cli;

class Pages : public Cli {
 protected:
  /// Copies the field of the suite into a folder of the test, and returns its path.
  std::string copyOfField(const std::string& name) const {
    fs::create_directories(fs::path(at(name)).parent_path());
    fs::copy_file(field(), at(name));
    return at(name);
  }

  /// Runs the command with these words besides the output, and returns the page.
  std::string page(std::vector<std::string> words) const {
    words.insert(words.begin(), "page");
    words.insert(words.end(), {"-o", at("page.html")});
    const Outcome outcome = run({words});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_THAT(outcome.err, IsEmpty());
    return readFile(at("page.html"));
  }
};

/// Returns what the first group of the pattern matches, at each place.
std::vector<std::string> found(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::vector<std::string> result;
  for (std::sregex_iterator match(text.begin(), text.end(), regex), end; match != end; ++match)
    result.push_back((*match)[1]);
  return result;
}

std::vector<std::string> fieldNames(const std::string& page) {
  return found(page, "class=\"field\" data-name=\"([^\"]*)\"");
}

std::vector<std::string> captions(const std::string& page) { return found(page, "<figcaption>([^<]*)</figcaption>"); }

TEST_F(Pages, holdEachFieldUnderANameOfItsOwn) {
  const std::string other = copyOfField("other.hpsdf");
  const std::string a = copyOfField("a/f.hpsdf"), b = copyOfField("b/f.hpsdf");
  const std::string html = page({other, a, b, other, "--cpu"});
  EXPECT_THAT(fieldNames(html), ElementsAre("other (1)", "a/f", "b/f", "other (2)"));
  EXPECT_THAT(captions(html), testing::SizeIs(8));
  EXPECT_THAT(html, HasSubstr("<title>other (1), a/f, b/f, other (2)</title>"));
  EXPECT_THAT(html, Not(HasSubstr(folder_.path().string()))) << "a page tells nobody where its fields lay";
}

TEST_F(Pages, takeNamesTitlesAndViews) {
  const std::string html = page({field(), field(), "--name", "<one>", "--name", "{{fields}}", "--title",
                                 "{{pictures}} & {{fields}}", "--view", "show slice; color depth", "--pictures=false"});
  EXPECT_THAT(fieldNames(html), ElementsAre("&lt;one&gt;", "{{fields}}"));
  EXPECT_THAT(html, HasSubstr("<title>{{pictures}} &amp; {{fields}}</title>"));
  EXPECT_THAT(found(html, "data-view=\"([^\"]*)\""), ElementsAre("show slice; color depth", "show slice; color depth"));
  EXPECT_THAT(html, Not(HasSubstr("<figure>")));
}

TEST_F(Pages, haveTheSameBytesEachTime) {
  const std::string html = page({field(), "--cpu"});
  EXPECT_EQ(page({field(), "--cpu"}), html);
}

TEST_F(Pages, drawTheirPicturesByTheCpuWhereThereIsNoOpenGl) {
  const std::map<std::string, std::string> noEgl = {{"__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent"}};
  ASSERT_EQ(run({.words = {"page", field(), "-o", at("none.html")}, .environment = noEgl}).status, 0);
  EXPECT_EQ(readFile(at("none.html")), page({field(), "--cpu"}));
  expectRefused({.words = {"page", field(), "-o", at("x.html"), "--gl", "software"}, .environment = noEgl},
                "render with --cpu");
}

TEST_F(Pages, areOfTheCurrentFieldInScripts) {
  const std::string script =
      "build builtin:torus target-error=1e-3; page cpu=true output=" + at("page.html") + "; info";
  const Outcome outcome = run({{"run", "-e", script}});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(fieldNames(readFile(at("page.html"))), ElementsAre("torus"));
}

TEST_F(Pages, takeTheViewThatTheExplorerCopies) {
  const Outcome copied = run({{"run", "-e", "load " + field() + "; show slice; plane axis=x; arrows 40; copy-view"}});
  ASSERT_EQ(copied.status, 0) << copied.err;
  const std::string view = copied.out.substr(copied.out.find("\nshow ") + 1);
  ASSERT_THAT(view, AllOf(HasSubstr("panel "), HasSubstr("arrows 40"), HasSubstr("triangles ")));
  const std::string html = page({field(), "--view", view, "--pictures=false"});
  EXPECT_THAT(found(html, "data-view=\"([^\"]*)\""), ElementsAre(HasSubstr("plane axis=x ")));
}

TEST_F(Pages, refuseWhatTheyCannotShow) {
  const std::string good = copyOfField("good.hpsdf");
  writeFile(at("cut.hpsdf"), readFile(field()).substr(0, 2000));
  writeFile(at("text.hpsdf"), "no field");
  const auto refused = [&](std::vector<std::string> words, const std::string& message) {
    words.insert(words.begin(), "page");
    words.insert(words.end(), {"-o", at("page.html")});
    expectRefused({words}, message);
  };
  refused({good, at("missing.hpsdf")}, "missing.hpsdf: no such file");
  refused({good, at("text.hpsdf")}, "text.hpsdf: is not a .hpsdf file");
  refused({good, at("cut.hpsdf")}, "cut.hpsdf: the field file is damaged");
  refused({good, "--view", "show nothing"}, "view:1:6: kind: expected surface or slice");
  refused({good, "--view", "show slice\nload x"}, "view:2:1: load is no command about a view");
  refused({good, "--name", "a", "--name", "b"}, "name: given 2 times for 1 field");
  refused({good, good, "--name", "a", "--name", "a"}, "two fields have the same");
  expectRefused({{"page", field(), good, "-o", good}}, "is read by the same command");
}

TEST(DistinctNames, tellFilesApart) {
  EXPECT_THAT(distinctNames({"a/x.hpsdf", "b/y.hpsdf"}), ElementsAre("x", "y"));
  EXPECT_THAT(distinctNames({"a/x.hpsdf", "b/x.hpsdf", "y.hpsdf"}), ElementsAre("a/x", "b/x", "y"));
  EXPECT_THAT(distinctNames({"a/x.hpsdf", "a/x.hpsdf", "b/x.hpsdf"}), ElementsAre("x (1)", "x (2)", "b/x"));
}

}  // namespace cli_page_test
}  // namespace hpsdf::app
