// Colours of charts that share a page: each pair must be distinguishable for all readers.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "files/svg_chart.h"
#include "support/color_vision.h"

namespace hpsdf::app {
namespace color_sets_test {

support::NamedColor colorOf(const std::string& text) {
  const auto channel = [&](std::size_t at) {
    return static_cast<std::uint8_t>(std::stoi(text.substr(at, 2), nullptr, 16));
  };
  return {text, {channel(1), channel(3), channel(5)}};
}

TEST(ColorSets, curvesOfChartsAreDistinctOnLightAndDarkPages) {
  std::vector<support::NamedColor> colors;
  for (const std::string& color : curveColors()) colors.push_back(colorOf(color));
  const std::vector<support::NamedColor> pages = {colorOf("#fbfbf9"), colorOf("#16181b")};
  for (const support::LeastDifference& least :
       {support::leastDifference(colors), support::leastDifference(colors, pages)})
    EXPECT_GE(least.difference, 20) << least.text;
  EXPECT_EQ(curveColor(curveColors().size() + 1), curveColors()[1]);
}

}  // namespace color_sets_test
}  // namespace hpsdf::app
