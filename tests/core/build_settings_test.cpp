// Tests that the table of settings agrees with `BuildOptions` and is consistent.
#include "hpsdf/detail/build_settings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "hpsdf/error.h"

namespace hpsdf {
namespace build_settings_test {

TEST(BuildSettings, namesAreUniqueAndFound) {
  std::set<std::string_view> names;
  for (const BuildSetting& setting : buildSettings()) {
    EXPECT_TRUE(names.insert(setting.name).second) << setting.name;
    EXPECT_EQ(&buildSetting(setting.name), &setting);
    EXPECT_EQ(setting.help.empty(), !setting.isOffered) << setting.name;
  }
  EXPECT_THROW(buildSetting("no-such"), std::logic_error);
}

TEST(BuildSettings, whatIsSetIsGotAndNothingElseChanges) {
  for (const BuildSetting& setting : buildSettings()) {
    SCOPED_TRACE(setting.name);
    BuildOptions options;
    std::vector<double> value = {setting.words.empty() ? std::max(setting.minimum, 0.0) + 1.0 : 1.0};
    if (setting.name == "blend-width") value = {0.125};
    if (setting.type == BuildSetting::Type::wholeNumbers) value = {3, 4, 5};
    setting.set(options, value);
    EXPECT_EQ(setting.get(options), value);
    for (const BuildSetting& other : buildSettings()) {
      const bool isRelated = other.name == setting.name || setting.exclusive == other.name ||
                             other.exclusive == setting.name || other.name == "continuity" ||
                             setting.name == "continuity" || setting.owner == "near-error";
      if (isRelated) continue;
      EXPECT_EQ(other.get(options), other.get(BuildOptions{})) << other.name;
    }
  }
}

TEST(BuildSettings, defaultsAreWithinTheirRanges) {
  for (const BuildSetting& setting : buildSettings())
    for (const double number : setting.get(BuildOptions{})) {
      EXPECT_GE(number, setting.minimum) << setting.name;
      EXPECT_LE(number, setting.maximum) << setting.name;
      if (setting.type != BuildSetting::Type::choice) continue;
      EXPECT_LT(number, double(setting.words.size())) << setting.name;
    }
  EXPECT_EQ(defaultText(buildSetting("target-error")), "1e-6");
  EXPECT_EQ(defaultText(buildSetting("grid")), "6");
  EXPECT_EQ(defaultText(buildSetting("strategy")), "auto");
  EXPECT_EQ(defaultText(buildSetting("estimator")), "checked");
  EXPECT_EQ(defaultText(buildSetting("continuity-weight")), "2.5");
  EXPECT_EQ(defaultText(buildSetting("max-steps")), "");
}

TEST(BuildSettings, storedPositionsFollowEachOther) {
  std::vector<int> positions;
  for (const BuildSetting& setting : buildSettings())
    if (setting.storedAt > 0) positions.push_back(setting.storedAt);
  std::ranges::sort(positions);
  for (std::size_t n = 0; n < positions.size(); ++n) EXPECT_EQ(positions[n], int(n) + 1);
}

TEST(BuildSettings, targetAndErrorsByDistanceExcludeEachOther) {
  BuildOptions options{.targetError = 1e-5};
  options.targetError = NearFarError{.near = 1e-4, .far = 1e-3};
  EXPECT_EQ(options.targetError.weighted(), 0);
  EXPECT_EQ(options.targetError.byDistance().far, 1e-3);
  options.targetError = 1e-5;
  EXPECT_FALSE(options.targetError.isByDistance());
  EXPECT_FALSE(options.targetError.isNone());
  EXPECT_TRUE(ErrorTarget(0).isNone());
}

/// Returns the message of the `Error` of the kind `option` that the action throws, or "" if it throws nothing.
std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::option) << error.what();
    return error.what();
  }
  return "";
}

TEST(GivenSettings, takeTextsAsUsersWriteThem) {
  GivenSettings given;
  given.give("grid", "3, 4,5");
  given.give("strategy", "hp");
  given.give("max-depth", " 7 ");
  given.give("bounds", "true");
  given.give("enrich", "false");
  given.give("target-error", "2.5e-4");
  const BuildOptions options = given.options(0);
  EXPECT_EQ(options.grid, (std::array<std::uint32_t, 3>{3, 4, 5}));
  EXPECT_EQ(options.strategy, Strategy::hp);
  EXPECT_EQ(options.maxDepth, 7);
  EXPECT_TRUE(options.bounds);
  EXPECT_FALSE(options.enrich);
  EXPECT_EQ(options.targetError.weighted(), 2.5e-4);
}

