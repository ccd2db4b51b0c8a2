#pragma once

namespace hpsdf::app {

/// From now on Ctrl-C, a hang-up or a request to terminate ends the process with no file half-written; within an
/// `InterruptGuard` the first of them only sets a flag. Signals that the caller chose to ignore stay ignored.
void installInterruptHandlers();

/// While one lives (they may be nested), work goes on after the first interruption, so that it can end by itself.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// From any thread.
  static bool interrupted();
};

}  // namespace hpsdf::app
