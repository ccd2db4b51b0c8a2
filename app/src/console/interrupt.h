#pragma once

namespace hpsdf::app {

/// Installs handlers of SIGINT, SIGTERM and SIGHUP. They remove unfinished files and end the process; while an
/// `InterruptGuard` lives, the first signal only sets a flag. Signals that the caller ignores stay ignored.
void installInterruptHandlers();

/// While a guard lives, the first interruption does not end the process, so that the work can end in order. Guards may
/// be nested.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// True once a signal has arrived. Any thread may call it.
  static bool interrupted();
};

}  // namespace hpsdf::app
