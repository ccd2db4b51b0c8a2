// Tests progress on terminals and in log files, and numbers in texts.
#include "console/progress_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <thread>

#include "console/console.h"
#include "console/long_work.h"
#include "started_program.h"
#include "text/text.h"

namespace hpsdf::app {
namespace progress_line_test {

using started::lineCount;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using Clock = std::chrono::steady_clock;

TEST(Progress, logGetsALineEachQuarterAndEveryTenSeconds) {
  std::ostringstream out;
  const Clock::time_point start{};
  const auto after = [&](double seconds) {
    return start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  };
  {
    ProgressLine line(out, false, start);
    line.report("refining", 0, after(1.9));
    line.report("refining", 0, after(2.1));
    line.report("refining", 0.1, after(5));
    line.report("refining", 0.26, after(6));
    line.report("refining", 0.3, after(7));
    line.report("refining", 0.31, after(17));
    line.report("refining", 1, after(18));
  }
  EXPECT_EQ(out.str(),
            "refining, 2 s\n"
            "refining  26 %, 6 s, about 17 s left\n"
            "refining  31 %, 17 s, about 38 s left\n"
            "refining 100 %, 18 s\n");
}

TEST(Progress, tellsTheTimeWhileNothingIsReported) {
  for (const bool redraws : {false, true}) {
    std::ostringstream out;
    const Clock::time_point start{};
    const auto shown = [&](auto draw) {
      const std::size_t before = out.str().size();
      draw();
      const std::string text = out.str().substr(before);
      return text.substr(text.find(']') == std::string::npos ? 0 : text.find(']') + 2);
    };
    const std::string end = redraws ? "" : "\n";
    ProgressLine line(out, redraws, start);
    EXPECT_EQ(shown([&] { line.tick(start + std::chrono::seconds(5)); }), "") << "no task is known";
    EXPECT_EQ(shown([&] { line.report("fitting", 0.004, start + std::chrono::seconds(6)); }), "fitting, 6 s" + end);
    EXPECT_EQ(shown([&] { line.tick(start + std::chrono::seconds(30)); }), "fitting, 30 s" + end);
    EXPECT_EQ(shown([&] { line.report("fitting", 0.25, start + std::chrono::seconds(40)); }),
              "fitting  25 %, 40 s, about 2 min 00 s left" + end);
    EXPECT_EQ(shown([&] { line.tick(start + std::chrono::seconds(60)); }),
              "fitting  25 %, 1 min 00 s, about 2 min 00 s left" + end);
  }
}

TEST(Progress, timeGoesOnDuringALongStep) {
  std::istringstream in;
  std::ostringstream out, err;
  withProgress(Console{in, out, err, true}, [](const Progress& progress) {
    progress.update("fitting", 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    return true;
  });
  EXPECT_THAT(err.str(), testing::ContainsRegex("fitting, [1-9] s"));
}

TEST(Progress, terminalGetsOneLineThatIsErased) {
  std::ostringstream out;
  const Clock::time_point start{};
  {
    ProgressLine line(out, true, start);
    for (int i = 0; i <= 1000; ++i) line.report("refining", i / 1000.0, start + std::chrono::milliseconds(i));
  }
  EXPECT_EQ(lineCount(out.str()), 0u);
  EXPECT_LE(std::ranges::count(out.str(), '['), 2 * 12);  // two '[' per update, at most 10 updates a second
  EXPECT_THAT(out.str(), EndsWith("\r\x1b[K"));
}

TEST(Progress, shortWorkShowsNothing) {
  for (const bool redraws : {false, true}) {
    std::ostringstream out;
    const Clock::time_point start{};
    {
      ProgressLine line(out, redraws, start);
      const auto step = std::chrono::milliseconds(redraws ? 50 : 450);
      for (int i = 0; i <= 4; ++i) line.report("measuring", i / 4.0, start + i * step);
    }
    EXPECT_EQ(out.str(), "");
  }
}

TEST(Progress, durationsAreReadable) {
  EXPECT_EQ(durationText(0.2), "0 s");
  EXPECT_EQ(durationText(187), "3 min 07 s");
  EXPECT_EQ(durationText(7500), "2 h 05 min");
}

TEST(Progress, forecastsOfShortWorkHaveNoZero) {
  const auto noted = [](double seconds) {
    std::istringstream in;
    std::ostringstream out, err;
    noteForecast(Console{in, out, err}, {.bytes = 2e6, .seconds = seconds});
    return err.str();
  };
  EXPECT_EQ(noted(0.2), "hpsdf: note: the field will take about 2.00 MB and less than a second\n");
  EXPECT_EQ(noted(0.8), noted(0.2));
  EXPECT_EQ(noted(187), "hpsdf: note: the field will take about 2.00 MB and about 3 min 07 s\n");
}

TEST(Summaries, numbersAreReadable) {
  EXPECT_EQ(shortNumber(1e-6), "1e-6");
  EXPECT_EQ(shortNumber(-3.0591e-4), "-3.06e-4");
  EXPECT_EQ(shortNumber(9.999e-7), "1e-6");
  EXPECT_EQ(shortNumber(2.5e12), "2.5e12");
  EXPECT_EQ(shortNumber(0.125), "0.125");
  EXPECT_EQ(shortNumber(0), "0");
  EXPECT_EQ(shortNumber(-INFINITY), "-inf");
  EXPECT_EQ(shortNumber(NAN), "nan");
  EXPECT_EQ(grouped(1234567), "1,234,567");
  EXPECT_EQ(grouped(999), "999");
}

}  // namespace progress_line_test
}  // namespace hpsdf::app
