#include "console/interrupt.h"

#include <unistd.h>

#include <atomic>
#include <csignal>
#include <string_view>

#include "hpsdf/detail/output_file.h"

namespace hpsdf::app {
namespace {

std::atomic<int> guards = 0;
std::atomic<bool> interruptedFlag = false;
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free,
              "a signal handler may use lock-free atomics only");

void onInterrupt(int signal) {
  if (guards > 0 && !interruptedFlag.exchange(true)) return;
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

InterruptGuard::InterruptGuard() {
  if (guards++ == 0) interruptedFlag = false;
}

InterruptGuard::~InterruptGuard() { --guards; }

bool InterruptGuard::interrupted() { return interruptedFlag.load(std::memory_order_relaxed); }

}  // namespace hpsdf::app
