#include "console/large_stack.h"

#include <pthread.h>
#include <sys/resource.h>

#include <cstddef>
#include <thread>

namespace hpsdf::app {
namespace {

constexpr std::size_t kStackBytes = std::size_t{8} << 20;  // the usual limit

bool isStackSmall() {
  rlimit limit{};
  return getrlimit(RLIMIT_STACK, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY && limit.rlim_cur < kStackBytes;
}

/// Sets the size of the stacks of all threads that are started later, also by libraries such as Mesa. Otherwise the
/// system takes the limit for the size.
void setStackOfThreads() {
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0) return;
  pthread_attr_setstacksize(&attributes, kStackBytes);
  pthread_setattr_default_np(&attributes);
  pthread_attr_destroy(&attributes);
}

}  // namespace

int withLargeStack(const std::function<int()>& work) {
  if (!isStackSmall()) return work();
  setStackOfThreads();
  int result = 0;
  std::thread([&] { result = work(); }).join();
  return result;
}

}  // namespace hpsdf::app
