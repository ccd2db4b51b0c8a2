#pragma once

#include <functional>
#include <optional>
#include <type_traits>
#include <utility>

namespace hpsdf {

/// Calls `work` in a TBB arena that limits its parallel loops to `threads` threads; 0 stands for all threads
/// that the machine offers. Rethrows an exception that `work` throws.
void runWithThreads(int threads, const std::function<void()>& work);

/// Calls `work` as `runWithThreads` does and returns its result.
template <typename Work>
std::invoke_result_t<Work&> withThreads(int threads, Work&& work) {
  using Result = std::invoke_result_t<Work&>;
  if constexpr (std::is_void_v<Result>) {
    runWithThreads(threads, std::ref(work));
  } else {
    std::optional<Result> result;
    runWithThreads(threads, [&] { result.emplace(work()); });
    return std::move(*result);
  }
}

}  // namespace hpsdf
