#pragma once

#include <functional>

namespace hpsdf::app {

/// Calls `work` and returns its result. If the system limits the stack to less than 8 MiB (`ulimit -s`), `work` runs on
/// a thread with a stack of 8 MiB, and so do the threads that are started from then on. Call it before other threads
/// are started.
int withLargeStack(const std::function<int()>& work);

}  // namespace hpsdf::app
