#pragma once

#include <chrono>
#include <ostream>
#include <string>
#include <string_view>

namespace hpsdf::app {

/// Makes room for a message on a terminal that shows progress.
constexpr std::string_view kEraseLine = "\r\x1b[K";

/// Shows the progress of an operation, once it has taken a moment: on a terminal one line that is drawn again and again
/// and erased at the end, elsewhere a line then, at every further quarter, and after ten quiet seconds.
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

/// "48 s", "3 min 07 s", "2 h 05 min".
std::string durationText(double seconds);

}  // namespace hpsdf::app
