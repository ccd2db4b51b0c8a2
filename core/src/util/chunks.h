#pragma once
// Parallel work on many items in chunks, whose boundaries do not depend on the number of threads.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <mutex>
#include <string_view>

#include "hpsdf/error.h"

namespace hpsdf::detail {

/// Counts the finished parts of a task, reports their fraction, and throws `Cancelled` when the caller cancels.
class Parts {
 public:
  Parts(const Progress& progress, std::string_view task, std::size_t count)
      : progress_(progress), task_(task), count_(count) {}

  void begin() const { progress_.throwIfCancelled(); }
  void end() {
    if (!progress_.report) return;
    const std::lock_guard lock(reporting_);
    progress_.report(task_, static_cast<double>(++done_) / static_cast<double>(count_));
  }

 private:
  const Progress& progress_;
  std::string_view task_;
  std::size_t count_;
  std::mutex reporting_;
  std::size_t done_ = 0;
};

/// The number of chunks of `size` items that hold all items.
inline std::size_t chunksOf(std::size_t items, std::size_t size) { return (items + size - 1) / size; }

/// Calls work(chunk, first item, number of items) for all chunks in parallel.
template <typename Work>
void forEachChunk(std::size_t items, std::size_t size, const Work& work) {
  tbb::parallel_for(std::size_t{0}, chunksOf(items, size),
                    [&](std::size_t chunk) { work(chunk, chunk * size, std::min(size, items - chunk * size)); });
}

/// Calls work(chunk, first item, number of items) for all chunks in parallel, and reports the chunks done.
template <typename Work>
void forEachChunk(std::size_t items, std::size_t size, const Progress& progress, std::string_view task,
                  const Work& work) {
  Parts parts(progress, task, chunksOf(items, size));
  forEachChunk(items, size, [&](std::size_t chunk, std::size_t first, std::size_t count) {
    parts.begin();
    work(chunk, first, count);
    parts.end();
  });
}

}  // namespace hpsdf::detail
