// Tests that the table of settings agrees with `BuildOptions` and is consistent.
#include "hpsdf/detail/build_settings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

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

}  // namespace build_settings_test
}  // namespace hpsdf
