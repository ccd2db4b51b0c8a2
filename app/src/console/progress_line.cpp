#include "console/progress_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <system_error>

namespace hpsdf::app {
namespace {

using Seconds = std::chrono::duration<double>;

constexpr double kRedrawSeconds = 0.1;
constexpr double kQuietSeconds = 10;
// Progress is shown only for work that takes longer than this time. The time is longer for logs, where lines cannot be
// erased.
constexpr double kQuickSeconds = 0.3, kQuickSecondsInALog = 2;
constexpr int kBarColumns = 24;
constexpr std::chrono::seconds kTickInterval{1};

/// `reported` is the time at which the fraction was reported. The estimate of the remaining time stays as it was then,
/// because it would grow while nothing is reported.
std::string progressText(const std::string& task, double fraction, double reported, double elapsed) {
  const double percent = std::floor(100 * fraction);
  if (percent < 1) return fmt::format("{}, {}", task, durationText(elapsed));
  std::string text = fmt::format("{} {:3.0f} %, {}", task, percent, durationText(elapsed));
  // Show the remaining time only after the first moments of the work. An earlier estimate would vary too much.
  if (reported > 1 && fraction > 0.02 && fraction < 1)
    text += fmt::format(", about {} left", durationText(reported * (1 - fraction) / fraction));
  return text;
}

}  // namespace

std::mutex& messageMutex() {
  static std::mutex mutex;
  return mutex;
}

std::string durationText(double seconds) {
  const auto whole = static_cast<long long>(std::llround(std::max(0.0, seconds)));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

ProgressLine::ProgressLine(std::ostream& out, bool redraws, Clock::time_point start)
    : out_(out), redraws_(redraws), start_(start) {}

ProgressLine::~ProgressLine() {
  const std::lock_guard lock(messageMutex());
  if (redraws_ && drawn_) out_ << kEraseLine << std::flush;
}

bool ProgressLine::due(Clock::time_point now) const {
  if (!drawn_) return Seconds(now - start_).count() >= (redraws_ ? kQuickSeconds : kQuickSecondsInALog);
  const double quiet = Seconds(now - lastDrawn_).count();
  if (redraws_) return quiet >= kRedrawSeconds;
  return quiet >= kQuietSeconds || static_cast<int>(fraction_ * 4) > lastQuarter_;
}

void ProgressLine::report(std::string_view task, double fraction, Clock::time_point now) {
  const std::lock_guard lock(messageMutex());
  task_ = task;
  fraction_ = std::clamp(fraction, 0.0, 1.0);
  reported_ = now;
  drawIfDue(now);
}

void ProgressLine::tick(Clock::time_point now) {
  const std::lock_guard lock(messageMutex());
  if (!task_.empty()) drawIfDue(now);
}

void ProgressLine::drawIfDue(Clock::time_point now) {
  if (!due(now)) return;
  const std::string text =
      progressText(task_, fraction_, Seconds(reported_ - start_).count(), Seconds(now - start_).count());
  if (redraws_) {
    const int filled = static_cast<int>(fraction_ * kBarColumns);
    out_ << fmt::format("{}[{:#<{}}{:.<{}}] {}", kEraseLine, "", filled, "", kBarColumns - filled, text);
  } else {
    out_ << text << "\n";
  }
  out_ << std::flush;
  drawn_ = true;
  lastDrawn_ = now;
  lastQuarter_ = std::max(lastQuarter_, static_cast<int>(fraction_ * 4));
}

ProgressTicker::ProgressTicker(ProgressLine& line) {
  const auto tickUntilTheEnd = [this, &line](const std::stop_token& stop) {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    while (!wake_.wait_for(lock, stop, kTickInterval, [&] { return stop.stop_requested(); })) line.tick();
  };
  try {
    thread_ = std::jthread(tickUntilTheEnd);
  } catch (const std::system_error&) {  // no more threads are allowed; the line changes whenever the work reports
  }
}

}  // namespace hpsdf::app
