#pragma once
// Counts a program's allocations by replacing the global operator new; included by one source file of each program.

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace hpsdf::support {

inline std::atomic<std::size_t> allocations = 0;

/// Returns the number of allocations by all threads while f runs.
template <typename F>
std::size_t allocationsOf(F&& f) {
  const std::size_t before = allocations;
  f();
  return allocations - before;
}

}  // namespace hpsdf::support

void* operator new(std::size_t size) {
  ++hpsdf::support::allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {  // used by stable sorts for their buffers
  ++hpsdf::support::allocations;
  return std::malloc(size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
// Prevents GCC's false warning of mismatched new and delete, which an inlined free causes.
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
