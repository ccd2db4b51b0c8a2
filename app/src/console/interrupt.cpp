#include "console/interrupt.h"

#include <unistd.h>

#include <atomic>
#include <csignal>
#include <string_view>

#include "hpsdf/detail/output_file.h"

namespace hpsdf::app {
namespace {

std::atomic<int> guards = 0;
std::atomic<int> firstSignal = 0;  // the first signal that arrived while a guard existed, or 0
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler may use lock-free atomics only");

void onInterrupt(int signal) {
  int none = 0;
  if (guards > 0 && firstSignal.compare_exchange_strong(none, signal)) return;
  OutputFile::removeUnfinished();
  constexpr std::string_view kMessage = "hpsdf: cancelled; nothing is half-written\n";
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, kMessage.data(), kMessage.size());
  _exit(128 + signal);
}

}  // namespace

void installInterruptHandlers() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before = {};
    sigaction(signal, nullptr, &before);
    if (before.sa_handler == SIG_IGN) continue;  // a parent such as nohup wants the signal ignored
    struct sigaction action = {};
    action.sa_handler = onInterrupt;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaction(signal, &action, nullptr);
  }
}

void removeInterruptHandlers() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction now = {};
    sigaction(signal, nullptr, &now);
    if (now.sa_handler == onInterrupt) std::signal(signal, SIG_DFL);
  }
}

InterruptGuard::InterruptGuard() {
  if (guards++ == 0) firstSignal = 0;
}

InterruptGuard::~InterruptGuard() { --guards; }

bool InterruptGuard::interrupted() { return signal() != 0; }

int InterruptGuard::signal() { return firstSignal.load(std::memory_order_relaxed); }

}  // namespace hpsdf::app