TEST(GivenSettings, takeTheTextsOfAllDefaults) {
  for (const BuildSetting& setting : buildSettings()) {
    const std::string text = defaultText(setting);
    if (!setting.isOffered || text.empty() || setting.hasOwner != nullptr) continue;
    GivenSettings given;
    given.give(setting.name, text);
    EXPECT_EQ(setting.get(given.options(1)), setting.get(BuildOptions{})) << setting.name;
  }
}

TEST(GivenSettings, takePercentagesOfTheLongestSide) {
  GivenSettings given;
  given.give("tolerance", "0.5%");
  EXPECT_DOUBLE_EQ(given.options(4).tolerance, 0.02);
  EXPECT_TRUE(given.options(4).targetError.isNone()) << "a tolerance takes the target's place";
  EXPECT_EQ(refusal([&] { given.options(0); }),
            "tolerance: expected a length, because the longest side of the surface is unknown");
  given.takeBack("tolerance");
  EXPECT_FALSE(given.options(0).targetError.isNone());
}

TEST(GivenSettings, refuseValuesThatAreNone) {
  GivenSettings given;
  const auto message = [&](const char* name, const char* text) { return refusal([&] { given.give(name, text); }); };
  EXPECT_EQ(message("target-eror", "1"), "target-eror: there is no such option: did you mean 'target-error'?");
  EXPECT_EQ(message("trial-samples", "own"),
            "trial-samples: there is no such option: 'hpsdf help build' and docs/commands.md list all options");
  EXPECT_EQ(message("target-error", "-1"), "target-error: expected a number above 0, got -1");
  EXPECT_EQ(message("target-error", "1%"), "target-error: expected a number, got '1%'");
  EXPECT_EQ(message("target-error", ""), "target-error: expected a number, got ''");
  EXPECT_EQ(message("target-error", "inf"), "target-error: expected a number above 0, got inf");
  EXPECT_EQ(message("tolerance", "1 mm"),
            "tolerance: expected a number or a percentage of the mesh's longest side, such as '0.02%', got '1 mm'");
  EXPECT_EQ(message("max-depth", "1.5"), "max-depth: expected a whole number from 0 up to 20, got 1.5");
  EXPECT_EQ(message("max-depth", "1,2"), "max-depth: expected one number");
  EXPECT_EQ(message("grid", "1,2"), "grid: expected one number or three");
  EXPECT_EQ(message("grid", "1,,2"), "grid: expected a number, got '1,,2'");
  EXPECT_EQ(message("strategy", "hpp"), "strategy: there is no 'hpp': did you mean 'hp'?");
  EXPECT_EQ(message("bounds", "yes"), "bounds: expected 'true' or 'false', got 'yes'");
  const double two = 2;
  EXPECT_EQ(refusal([&] { given.give("strategy", {&two, 1}); }), "strategy: expected a word");
}

TEST(GivenSettings, refuseSettingsThatDoNotGoTogether) {
  const auto message = [](const std::vector<std::array<const char*, 2>>& pairs) {
    GivenSettings given('_');
    for (const auto& [name, text] : pairs) given.give(name, text);
    return refusal([&] { given.options(1); });
  };
  EXPECT_EQ(message({{"tolerance", "0.1"}, {"target_error", "1e-6"}}),
            "tolerance: cannot be given together with target_error");
  EXPECT_EQ(message({{"near_distance", "0.1"}}), "near_distance: has no effect without near_error");
  EXPECT_EQ(message({{"certified", "true"}}), "certified: has no effect without tolerance");
  EXPECT_EQ(message({{"certified", "false"}}), "");
  EXPECT_EQ(message({{"tolerance", "0.1"}, {"strategy", "hp"}}),
            "strategy: has no effect with a tolerance, which decides how the field is built: leave out one of them");
}

}  // namespace build_settings_test
}  // namespace hpsdf
