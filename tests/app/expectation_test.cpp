#include "language/expectation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "hpsdf/error.h"
#include "hpsdf/types.h"

namespace hpsdf::app {
namespace expectation_test {

using testing::ElementsAre;
using testing::HasSubstr;

std::string refusal(std::string_view text) {
  try {
    parseExpectation(text);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(Expectation, isReadWithOrWithoutBlanks) {
  for (const char* text : {"pick(640,360).gradient.1 <= -2.5e-3", "pick( 640 , 360 ) . gradient . 1<=-2.5e-3"}) {
    const Expectation e = parseExpectation(text);
    EXPECT_EQ(e.source, "pick");
    EXPECT_THAT(e.arguments, ElementsAre(640, 360));
    EXPECT_THAT(e.path, ElementsAre("gradient", "1"));
    EXPECT_EQ(e.comparison, "<=");
    EXPECT_EQ(e.wanted, -2.5e-3);
  }
  EXPECT_EQ(parseExpectation("stats.leaves == 4 within 0.5").tolerance, 0.5);
}

TEST(Expectation, comparesByItsOperator) {
  const auto holds = [](std::string_view text, double found) { return parseExpectation(text).holds(found); };
  EXPECT_TRUE(holds("stats.leaves < 3", 2));
  EXPECT_FALSE(holds("stats.leaves < 3", 3));
  EXPECT_TRUE(holds("stats.leaves <= 3", 3));
  EXPECT_FALSE(holds("stats.leaves <= 3", 3.1));
  EXPECT_TRUE(holds("stats.leaves > 3", 4));
  EXPECT_FALSE(holds("stats.leaves > 3", 3));
  EXPECT_TRUE(holds("stats.leaves >= 3", 3));
  EXPECT_FALSE(holds("stats.leaves >= 3", 2.9));
  EXPECT_TRUE(holds("stats.leaves == 3", 3));
  EXPECT_FALSE(holds("stats.leaves == 3", 3.0000001));
  EXPECT_TRUE(holds("stats.leaves == 3 within 1e-5", 3.000009));
  EXPECT_FALSE(holds("stats.leaves == 3 within 1e-5", 3.00002));
  EXPECT_TRUE(holds("stats.leaves != 3", 4));
  EXPECT_FALSE(holds("stats.leaves != 3 within 2", 4));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const char* text : {"jumps.max < 3", "jumps.max <= 3", "jumps.max > 3", "jumps.max >= 3", "jumps.max == 3"})
    EXPECT_FALSE(holds(text, nan)) << text;
}

TEST(Expectation, theDegreeOfAnExactLeafIsAWord) {
  EXPECT_TRUE(parseExpectation("pick(1,2).degree == exact").holds(kExactDegree));
  EXPECT_FALSE(parseExpectation("at(0,0,0).degree != exact").holds(kExactDegree));
  EXPECT_TRUE(parseExpectation("at(0,0,0).degree < exact").holds(kMaxDegree));
  EXPECT_THAT(refusal("at(0,0,0).depth == exact"), HasSubstr("a number, found 'exact'"));
}

TEST(Expectation, mistakesAreNamed) {
  EXPECT_THAT(refusal("stat.leaves < 3"), HasSubstr("did you mean 'stats'?"));
  EXPECT_THAT(refusal("weather.rain < 3"), HasSubstr("expected stats, jumps, pick(x,y), at(x,y,z)"));
  EXPECT_THAT(refusal("stats < 3"), HasSubstr("stats.NAME"));
  EXPECT_THAT(refusal("stats. < 3"), HasSubstr("a name after the point"));
  EXPECT_THAT(refusal("stats.leaves 3"), HasSubstr("expected =="));
  EXPECT_THAT(refusal("stats.leaves = 3"), HasSubstr("expected =="));
  EXPECT_THAT(refusal("stats.leaves < many"), HasSubstr("a number, found 'many'"));
  EXPECT_THAT(refusal("stats.leaves <"), HasSubstr("a number"));
  EXPECT_THAT(refusal("stats.leaves < 3 leaves"), HasSubstr("nothing more"));
  EXPECT_THAT(refusal("stats.leaves < 3 within 1"), HasSubstr("== and !="));
  EXPECT_THAT(refusal("stats.leaves == 3 within -1"), HasSubstr("at least 0"));
  EXPECT_THAT(refusal("pick(1).degree == 3"), HasSubstr("pick(x,y)"));
  EXPECT_THAT(refusal("pick(1,2.degree == 3"), HasSubstr("a number"));
  EXPECT_THAT(refusal("stats(1).leaves == 3"), HasSubstr("expected stats"));
  EXPECT_THAT(refusal(""), HasSubstr("unknown figures ''"));
}

}  // namespace expectation_test
}  // namespace hpsdf::app
