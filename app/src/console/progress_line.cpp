#include "console/progress_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hpsdf::app {
namespace {

using Seconds = std::chrono::duration<double>;

constexpr double kRedrawSeconds = 0.1;
constexpr double kQuietSeconds = 10;
// Progress is shown only for work that takes longer than this time. The time is longer for logs, where lines cannot be
// erased.
constexpr double kQuickSeconds = 0.3, kQuickSecondsInALog = 2;
constexpr int kBarColumns = 24;

}  // namespace

std::string durationText(double seconds) {
  const auto whole = static_cast<long long>(std::llround(std::max(0.0, seconds)));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

ProgressLine::ProgressLine(std::ostream& out, bool redraws, Clock::time_point start)
    : out_(out), redraws_(redraws), start_(start) {}

ProgressLine::~ProgressLine() {
  if (redraws_ && drawn_) out_ << kEraseLine << std::flush;
}

bool ProgressLine::due(double fraction, Clock::time_point now) const {
  if (!drawn_) return Seconds(now - start_).count() >= (redraws_ ? kQuickSeconds : kQuickSecondsInALog);
  const double quiet = Seconds(now - lastDrawn_).count();
  if (redraws_) return quiet >= kRedrawSeconds;
  return quiet >= kQuietSeconds || static_cast<int>(fraction * 4) > lastQuarter_;
}

void ProgressLine::report(std::string_view task, double fraction, Clock::time_point now) {
  fraction = std::clamp(fraction, 0.0, 1.0);
  if (!due(fraction, now)) return;
  const double elapsed = Seconds(now - start_).count();
  std::string text = fmt::format("{} {:3.0f} %, {}", task, std::floor(100 * fraction), durationText(elapsed));
  // Show the remaining time only after the first moments of the work. An earlier estimate would vary too much.
  if (elapsed > 1 && fraction > 0.02 && fraction < 1)
    text += fmt::format(", about {} left", durationText(elapsed * (1 - fraction) / fraction));
  if (redraws_) {
    const int filled = static_cast<int>(fraction * kBarColumns);
    out_ << fmt::format("{}[{:#<{}}{:.<{}}] {}", kEraseLine, "", filled, "", kBarColumns - filled, text);
  } else {
    out_ << text << "\n";
  }
  out_ << std::flush;
  drawn_ = true;
  lastDrawn_ = now;
  lastQuarter_ = std::max(lastQuarter_, static_cast<int>(fraction * 4));
}

}  // namespace hpsdf::app
