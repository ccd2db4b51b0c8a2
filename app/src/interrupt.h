#pragma once

#include <csignal>

namespace hpsdf::app {

/// While it lives, the first Ctrl-C only sets a flag; a second one ends the process, as Ctrl-C always does otherwise.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// From any thread.
  static bool interrupted();

 private:
  struct sigaction before_;
};

}  // namespace hpsdf::app
