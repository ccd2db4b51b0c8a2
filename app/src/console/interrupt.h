#pragma once

namespace hpsdf::app {

/// Installs handlers for SIGINT, SIGTERM and SIGHUP. The handlers remove unfinished files and end the
/// process with the exit status 128 + the signal's number. While an `InterruptGuard` exists, the first signal only sets
/// a flag. Signals that the parent process ignores stay ignored.
void installInterruptHandlers();

/// Undoes `installInterruptHandlers`: the signals end this process without a message.
void removeInterruptHandlers();

/// While a guard exists, the first SIGINT, SIGTERM or SIGHUP does not end the process, so that the work can stop in an
/// orderly way. Guards may be nested.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// True once SIGINT, SIGTERM or SIGHUP has arrived while a guard existed. Any thread may call this function.
  static bool interrupted();

  /// Returns the signal that made `interrupted` true, or 0.
  static int signal();
};

}  // namespace hpsdf::app
