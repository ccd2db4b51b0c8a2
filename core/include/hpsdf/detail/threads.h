#pragma once

#include <functional>
#include <optional>
#include <type_traits>
#include <utility>

namespace hpsdf {

/// Calls `work` in a TBB arena of its own, so that its parallel work uses at most so many threads; 0: all that the
/// machine offers. What it throws is thrown.
void runWithThreads(int threads, const std::function<void()>& work);

/// The same for work that returns something, or nothing.
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
