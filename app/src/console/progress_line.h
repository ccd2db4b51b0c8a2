#pragma once

#include <chrono>
#include <ostream>
#include <string>
#include <string_view>

namespace hpsdf::app {

/// Control sequence that erases the progress line on a terminal. It is written before any message.
constexpr std::string_view kEraseLine = "\r\x1b[K";

/// Shows the progress of a long operation. On a terminal it redraws one line, and erases the line at the end.
/// In a log it writes one line at first, one after each quarter of the work, and one whenever ten seconds
/// have passed without a line.
class ProgressLine {
 public:
  using Clock = std::chrono::steady_clock;

  ProgressLine(std::ostream& out, bool redraws, Clock::time_point start = Clock::now());
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void report(std::string_view task, double fraction, Clock::time_point now = Clock::now());

 private:
  bool due(double fraction, Clock::time_point now) const;

  std::ostream& out_;
  bool redraws_;
  Clock::time_point start_;
  Clock::time_point lastDrawn_{};
  bool drawn_ = false;
  int lastQuarter_ = 0;
};

/// Formats a duration as "48 s", "3 min 07 s" or "2 h 05 min".
std::string durationText(double seconds);

}  // namespace hpsdf::app
