#pragma once
// Parallel processing of many items in chunks. The boundaries of the chunks do not depend on the number of
// threads.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <string_view>
#include <vector>

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

/// Returns the number of chunks of `size` items each that are needed for `items` items. The last chunk may
/// be smaller.
inline std::size_t chunksOf(std::size_t items, std::size_t size) { return (items + size - 1) / size; }

/// Calls work(chunk, first item, number of items) for all chunks in parallel.
template <typename Work>
void forEachChunk(std::size_t items, std::size_t size, const Work& work) {
  tbb::parallel_for(std::size_t{0}, chunksOf(items, size),
                    [&](std::size_t chunk) { work(chunk, chunk * size, std::min(size, items - chunk * size)); });
}

/// Calls work(chunk, first item, number of items) for all chunks in parallel, and reports the fraction of
/// finished chunks.
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

/// Returns a callback that maps the progress of one task to the range `from` to `to` of the whole progress, which must
/// outlive it.
inline Progress partOf(const Progress& whole, double from, double to) {
  if (!whole.report) return whole;
  return {.report = [&whole, from, to](std::string_view task,
                                       double done) { whole.report(task, from + done * (to - from)); },
          .cancelled = whole.cancelled,
          .forecast = whole.forecast};
}

/// Count, sum, sum of squares and maximum of non-negative values.
struct Sums {
  std::size_t count = 0;
  double sum = 0, squares = 0, max = 0;

  void add(double x) {
    ++count;
    sum += x;
    squares += x * x;
    max = std::max(max, x);
  }
  void add(const Sums& other) {
    count += other.count;
    sum += other.sum;
    squares += other.squares;
    max = std::max(max, other.max);
  }

  // The mean and the root mean square are 0 if there are no values.
  double mean() const { return count == 0 ? 0 : sum / static_cast<double>(count); }
  double rms() const { return count == 0 ? 0 : std::sqrt(squares / static_cast<double>(count)); }
};

/// Returns the sum of the results of all chunks. In parallel, work(sum, first item, number of items) computes the sum
/// of each chunk. The sums are then added in the order of the chunks, so that rounding does not depend on the number of
/// threads.
template <typename Sum, typename Work>
Sum sumOfChunks(std::size_t items, std::size_t size, const Progress& progress, std::string_view task,
                const Work& work) {
  std::vector<Sum> parts(chunksOf(items, size));
  forEachChunk(items, size, progress, task,
               [&](std::size_t chunk, std::size_t first, std::size_t count) { work(parts[chunk], first, count); });
  Sum all;
  for (const Sum& part : parts) all.add(part);
  return all;
}

/// Like `sumOfChunks`, but adds the chunks' sums in any order and does not store them. The result is reproducible only
/// if the sum does not depend on the order of addition.
template <typename Sum, typename Work>
Sum unorderedSumOfChunks(std::size_t items, std::size_t size, const Progress& progress, std::string_view task,
                         const Work& work) {
  Sum all;
  std::mutex adding;
  forEachChunk(items, size, progress, task, [&](std::size_t, std::size_t first, std::size_t count) {
    Sum part;
    work(part, first, count);
    const std::lock_guard lock(adding);
    all.add(part);
  });
  return all;
}

/// Returns the concatenation of the lists of all chunks. In parallel, work(list, first item, number of
/// items) fills the list of each chunk.
template <typename Item, typename Work>
std::vector<Item> listOfChunks(std::size_t items, std::size_t size, const Progress& progress, std::string_view task,
                               const Work& work) {
  std::vector<std::vector<Item>> parts(chunksOf(items, size));
  forEachChunk(items, size, progress, task,
               [&](std::size_t chunk, std::size_t first, std::size_t count) { work(parts[chunk], first, count); });
  std::size_t count = 0;
  for (const auto& part : parts) count += part.size();
  std::vector<Item> all;
  all.reserve(count);
  for (auto& part : parts) {
    all.insert(all.end(), part.begin(), part.end());
    part = {};
  }
  return all;
}

}  // namespace hpsdf::detail
