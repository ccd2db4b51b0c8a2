#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <ostream>
#include <string>
#include <string_view>
#include <thread>

namespace hpsdf::app {

/// Control sequence that erases the progress line on a terminal. It is written before any message.
constexpr std::string_view kEraseLine = "\r\x1b[K";

/// Returns the mutex that is locked while a progress line or a message is written, so that they do not mix.
std::mutex& messageMutex();

/// Shows the progress of a long operation. On a terminal it redraws one line, and erases the line at the end.
/// In a log it writes one line at first, one after each quarter of the work, and one whenever ten seconds
/// have passed without a line. Below one percent a line tells the time alone, which goes on where "0 %" would seem to
/// stand still.
class ProgressLine {
 public:
  using Clock = std::chrono::steady_clock;

  ProgressLine(std::ostream& out, bool redraws, Clock::time_point start = Clock::now());
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void report(std::string_view task, double fraction, Clock::time_point now = Clock::now());

  /// Shows the time that has passed. Does nothing until a task was reported.
  void tick(Clock::time_point now = Clock::now());

 private:
  bool due(Clock::time_point now) const;
  void drawIfDue(Clock::time_point now);

  std::ostream& out_;
  bool redraws_;
  Clock::time_point start_;
  std::string task_;
  double fraction_ = 0;
  Clock::time_point reported_{};
  Clock::time_point lastDrawn_{};
  bool drawn_ = false;
  int lastQuarter_ = 0;
};

/// Lets a progress line show the time that passes, once a second, while the work reports nothing.
class ProgressTicker {
 public:
  explicit ProgressTicker(ProgressLine& line);

 private:
  std::condition_variable_any wake_;
  std::jthread thread_;  // the last member, so that it ends before the others
};

/// Formats a duration as "48 s", "3 min 07 s" or "2 h 05 min".
std::string durationText(double seconds);

}  // namespace hpsdf::app
