#pragma once

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace hpsdf {

/// Runs f where its parallel work uses at most so many threads; 0: all that the machine offers.
template <typename F>
auto withThreads(int threads, F&& f) {
  // asked for more than it may have, TBB would complain on stderr
  const int most = int(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  tbb::task_arena arena(threads == 0 ? tbb::task_arena::automatic : std::min(threads, most));
  return arena.execute(f);
}

}  // namespace hpsdf
