#include "hpsdf/detail/threads.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace hpsdf {

void runWithThreads(int threads, const std::function<void()>& work) {
  // The number of threads that TBB allows. TBB prints a warning on stderr if an arena asks for more threads.
  const int most = int(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  tbb::task_arena arena(threads == 0 ? tbb::task_arena::automatic : std::min(threads, most));
  arena.execute(work);
}

}  // namespace hpsdf
