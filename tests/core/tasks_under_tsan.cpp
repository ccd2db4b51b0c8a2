// Checks that ThreadSanitizer reports nothing about correct oneTBB tasks (see cmake/tbb_for_tsan.cpp), and that it
// reports the data race that the argument `race` adds.

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>
#include <tbb/task_arena.h>

#include <cstdio>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

/// Exchanges data between nested tasks and their caller, so often that memory of tasks passes from thread to thread.
/// With `race`, all tasks also increment one unprotected counter.
long long sumOfTasks(bool race) {
  long long sum = 0;
  int counted = 0;
  for (int round = 0; round < 50; ++round) {
    std::vector<int> values(2000);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = int(i * 7919 % 2000);
    std::vector<std::vector<int>> parts(100);
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
      if (race) ++counted;
      parts[part].assign(values.begin(), values.begin() + 20);
      tbb::parallel_for(std::size_t{0}, parts[part].size(), [&](std::size_t i) { ++parts[part][i]; });
    });
    for (const std::vector<int>& part : parts) sum += part.back();
    tbb::parallel_sort(values.begin(), values.end());
    sum += tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, values.size()), 0ll,
        [&](const auto& range, long long begun) {
          for (std::size_t i = range.begin(); i < range.end(); ++i) begun += values[i];
          return begun;
        },
        std::plus<>());
    std::vector<int> one, other;
    tbb::parallel_invoke([&] { one.assign(10, round); }, [&] { other.assign(10, round); });
    sum += one.back() + other.back();
    try {
      tbb::parallel_for(0, 100, [](int i) {
        if (i == 57) throw std::runtime_error(std::to_string(i));
      });
    } catch (const std::runtime_error& error) {
      sum += std::stoi(error.what());
    }
  }
  return sum + counted;
}

}  // namespace

int main(int count, char** arguments) {
  const bool race = count > 1 && std::strcmp(arguments[1], "race") == 0;
  const tbb::global_control workers(tbb::global_control::max_allowed_parallelism, 4);
  tbb::task_arena arena(4);
  long long sums[2];
  const auto ask = [&](int place) { arena.execute([&, place] { sums[place] = sumOfTasks(race); }); };
  std::thread other(ask, 1);
  ask(0);
  other.join();
  std::printf("%lld %lld\n", sums[0], sums[1]);
}
